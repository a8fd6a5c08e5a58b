"""What describes a legged robot to the engine, and the order of its energies. Direction 0 is upward, 1 along the way.

Sizes: nb body coordinates, nl legs, m feet, nd drives, nt kinds of leg blocks.
"""

from __future__ import annotations

from collections import namedtuple

# body_mass, body_weight (nb,); lever (nb,) largest hip entry; mass (nl,); stiffness, damping (nl, 2); hip (nl, 2, nb);
# gap (nl,) clearance at rest; foot (nl,) number of its foot or -1; leg (m,) leg of a foot; kind (nl, 2) of its blocks;
# weight (nl,); first (nl + 1,), drive, gain (., 2): drives that act on the foot of each leg; body_load (nd, nb).
Body = namedtuple(
    "Body",
    "body_mass body_weight lever mass stiffness damping hip gap foot leg kind weight first drive gain body_load",
)

# Work done by drives and weight, and by dampers, films, smooth forces and friction, in samples and at the end of a run.
WORK, DAMPING, FILM, SMOOTH, FRICTION = range(5)
ENERGIES = 5
