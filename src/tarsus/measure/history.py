"""Flights and contacts of feet, from the events of many runs or from a record; what counts as a bounce."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tarsus.base.events import IMPACTS, EventKind
from tarsus.measure.segments import Floats, Rows, firsts, largest, last_at, owners

RESOLUTION = 1e-7
"""Height [m] that a flight must clear to be seen: the resolution of the source's vibrometer."""
DWELL = 5e-4
"""Length [s] that the contact before a flight must stay below for it to be a bounce. Captures that let go by themselves
last 40 to 70 us, and an instrument sees one impact in them; contacts that a drive holds last about half its period. It
lies ten times above the first, and a tenth of the period five times below the second."""
DWELL_SHARE = 0.1
"""The same as a part of the drive period, where that is shorter."""
COUNTED = (
    f"flights above {RESOLUTION * 1e6:g} µm, after contacts shorter than {DWELL * 1e3:g} ms or a tenth of the drive "
    "period"
)
"""What is counted as a bounce unless height and dwell are given, for a table of several drive periods."""

BOUNCE, CAPTURE, RELEASE, REST, CONTACT_AT_START, PERIOD_MARK = list(EventKind)[:6]
"""Kinds of events that are impacts."""


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
        return Counting(
            self.height, float(self.dwell if np.ndim(self.dwell) == 0 else np.asarray(self.dwell)[number])
        )

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

    def seen(self, height: float) -> Rows:
        """Numbers of the flights that leave the ground for an instrument: their apex clears ``height`` [m], or the run
        began with them. What is between two of them is one contact."""
        clear = self.apex > height
        clear[self.first[:-1][self.airborne]] = True
        return np.flatnonzero(clear)

    def hops(self, height: float) -> Rows:
        """Numbers of the flights that began from the ground and clear ``height`` [m], cut off by the end or not."""
        found = self.seen(height)
        own = self.own[found]
        return found[~(self.airborne[own] & (found == self.first[own]))]

    def bounces(self, counting: Counting) -> Rows:
        """Numbers of the flights that are bounces: from a touchdown to the next one, or cut off by the end, with an
        apex that clears the height, after a contact shorter than the dwell.

        That contact is the whole stay on the ground from first touchdown to last departure, with all flights below
        the height in it. A stay that began with the run is no touchdown. How a flight began plays no part.
        """
        found = self.seen(counting.height)
        own = self.own[found]
        after = np.flatnonzero(own[1:] == own[:-1]) + 1
        stay = self.start[found[after]] - self.end[found[after - 1]]
        dwell = np.broadcast_to(counting.dwell, self.until.shape)
        return found[after[stay < dwell[own[after]]]]

    def rebounds(self, height: float) -> Rows:
        """Numbers of the flights that began by restitution and clear ``height`` [m]."""
        return np.flatnonzero(self.rebound & (self.apex > height))

    def contacts(self, height: float) -> tuple[Rows, Floats, Floats]:
        """History, start and end [s] of every stay on the ground, flights below ``height`` [m] included: those from the
        start, those between flights, those until the end; of one history they are in time order."""
        found = self.seen(height)
        own = self.own[found]
        same = own[1:] == own[:-1]
        head, tail = np.append(True, ~same)[: len(own)], np.append(~same, True)[: len(own)]
        down = np.flatnonzero(~self.airborne)
        left = self.until.copy()
        left[own[head]] = self.start[found[head]]
        lands = ~(self.aloft[own] & (found == self.first[own + 1] - 1))
        last = np.flatnonzero(tail & lands)
        between = np.flatnonzero(same)
        return (
            np.concatenate([down, own[between], own[last]]),
            np.concatenate([np.zeros(len(down)), self.end[found[between]], self.end[found[last]]]),
            np.concatenate([left[down], self.start[found[between + 1]], self.until[own[last]]]),
        )

    def integral_at(self, knots: Knots, own: Rows, times: Floats) -> Floats:
        """Integral of the gap over time [m s] of histories ``own`` (nq,) from 0 to ``times`` (nq,); NaN after the last
        known one.

        Exact at events and period marks; inside a flight it is shared out as by a parabola from touchdown to touchdown.
        """
        known = np.diff(knots.first)[own] > 1
        out = np.full(len(times), np.nan)
        own, times = own[known], times[known]
        at, s, whole = self.share(knots, own, times)
        s = np.where(whole, s * s * (3.0 - 2.0 * s), s)
        found = knots.integral[at] + s * (knots.integral[at + 1] - knots.integral[at])
        late = times > knots.time[knots.first[own + 1] - 1] * (1.0 + 1e-8)
        out[known] = np.where(late, np.nan, found)
        return out

    def share(self, knots: Knots, own: Rows, times: Floats) -> tuple[Rows, Floats, NDArray[np.bool_]]:
        """Of histories ``own`` (nq,) with two knots at least: the knot before each of ``times`` (nq,), the part of the
        time to the next one that has passed, and whether that is a whole flight from touchdown to touchdown."""
        count = np.diff(knots.first)[own]
        at = knots.first[own] + np.clip(last_at(knots.time, knots.first, own, times), 0, count - 2)
        begin, length = knots.time[at], knots.time[at + 1] - knots.time[at]
        s = np.divide(times - begin, length, out=np.ones(len(times)), where=length > 0.0)
        whole = np.zeros(len(times), dtype=bool)
        if len(self.start):
            flight = self.first[own] + np.maximum(last_at(self.start, self.first, own, begin), 0)
            some = np.diff(self.first)[own] > 0
            flight = np.where(some, flight, 0)
            whole = some & (self.start[flight] == begin) & (self.end[flight] == knots.time[at + 1])
            whole &= (flight > self.first[own]) | ~self.airborne[own]
        return at, np.clip(s, 0.0, 1.0), whole


@dataclass(frozen=True)
class KnownHistories:
    """What nh feet did that is known already, as from a record: flights, impacts with their approach speeds [m/s], the
    highest gaps seen [m], and the integral of the gap."""

    flights: Flights
    impacts: Points
    tops: Points
    knots: Knots


class Columns(Protocol):
    """Fields of events by name: a structured array, or a mapping of arrays."""

    def __getitem__(self, name: str, /) -> np.ndarray: ...


@dataclass(frozen=True)
class EventHistories:
    """The same as `KnownHistories`, from events of nr runs: of m feet that are asked for, foot f of run r has number
    ``r m + f``.

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

    @cached_property
    def _rows(self) -> tuple[Rows | slice, Rows]:
        """Numbers of the events, history after history, and where each history begins (nh + 1,)."""
        if self.among == 1 and len(self.feet) == 1:
            return slice(None), self.first
        place = np.full(self.among, -1)
        place[list(self.feet)] = np.arange(len(self.feet))
        foot = place[np.asarray(self.events["foot"]).astype(np.intp)]
        asked = np.flatnonzero(foot >= 0)
        own = owners(self.first)[asked] * len(self.feet) + foot[asked]
        order = np.argsort(own, kind="stable")
        return asked[order], firsts(np.bincount(own, minlength=len(self.ends) * len(self.feet)))

    def _column(self, name: str) -> np.ndarray:
        return np.asarray(self.events[name])[self._rows[0]]

    @cached_property
    def _own(self) -> Rows:
        return owners(self._rows[1])

    @cached_property
    def _kind(self) -> np.ndarray:
        return self._column("kind").astype(np.int8)

    @cached_property
    def _time(self) -> Floats:
        """Times [s] in order: a rest bears the time at which its accumulation ends, but comes at the latest with the
        next event of its foot."""
        time = np.array(self._column("time"), dtype=float)
        own = self._own
        late = own[1:][(time[1:] < time[:-1]) & (own[1:] == own[:-1])]
        for history in set(late.tolist()):
            part = slice(self._rows[1][history], self._rows[1][history + 1])
            time[part] = np.minimum.accumulate(time[part][::-1])[::-1]
        return time

    @cached_property
    def _until(self) -> Floats:
        return np.repeat(np.asarray(self.ends, dtype=float), len(self.feet))

    @cached_property
    def _impact(self) -> NDArray[np.bool_]:
        return np.isin(self._kind, IMPACTS)

    @cached_property
    def flights(self) -> Flights:
        """Flights, by the events that begin and end them."""
        kind, time, own, first = self._kind, self._time, self._own, self._rows[1]
        starts = (kind == BOUNCE) | (kind == RELEASE)
        contact = self._impact | (kind == CONTACT_AT_START)
        touching = np.flatnonzero(contact | (kind == RELEASE))
        airborne = _airborne(kind, touching, first)
        begun = firsts(starts)  # starts before each event, and in all
        before = begun[first]
        of = firsts(np.diff(before) + airborne)
        # the flight that an event looks back on: the last one begun before it, in its history
        back = begun[:-1] + (of[:-1] - before[:-1] + airborne - 1)[own]
        known = back >= of[:-1][own]
        count = of[-1]
        start, rebound = np.zeros(count), np.zeros(count, dtype=bool)
        start[back[starts] + 1], rebound[back[starts] + 1] = time[starts], kind[starts] == BOUNCE
        end, ended = self._until[owners(of)], np.zeros(count, dtype=bool)
        landed = np.flatnonzero(contact & known)
        end[back[landed]], ended[back[landed]] = time[landed], True
        last = of[1:] - 1
        aloft = np.diff(of) > 0
        aloft[aloft] = ~ended[last[aloft]]
        up = np.flatnonzero((contact | (kind == PERIOD_MARK)) & known)
        apex, apex_time = self._apexes(up, back[up], start)
        return Flights(of, start, end, apex, apex_time, rebound, self._until, airborne, aloft)

    def _apexes(self, rows: Rows, flight: Rows, start: Floats) -> tuple[Floats, Floats]:
        """Highest gap [m] that events saw of each flight, 0 where none did, and when [s]: of equal ones the last."""
        value = self._column("apex")[rows]
        some = value > 0.0
        rows, flight, value = rows[some], flight[some], value[some]
        apex = np.maximum(largest(flight, len(start), value), 0.0)
        highest = value == apex[flight]
        apex_time = start.copy()
        apex_time[flight[highest]] = self._column("apex_time")[rows[highest]]
        return apex, apex_time

    @cached_property
    def impacts(self) -> Points:
        """Impacts with their approach speeds [m/s]."""
        hit = self._impact
        return Points(self._own[hit], self._time[hit], self._column("speed_before")[hit])

    @cached_property
    def tops(self) -> Points:
        """Highest gaps [m] that events and period marks saw, and when."""
        apex = self._column("apex")
        up = np.flatnonzero(apex > 0.0)
        return Points(self._own[up], self._column("apex_time")[up], apex[up])

    @cached_property
    def knots(self) -> Knots:
        """Integral of the gap at the start, at every event and, of a foot on the ground, at the end."""
        first, down = self._rows[1], ~self.flights.aloft
        of = firsts(np.diff(first) + 1 + down)
        time, integral = np.zeros(of[-1]), np.zeros(of[-1])
        at = np.arange(len(self._own)) + (of[:-1] - first[:-1] + 1)[self._own]
        time[at], integral[at] = self._time, self._column("gap_integral")
        last = of[1:][down] - 1
        time[last], integral[last] = self._until[down], integral[last - 1]
        return Knots(of, time, integral)


Histories = EventHistories | KnownHistories
"""What feet did."""


def _airborne(kind: np.ndarray, touching: Rows, first: Rows) -> NDArray[np.bool_]:
    """Whether each history begins in the air: the first event that touches the ground neither leaves nor holds it."""
    if not len(touching):
        return np.ones(len(first) - 1, dtype=bool)
    at = np.searchsorted(touching, first[:-1])
    row = touching[np.minimum(at, len(touching) - 1)]
    there = (at < len(touching)) & (row < first[1:])
    return ~(there & ((kind[row] == CONTACT_AT_START) | (kind[row] == RELEASE)))
