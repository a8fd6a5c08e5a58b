"""What happens to a foot: kinds of events, states of contact, and every change of state that the engine makes.

The one home of these numbers; the engine's own are in `native/march/kinds.hpp`, which a test holds to this file.
"""

from __future__ import annotations

from enum import IntEnum


class EventKind(IntEnum):
    """Kind of an event, as runs hold it."""

    BOUNCE = 1
    """Reaches the ground and departs."""
    CAPTURE = 2
    """Reaches the ground and is held."""
    RELEASE = 3
    """Its pull outgrows what holds it."""
    REST = 4
    """Its remaining flights are lower than any that matters, and accumulate."""
    CONTACT_AT_START = 5
    """Lies on the ground without an impact."""
    PERIOD_MARK = 6
    """End of a drive period, in the air: no event of its own, but measures need it."""
    SLIP_BEGINS = 7
    """A held foot begins to slide."""
    STICK_BEGINS = 8
    """A sliding foot stops."""
    AVERAGED_CONTACT = 9
    """Pressed down, it bounces on lower than any flight that matters, with hardly any loss: a contact on average."""


IMPACTS = (EventKind.BOUNCE, EventKind.CAPTURE, EventKind.REST, EventKind.AVERAGED_CONTACT)
"""Events that are impacts."""

CONTACT_BEGINS = (EventKind.CAPTURE, EventKind.REST, EventKind.CONTACT_AT_START, EventKind.AVERAGED_CONTACT)
"""Events with which a contact begins."""

SLIDING = (EventKind.SLIP_BEGINS, EventKind.STICK_BEGINS)
"""Events along the ground."""

EVENT_WORDS: dict[int, str] = {
    kind: kind.name.lower().replace("_", " ") for kind in EventKind if kind is not EventKind.PERIOD_MARK
}
"""Kind of an event -> the words used in `events.csv` and in reports."""


class FootState(IntEnum):
    """What a foot can be doing."""

    AIR = 0
    STUCK = 1
    """Held on the ground and still along it."""
    SLIPPING = 2
    """Held on the ground and sliding."""

    @property
    def words(self) -> str:
        return "in the air" if self is FootState.AIR else self.name.lower()


AIR, STUCK, SLIPPING = FootState

TRANSITIONS = (
    (
        AIR,
        AIR,
        "bounce",
        "reaches the ground and departs by the landing rule (pull > f_a(0) unless another is given): v+ = e v-",
    ),
    (AIR, STUCK, "capture", "reaches the ground and is held; friction stops what it has along the ground"),
    (AIR, SLIPPING, "capture", "reaches the ground and is held, faster along it than the impact's friction stops"),
    (STUCK, AIR, "release", "pull + smooth force > f_a(t - t_c)"),
    (SLIPPING, AIR, "release", "pull + smooth force > f_a(t - t_c)"),
    (STUCK, SLIPPING, "slip begins", "|F_t| > mu (N + f_a)"),
    (SLIPPING, STUCK, "stick begins", "sliding speed reaches 0 and |F_t| <= mu (N + f_a)"),
    (SLIPPING, SLIPPING, "turns round", "sliding speed reaches 0 and |F_t| > mu (N + f_a)"),
)
"""(from, to, event, condition) of every change of state that the engine makes, Fig. 4.6 and what it leaves out; a foot
whose flights are lower than any that matters is held as well (rest, averaged contact)."""
