"""The arrays a kernel works on, as named tuples: what ``plan`` makes, what a run owns.

Sizes: Q contact modes, nk step lengths, m feet, nd drives, nc channels (drives, then volts), ni inputs
(2 m + nd + 1), nb blocks of the free structure (modes with fewer are padded with zeros).
"""

from __future__ import annotations

from collections import namedtuple

# Contact modes, stacked along the first axis; see core.modes for each entry.
Modes = namedtuple(
    "Modes",
    "mask nb blocks inputs input_norm beta outputs feed feed_rate to_physical offset from_physical "
    "held held_feed jump mobility reaction side side_rate skew level sway printed printed_feed printed_damping",
)
# Step tables, stacked along the first axis, with the step lengths and the Taylor terms that land inside a step.
Tables = namedtuple(
    "Tables",
    "lengths terms exponential node_state node_input node_constant state_input state_constant envelope",
)
# flags (m,), parameters (m, np), pointer (m, 8) addresses of users' laws, volts (m,) channel of the foot or -1.
Laws = namedtuple("Laws", "flags parameters pointer volts")
# What a run carries from call to call. apex (m, 3): highest gap since the last event or mark and when, integral of the
# gap over time since the start (NaN where apexes are not tracked).
State = namedtuple("State", "count real w physical cursor since order apex")
# Runs that differ in law parameters (nr, m, np) and initial state (nr, 2n) only; codes and event_end (nr,) and
# finish (nr, 4 + 2m), filled by the kernel: end time, steps, rejected steps, open apexes and their times.
Batch = namedtuple("Batch", "parameters initial codes event_end finish")
# events (ne, 12), trace (nt, width): filled from the start, emptied by the caller when full.
Output = namedtuple("Output", "events trace")
Work = namedtuple(
    "Work", "values constant active linear nodes volts margin power vpower series line velocity state other matrix"
)

# State.count
(MODE, CLASS, EVENTS, ROWS, PENDING, CHECK, STEPS, STALLED, TRACK, RECORD, MAX_STEPS, REJECTED, RUN, FRESH, BASE,
 MARKS, FIRST_CLASS, LAUNCH, LAUNCHING) = range(19)  # fmt: skip
COUNTS = 19
# State.real
TIME, END, TOL_GAP, TOL_DRIVE, EPS_GAP, EPS_FORCE, EPS_SPEED, REST_HEIGHT, PROGRESS, MIN_PROGRESS, PROBE, \
    MARK, PERIOD, GROWTH = range(14)  # fmt: skip
REALS = 14
# columns of an event row
(E_TIME, E_FOOT, E_KIND, E_BEFORE, E_AFTER, E_PULL, E_STRENGTH, E_ENERGY, E_ADHESION, E_APEX, E_APEX_TIME,
 E_INTEGRAL) = range(12)  # fmt: skip
EVENT_WIDTH = 12
# columns of a trace row before the state and the nodal inputs
T_TIME, T_LENGTH, T_FRACTION, T_MODE, T_CLASS = range(5)
TRACE_HEAD = 5

BOUNCE, CAPTURE, RELEASE, REST, CONTACT_AT_START, PERIOD_MARK = 1, 2, 3, 4, 5, 6

# Return codes of the kernel.
DONE, STALL, STEP_TOO_SMALL, STEP_LIMIT, NOT_FINITE, NEED_MODE, EVENTS_FULL, TRACE_FULL = range(8)
