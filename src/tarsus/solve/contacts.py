"""What the feet do where a part of a run begins, and what they carry on to it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tarsus.base.events import CONTACT_BEGINS, EventKind, FootState

Floats = npt.NDArray[np.float64]

CARRIED = (
    "contact",
    "since",
    "aged",
    "parted",
    "left",
    "rose",
    "low",
    "start",
    "slide",
    "sense",
    "place",
    "slipped",
    "apex",
    "apex_time",
    "integral",
    "due",
    "facet",
    "wedged",
)
"""What a foot carries on from one part of its run to the next, the columns of a row: `tarsus.base.events.FootState`;
[s] when its contact began, or would have begun had it aged all along, its age when it last left the ground, and when it
did; [s] when its pull last exceeded its contact and when it last came to the ground or left it, and flights too low to
count; how its flight and its slide begin (the engine's own numbers; NaN of a foot that was just released), sense of
sliding (NaN of a held foot that sticks or slides as it moves), place [m] where it sticks (of a walker's foot the sense
across the way), path [m] that a walker's foot has slid; highest gap [m] of the flight and when [s], the gap's integral
[m s]; 1 where contacts may change at this very moment; of uneven ground the number of the facet (NaN: the one below the
foot), and -1 or 1 of a foot that stands in the corner at its rear or front end."""

MOMENTS = [CARRIED.index(name) for name in ("since", "parted", "left", "rose", "apex_time")]
"""What feet carry on that are moments."""
CONTACT, _SINCE, _PARTED, _START, _SENSE = (
    CARRIED.index(name) for name in ("contact", "since", "parted", "start", "sense")
)
APEX = [CARRIED.index(name) for name in ("apex", "apex_time")]
"""Their columns: of the contact, and of the highest gap and its time."""


def fresh_feet(runs: int, feet: int) -> Floats:
    """What feet (runs, feet, k) carry on where nothing has happened: in the air, to be looked at."""
    out = np.zeros((runs, feet, len(CARRIED)))
    out[..., CARRIED.index("left")] = -np.inf
    out[..., CARRIED.index("due")] = 1.0
    out[..., CARRIED.index("facet")] = np.nan
    return out


def earlier(feet: Floats, by: float) -> Floats:
    """What feet (m, k) carry on, so long [s] before, as where a motion repeats."""
    out = feet.copy()
    out[:, MOMENTS] -= by
    return out


def mask_of(feet: Floats) -> int:
    """Mask of the contact mode of feet (m, k) by what they carry on (`tarsus.core.modes`)."""
    contact = feet[:, CONTACT].astype(int).tolist()
    held = sum(1 << i for i, one in enumerate(contact) if one != FootState.AIR)
    return held | sum(1 << (len(contact) + i) for i, one in enumerate(contact) if one == FootState.STUCK)


@dataclass(frozen=True)
class Contacts:
    """What the feet do where a window starts.

    held: numbers of the feet on the ground; since: begin [s] of each one's contact, at the start unless given (its
    adhesion counts from there); leaving: numbers of free feet at the ground that were just released. A free foot at the
    ground that is not leaving is judged as everywhere: it bounces, is captured, rests or departs.
    """

    held: Sequence[int] = ()
    since: Sequence[float] | None = None
    leaving: Sequence[int] = ()

    @classmethod
    def of(cls, held: Mapping[int, float]) -> Contacts:
        """Of feet on the ground, by since when they are there [s]."""
        feet = sorted(held)
        return cls(feet, [held[foot] for foot in feet])

    @property
    def begun(self) -> dict[int, float]:
        """Since when [s] each foot is on the ground, of those of which it is known."""
        return dict(zip(self.held, self.since or (), strict=False))

    def faults(self, feet: int, start: float) -> list[str]:
        """Sentences on what is wrong for a plan of so many feet and a window that starts at ``start`` [s]."""
        problems = [
            f"{name}: there is no foot number {i} (feet are numbered 0 to {feet - 1})"
            for name, numbers in (("held", self.held), ("leaving", self.leaving))
            for i in numbers
            if not 0 <= i < feet
        ]
        problems += [f"foot {i} cannot be held and be leaving" for i in sorted(set(self.held) & set(self.leaving))]
        if self.since is not None:
            if len(self.since) != len(self.held):
                problems.append(f"since: expected a time for each of {len(self.held)} held feet, got {len(self.since)}")
            elif not all(one <= start for one in self.since):
                problems.append(f"since: a contact held at {start:g} s has begun by then")
        return problems

    def carried(self, feet: int, start: float) -> Floats:
        """What feet (m, k) carry on to a window that starts at ``start`` [s]."""
        out, held, leaving = fresh_feet(1, feet)[0], list(self.held), list(self.leaving)
        out[:, [_PARTED, APEX[1]]] = start
        out[held, CONTACT], out[held, _SENSE] = FootState.SLIPPING, np.nan
        out[held, _SINCE] = start if self.since is None else self.since
        out[leaving, _START] = np.nan
        return out

    def after(self, events: npt.NDArray[np.void], start: float, end: float) -> Contacts:
        """What the feet do after the events, in time order, of a window that began with these at ``start`` [s] and ends
        at ``end`` [s]: a foot whose last bounces accumulate just beyond it is on the ground by then."""
        since = self.since if self.since is not None else [start] * len(self.held)
        held = dict(zip(self.held, since, strict=True))
        each = (events[name].tolist() for name in ("foot", "kind", "time"))
        for foot, kind, time in zip(*each, strict=True):
            _change(held, foot, kind, min(time, end))
        return Contacts.of(held)

    def middle_of_flight(self, events: npt.NDArray[np.void], begin: float, end: float) -> float | None:
        """Time [s] in the middle of the longest time from ``begin`` to ``end`` in which no foot is on the ground, from
        these on; None without one. events: those in between, in order."""
        now, since, best, where = dict.fromkeys(self.held, begin), begin, 0.0, None
        each = (events[name].tolist() for name in ("time", "foot", "kind"))
        for time, foot, kind in [*zip(*each, strict=True), (end, -1, 0)]:
            if not now and time - since > best:
                best, where = time - since, 0.5 * (since + time)
            _change(now, foot, kind, time)
            since = time
        return where

    def earlier(self, by: float) -> Contacts:
        """The same so long [s] before, as where a motion repeats."""
        return Contacts(self.held, None if self.since is None else [one - by for one in self.since], self.leaving)


_BEGINS = frozenset(map(int, CONTACT_BEGINS))
_ENDS = frozenset((int(EventKind.RELEASE), int(EventKind.BOUNCE)))
_AT_START = int(EventKind.CONTACT_AT_START)


def _change(held: dict[int, float], foot: int, kind: int, time: float) -> None:
    if kind in _BEGINS:
        if not (kind == _AT_START and foot in held):
            held[foot] = time
    elif kind in _ENDS:
        held.pop(foot, None)
