"""Flights and contacts of feet, from the events of many runs or from a record; what counts as a bounce."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from tarsus.base.events import EventKind
from tarsus.core import _native
from tarsus.measure.segments import Floats, Rows, owners

RESOLUTION: float = _native.RESOLUTION
"""Height [m] that a flight must clear to be seen: the resolution of the source's vibrometer."""
DWELL: float = _native.DWELL
"""Length [s] that the contact before a flight must stay below for it to be a bounce. Captures that end by themselves
last 40 to 70 us, and an instrument sees one impact in them; contacts that a drive holds last about half its period. It
lies ten times above the first, and a tenth of the period five times below the second."""
DWELL_SHARE: float = _native.DWELL_SHARE
"""The same as a part of the drive period, where that is shorter."""
COUNTED = (
    f"flights above {RESOLUTION * 1e6:g} µm, after contacts shorter than {DWELL * 1e3:g} ms or a tenth of the drive "
    "period"
)
"""What is counted as a bounce unless height and dwell are given, for a table of several drive periods."""

PERIOD_MARK = EventKind.PERIOD_MARK


@dataclass(frozen=True)
class Counting:
    """What is counted: flights above ``height`` [m], those after contacts shorter than ``dwell`` [s] as bounces; of
    several feet or runs ``dwell`` may be that of each (nh,)."""

    height: float
    dwell: float | Floats

    @classmethod
    def of(cls, period: float | Floats, height: float = RESOLUTION, dwell: float | None = None) -> Counting:
        """The rule for a drive period [s]; ``dwell`` is `DWELL`, or a tenth of the period if that is shorter, unless
        it is given."""
        if dwell is not None:
            return cls(height, dwell)
        own = np.minimum(DWELL, DWELL_SHARE * np.asarray(period, dtype=float))
        return cls(height, own if own.ndim else float(own))

    def of_one(self, number: int) -> Counting:
        """The rule of one of them."""
        return Counting(self.height, float(self.dwell if np.ndim(self.dwell) == 0 else np.asarray(self.dwell)[number]))

    def words(self) -> dict[str, str]:
        """Height and dwell for a sentence; a dwell that differs from run to run is given from least to most."""
        ends = dict.fromkeys(f"{edge * 1e3:.4g}" for edge in (np.min(self.dwell), np.max(self.dwell)))
        return {"height": f"{self.height * 1e6:.4g} um", "dwell": f"{' to '.join(ends)} ms"}


@dataclass(frozen=True)
class Points:
    """Values at instants of nh histories: number of the history, time [s] and value (np,) of each."""

    own: Rows
    time: Floats
    value: Floats


@dataclass(frozen=True)
class Knots:
    """Integral of the gap [m s] from 0 to instants [s] of nh histories, those of one after those of the other."""

    first: Rows
    time: Floats
    integral: Floats


@dataclass(frozen=True)
class Flights:
    """Flights of nh histories in time order, those of history h at ``first[h]:first[h + 1]``.

    start, end (nf,) [s]; apex, apex_time (nf,) highest gap seen [m], 0 where none was, and when [s]; rebound (nf,) True
    where the flight began by a bounce. until (nh,) [s] end of the history; airborne (nh,): the first flight began with
    the run; aloft (nh,): the last one was cut off by the end. Between flights a foot is on the ground.
    """

    first: Rows
    start: Floats
    end: Floats
    apex: Floats
    apex_time: Floats
    rebound: NDArray[np.bool_]
    until: Floats
    airborne: NDArray[np.bool_]
    aloft: NDArray[np.bool_]

    @cached_property
    def own(self) -> Rows:
        """Number of the history of every flight."""
        return owners(self.first)


class Histories:
    """What nh feet did: ``flights``, ``impacts`` with their approach speeds [m/s], ``tops``, the highest gaps seen [m],
    and ``knots``, the integral of the gap; carried out by ``native``, the engine's measures."""

    flights: Flights
    impacts: Points
    tops: Points
    knots: Knots
    native: Any

    def seen(self, height: float) -> Rows:
        """Numbers of the flights that leave the ground for an instrument: their apex clears ``height`` [m], or the run
        began with them. What is between two of them is one contact."""
        return self.native.seen(height)

    def hops(self, height: float) -> Rows:
        """Numbers of the flights that began from the ground and clear ``height`` [m], cut off by the end or not."""
        return self.native.hops(height)

    def bounces(self, counting: Counting) -> Rows:
        """Numbers of the flights that are bounces: from a touchdown to the next one, or cut off by the end, with an
        apex that clears the height, after a contact shorter than the dwell.

        That contact is the whole stay on the ground from first touchdown to last departure, with all flights below
        the height in it. A stay that began with the run is no touchdown. How a flight began plays no part.
        """
        return self.native.bounces(counting.height, self.dwell(counting))

    def rebounds(self, height: float) -> Rows:
        """Numbers of the flights that began by restitution and clear ``height`` [m]."""
        return self.native.rebounds(height)

    def contacts(self, height: float) -> tuple[Rows, Floats, Floats]:
        """History, start and end [s] of every stay on the ground, flights below ``height`` [m] included: those from the
        start, those between flights, those until the end; in time order."""
        return self.native.contacts(height)

    def share(self, own: Rows, times: Floats) -> tuple[Rows, Floats, NDArray[np.bool_]]:
        """Of histories ``own`` (nq,) with two knots at least: the knot before each of ``times`` (nq,), the part of the
        time to the next one that has passed, and whether that is a whole flight from touchdown to touchdown."""
        at, part, whole = self.native.shares(own, times)
        return at, part, whole.astype(bool)

    def dwell(self, counting: Counting) -> Floats:
        """Dwell [s] of every history (nh,)."""
        return np.ascontiguousarray(np.broadcast_to(counting.dwell, self.flights.until.shape), dtype=float)


@dataclass(frozen=True)
class KnownHistories(Histories):
    """What nh feet did that is known already, as from a record."""

    flights: Flights
    impacts: Points
    tops: Points
    knots: Knots

    @cached_property
    def native(self) -> Any:
        return _native.Histories.known(self.flights, self.impacts, self.tops, self.knots)


class Columns(Protocol):
    """Fields of events by name: a structured array, or a mapping of arrays."""

    def __getitem__(self, name: str, /) -> np.ndarray: ...


_FIELDS = ("time", "foot", "kind", "speed_before", "apex", "apex_time", "gap_integral")


@dataclass(frozen=True)
class EventHistories(Histories):
    """The same from events of nr runs: of m feet that are asked for, foot f of run r has number ``r m + f``.

    events: fields time, foot, kind, speed_before, apex, apex_time, gap_integral, period marks included (kind 6), run
    after run, each foot's in the order in which the engine met them; first (nr + 1,): run r has rows
    ``first[r]:first[r + 1]``; ends (nr,) [s]: the time that each run reached; feet: numbers of the m feet among so
    many. Nothing is computed before it is asked for.
    """

    events: Columns
    first: Rows
    ends: Floats
    feet: Sequence[int]
    among: int

    def __getstate__(self) -> dict[str, object]:
        return {name: self.__dict__[name] for name in self.__dataclass_fields__}

    @cached_property
    def native(self) -> Any:
        place = np.full(self.among, -1)
        place[list(self.feet)] = np.arange(len(self.feet))
        columns = [np.ascontiguousarray(self.events[name], dtype=float) for name in _FIELDS]
        ends = np.ascontiguousarray(self.ends, dtype=float)
        return _native.Histories.of_events(columns, np.asarray(self.first), ends, place, len(self.feet))

    @cached_property
    def flights(self) -> Flights:
        """Flights, by the events that begin and end them."""
        first, start, end, apex, when, rebound, until, airborne, aloft = self.native.flights()
        began, first_up, cut = (one.astype(bool) for one in (rebound, airborne, aloft))
        return Flights(first, start, end, apex, when, began, until, first_up, cut)

    @cached_property
    def impacts(self) -> Points:
        """Impacts with their approach speeds [m/s]."""
        return Points(*self.native.impacts())

    @cached_property
    def tops(self) -> Points:
        """Highest gaps [m] that events and period marks saw, and when."""
        return Points(*self.native.tops())

    @cached_property
    def knots(self) -> Knots:
        """Integral of the gap at the start, at every event and, of a foot on the ground, at the end."""
        own, time, integral = self.native.knots()
        counts = np.bincount(own, minlength=len(self.ends) * len(self.feet))
        return Knots(np.concatenate([[0], np.cumsum(counts)]), time, integral)
