"""Flights and contacts of one foot, from its events or from a record; what counts as a bounce."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]

RESOLUTION = 1e-7
"""Height [m] that a flight must clear to be seen: the resolution of the source's vibrometer."""
DWELL = 5e-4
"""Length [s] that the contact before a flight must stay below for it to be a bounce. Captures that let go by themselves
last 40 to 70 us, and an instrument sees in them one blow; contacts that a drive holds last about half its period. This
lies ten times above the first, and a tenth of the period five times below the second."""
DWELL_SHARE = 0.1
"""The same as a part of the drive period, where that is shorter."""
COUNTED = (
    f"flights above {RESOLUTION * 1e6:g} µm, after contacts shorter than {DWELL * 1e3:g} ms or a tenth of the drive "
    "period"
)
"""What is counted as a bounce unless height and dwell are given, for a table of several drive periods."""

# Kinds of events, as in ``tarsus.core.arrays``.
BOUNCE, CAPTURE, RELEASE, REST, CONTACT_AT_START, PERIOD_MARK = 1, 2, 3, 4, 5, 6
IMPACTS = (BOUNCE, CAPTURE, REST)
"""Kinds of events that are impacts."""


@dataclass(frozen=True)
class Counting:
    """What is counted: flights above ``height`` [m], those after contacts shorter than ``dwell`` [s] as bounces."""

    height: float
    dwell: float

    @classmethod
    def of(cls, period: float, height: float = RESOLUTION, dwell: float | None = None) -> Counting:
        """The rule for a drive period [s]; ``dwell`` is `DWELL`, or a tenth of the period if that is shorter, unless
        it is given."""
        return cls(height, min(DWELL, DWELL_SHARE * period) if dwell is None else dwell)

    def words(self) -> dict[str, str]:
        """Height and dwell for a sentence."""
        return {"height": f"{self.height * 1e6:.4g} um", "dwell": f"{self.dwell * 1e3:.4g} ms"}


@dataclass(frozen=True)
class FootHistory:
    """What one foot did from 0 to ``end`` [s]: nf flights in time order, on the ground between them, and ni impacts.

    flight_start, flight_end (nf,) [s]; apex, apex_time (nf,) highest gap seen [m], 0 where none was, and when [s];
    rebound (nf,) True where the flight began by a bounce. airborne: the first flight began with the run; aloft: the
    last one was cut off by the end. impact_time (ni,) [s], impact_speed (ni,) [m/s] approach speeds; top_time [s], top
    [m]: highest gaps seen, for peaks by period; knot [s], integral [m s]: integral of the gap over time, where known.
    """

    end: float
    flight_start: Floats
    flight_end: Floats
    apex: Floats
    apex_time: Floats
    rebound: NDArray[np.bool_]
    airborne: bool
    aloft: bool
    impact_time: Floats
    impact_speed: Floats
    top_time: Floats
    top: Floats
    knot: Floats
    integral: Floats

    def seen(self, height: float) -> Rows:
        """Numbers of the flights that leave the ground for an instrument: their apex clears ``height`` [m], or the run
        began with them. What is between two of them is one contact."""
        clear = self.apex > height
        clear[:1] |= self.airborne
        return np.flatnonzero(clear)

    def hops(self, height: float) -> Rows:
        """Numbers of the flights that began from the ground and clear ``height`` [m], cut off by the end or not."""
        found = self.seen(height)
        return found[1:] if self.airborne else found

    def bounces(self, counting: Counting) -> Rows:
        """Numbers of the flights that are bounces: from a touchdown to the next one, or cut off by the end, with an
        apex that clears the height, after a contact shorter than the dwell.

        That contact is the whole stay on the ground from first touchdown to last departure, with all flights below
        the height in it. A stay that began with the run is no touchdown. How a flight began plays no part.
        """
        found = self.seen(counting.height)
        stay = self.flight_start[found[1:]] - self.flight_end[found[:-1]]
        return found[1:][stay < counting.dwell]

    def rebounds(self, height: float) -> Rows:
        """Numbers of the flights that began by restitution and clear ``height`` [m]."""
        return np.flatnonzero(self.rebound & (self.apex > height))

    def contacts(self, height: float) -> tuple[Floats, Floats]:
        """Start and end [s] of every stay on the ground, flights below ``height`` [m] included."""
        found = self.seen(height)
        start, end = self.flight_end[found], self.flight_start[found]
        if not self.airborne:
            start = np.append(0.0, start)
        else:
            end = end[1:]
        if len(end) < len(start):
            lands = not (len(found) and found[-1] == len(self.apex) - 1 and self.aloft)
            start, end = (start, np.append(end, self.end)) if lands else (start[:-1], end)
        return start, end

    def contact_until(self, times: Floats, height: float) -> Floats:
        """Total time in contact [s] from 0 to each of ``times``, flights below ``height`` [m] included."""
        start, end = self.contacts(height)
        if start.size == 0:
            return np.zeros(len(times))
        knots = np.column_stack([start, end]).ravel()
        total = np.cumsum(end - start)
        values = np.column_stack([np.concatenate([[0.0], total[:-1]]), total]).ravel()
        return np.interp(times, knots, values)

    def integral_until(self, times: Floats) -> Floats:
        """Integral of the gap over time [m s] from 0 to each of ``times``; NaN after the last known one.

        Exact at events and period marks; inside a flight it is shared out as by a parabola from touchdown to touchdown.
        """
        knot, integral = self.knot, self.integral
        place = np.clip(np.searchsorted(knot, times, side="right") - 1, 0, max(len(knot) - 2, 0))
        if len(knot) < 2:
            return np.full(len(times), np.nan)
        length = knot[place + 1] - knot[place]
        s = np.divide(times - knot[place], length, out=np.ones(len(times)), where=length > 0.0)
        s = np.clip(s, 0.0, 1.0)
        if len(self.flight_start):
            own = np.clip(np.searchsorted(self.flight_start, knot[place], side="right") - 1, 0, None)
            whole = (self.flight_start[own] == knot[place]) & (self.flight_end[own] == knot[place + 1])
            whole &= (own > 0) | (not self.airborne)
            s = np.where(whole, s * s * (3.0 - 2.0 * s), s)
        found = integral[place] + s * (integral[place + 1] - integral[place])
        return np.where(times > knot[-1] * (1.0 + 1e-8), np.nan, found)


def foot_history(events: np.ndarray, foot: int, end: float) -> FootHistory:
    """History of foot number ``foot`` until ``end`` [s], the time that the run reached.

    ``events`` is a structured array with fields time, foot, kind, speed_before, apex, apex_time, gap_integral, period
    marks included (kind 6), in time order.
    """
    own = events[events["foot"] == foot]
    kind, time = own["kind"], own["time"]
    starts = (kind == BOUNCE) | (kind == RELEASE)
    impact = (kind == BOUNCE) | (kind == CAPTURE) | (kind == REST)
    contact = impact | (kind == CONTACT_AT_START)
    touching = np.flatnonzero(contact | (kind == RELEASE))
    airborne = not (len(touching) and kind[touching[0]] in (CONTACT_AT_START, RELEASE))
    # the flight an event looks back on: the number of flights begun before it
    number = np.concatenate([[0], np.cumsum(starts)[:-1]]) if len(own) else np.zeros(0, dtype=int)
    if not airborne:
        number = number - 1
    count = int(starts.sum()) + int(airborne)
    flight_start = np.concatenate([[0.0] if airborne else [], time[starts]])
    rebound = np.concatenate([np.zeros(int(airborne), dtype=bool), kind[starts] == BOUNCE])
    apex, apex_time = np.zeros(count), flight_start.copy()
    seen = np.flatnonzero((number >= 0) & (contact | (kind == PERIOD_MARK)) & (own["apex"] > 0.0))
    seen = seen[np.argsort(own["apex"][seen], kind="stable")]  # the highest of a flight comes last
    apex[number[seen]], apex_time[number[seen]] = own["apex"][seen], own["apex_time"][seen]
    flight_end = np.full(count, end)
    landed = contact & (number >= 0)
    flight_end[number[landed]] = time[landed]
    aloft = count > 0 and not (number[landed] == count - 1).any()
    up = own["apex"] > 0.0
    knot, integral = np.append(0.0, time), np.append(0.0, own["gap_integral"])
    if not aloft:  # on the ground since the last event
        knot, integral = np.append(knot, end), np.append(integral, integral[-1])
    return FootHistory(
        end, flight_start, flight_end, apex, apex_time, rebound, airborne, aloft, time[impact],
        own["speed_before"][impact], own["apex_time"][up], own["apex"][up], knot, integral,
    )  # fmt: skip
