"""The arrays of the walking engine, as named tuples. Direction 0 is upward, 1 along the way.

Sizes: nb body coordinates, nl legs, m feet, nd drives, nt kinds of leg blocks, nk step lengths, N nodes.
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
# lengths (nk,); state (nk, nt, 4, N): u of u0, u of w0, w of u0, w of w0; force, film (nk, nt, 2, N, N): u and w at
# the nodes (last axis) of a force and of a momentum at one node; reach (nk, nt, 2): largest |u| under a constant one;
# rate (nt,) [1/s] of the fastest motion; longest (nt,) first class that resolves the block's own oscillation.
Tables = namedtuple("Tables", "lengths state force film reach rate longest")
# Runs: parameters (nr, m, np), initial (nr, 2 n); codes, event_end, mark_end (nr,); finish (nr, 3).
Batch = namedtuple("Batch", "parameters initial codes event_end mark_end finish")
# count, real; body (2, nb) displacement and velocity; foot (nl, 2, 2): per direction u and flowing rate w; contact
# (m,) state; sense (m,) of sliding, +-1, 0 without friction; since (m,); order (m,) 1 where it has just left, 2 where it has just
# begun to slide; apex (m, 3);
# slipped (m,); heave (2,) lowest and highest; energy (5,); ahead (nb, AHEAD) of the body's velocity in powers of time;
# cursor; since as in core.arrays.
State = namedtuple(
    "State", "count real body foot contact sense since order apex slipped heave energy ahead cursor"
)
# events (ne, 12); marks (nm, 2 + nb + 2 m + 2); times (ns,) at which samples (ns, width) are taken.
Output = namedtuple("Output", "events marks times samples")
Work = namedtuple(
    "Work",
    "drive volts bx bv nx push drag momentum place q u w load smooth strength film filmed gap rate margin bound along solver key "
    "foot body series column row matrix newton line when",
)

# State.count; events are counted where core.landing.log counts them
(MARKROWS, SAMPLE, EVENTS, CLASS, STEPS, STALLED, REJECTED, RUN, FRESH, MARKS, TRACK, ACCOUNT, MAX_STEPS, FIRST_CLASS,
 BASE, MARK_BASE, LAUNCH, LAUNCHING) = range(18)  # fmt: skip
COUNTS = 18
# State.real
(TIME, END, TOL_GAP, TOL_DRIVE, EPS_GAP, EPS_FORCE, EPS_SPEED, REST_HEIGHT, PROGRESS, MIN_PROGRESS, MARK,
 PERIOD, PROBE) = range(13)  # fmt: skip
REALS = 13
# Powers of time in which the body's velocity goes on into the next step.
AHEAD = 5
# State.energy
WORK, DAMPING, FILM, SMOOTH, FRICTION = range(5)
ENERGIES = 5
