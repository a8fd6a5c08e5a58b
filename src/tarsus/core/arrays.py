"""What runs are made of as arrays: columns of events, codes; a legged body and its energies."""

from __future__ import annotations

from collections import namedtuple

# columns of an event row
(
    E_TIME,
    E_FOOT,
    E_KIND,
    E_BEFORE,
    E_AFTER,
    E_PULL,
    E_STRENGTH,
    E_ENERGY,
    E_ADHESION,
    E_APEX,
    E_APEX_TIME,
    E_INTEGRAL,
) = range(12)
EVENT_WIDTH = 12  # as many as the columns above

# Return codes of the engine, as in native/march/kinds.hpp.
DONE, STALL, STEP_TOO_SMALL, STEP_LIMIT, NOT_FINITE, JAMMED, GOING_ON = range(
    7
)  # the last never of a run that has ended

# What describes a legged robot to the engine. Sizes: nb body coordinates, nl legs, m feet, nd drives, nt kinds of leg blocks, w directions.
# Direction 0 is upward, 1 along the way, and 2 across it, of legs that move sideways.
# body_mass (nb,); body_weight (nb, 2) per unit of gravity; body_stiffness, body_damping (nb, nb) within the body;
# lever (nb,) largest hip entry; mass (nl,); stiffness, damping (nl, w); hip (nl, w, nb);
# gap (nl,) clearance at rest; foot (nl,) number of its foot or -1; leg (m,) leg of a foot; kind (nl, w) of its blocks;
# weight (nl,); first (nl + 1,), drive, gain (., w): drives that act on the foot of each leg; body_load (nd, nb); place (nl,) of a
# foot at rest along the way; points of each line of uneven ground (nc,), none of level ground, whether it is periodic, and whether its facets are not
# alike; line (m,) along which each foot goes; directions w.
Body = namedtuple(
    "Body",
    "body_mass body_weight body_stiffness body_damping lever mass stiffness damping hip gap foot leg kind weight first drive gain body_load "
    "place points periodic patched line directions",
)

# Work done by drives and weight, and by dampers, films, smooth forces and friction, in samples and at the end of a run.
WORK, DAMPING, FILM, SMOOTH, FRICTION = range(5)
ENERGIES = 5  # as many as those above

LANES = 8  # derivatives of a flight that the engine carries at once
