"""Whether windows beside others have their events, and from when on they have not."""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from tarsus.core import arrays as a
from tarsus.solve.differences import EventKeys, matched_events
from tarsus.solve.window_run import Ran, gathered

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]


class NoSlope(Enum):
    """Why there is no derivative of what comes after some moment; the value is a sentence."""

    OTHERWISE = (
        "{foot} touches or leaves the ground otherwise from {time} on where the number is a little another"
    )
    KINKED = "to both sides of the number {foot} moves otherwise at {time}: an edge or a threshold lies there"
    UNSURE = "what {foot} does at {time} is within the error of a step"
    STOPPED = "a window with the number a little another stops before its end"


class Lost(NamedTuple):
    """From when on windows have no derivative: times (nw,) [s], infinite of those that have one to the end, feet and
    reasons."""

    time: Floats
    foot: Integers
    doubt: list[NoSlope]

    @classmethod
    def none(cls, count: int) -> Lost:
        """That none has lost any."""
        return cls(np.full(count, np.inf), np.full(count, -1, dtype=np.int64), [NoSlope.OTHERWISE] * count)

    def or_from(self, time: float, window: int, foot: int, doubt: NoSlope) -> None:
        """Note that one has none from a time on, unless it has none from an earlier one."""
        if time < self.time[window]:
            self.time[window], self.foot[window], self.doubt[window] = time, foot, doubt


def events_of(ran: Ran) -> Integers:
    """Number of the window of every event."""
    return np.repeat(np.arange(len(ran.codes)), np.diff(ran.begin))


class EventsAlike(NamedTuple):
    """Events of other windows as those of windows: place (ne,) of the other's, -1 of none; since (nw,): from when on
    [s] they are not the same; lost: where that is no matter of the end."""

    place: Integers
    since: Floats
    lost: Lost


def alike(own: Ran, other: Ran, late: Floats, doubt: NoSlope) -> EventsAlike:
    """Foot by foot the same kinds of events one after the other: feet far from each other may change places. late (nw,)
    [s]: from when on events may be missing."""
    columns = [a.E_FOOT, a.E_KIND]
    nw = len(own.codes)
    out = EventsAlike(np.full(len(own.events), -1, dtype=np.int64), np.full(nw, np.inf), Lost.none(nw))
    same = np.diff(own.begin) == np.diff(other.begin)
    alike = np.flatnonzero(same)
    here, first = gathered(own.begin, alike)
    there, _ = gathered(other.begin, alike)
    differs = (own.events[here][:, columns] != other.events[there][:, columns]).any(axis=1)
    out.place[here] = there
    apart = np.unique(np.searchsorted(first, np.flatnonzero(differs), side="right") - 1)
    for w in [*alike[apart].tolist(), *np.flatnonzero(~same).tolist()]:
        time, foot = _matched(own, other, w, out.place)
        out.since[w] = time
        if time < late[w]:
            out.lost.or_from(time, w, foot, doubt)
    for w in np.flatnonzero(own.codes != other.codes).tolist():
        out.since[w] = -np.inf
        out.lost.or_from(-np.inf, w, -1, NoSlope.STOPPED)
    return out


def _matched(own: Ran, other: Ran, window: int, place: Integers) -> tuple[float, int]:
    """Put the events of one window into places, foot by foot; from when on there are others, and of which foot."""
    mine, theirs = (np.arange(*one.begin[window : window + 2]) for one in (own, other))
    rows = own.events[mine], other.events[theirs]
    found = matched_events(*(EventKeys(one[:, a.E_FOOT], one[:, a.E_KIND], one[:, a.E_TIME]) for one in rows))
    place[mine] = -1
    place[mine[found.here]] = theirs[found.there]
    return found.time, found.foot
