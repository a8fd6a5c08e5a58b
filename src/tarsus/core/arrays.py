"""What runs are made of as arrays: laws of feet, columns of events and of recorded steps, kinds and codes."""

from __future__ import annotations

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
