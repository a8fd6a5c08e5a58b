"""Flights and contacts of one foot, from its events."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# Kinds of events, as in ``tarsus.core.arrays``.
BOUNCE, CAPTURE, RELEASE, REST, CONTACT_AT_START, PERIOD_MARK = 1, 2, 3, 4, 5, 6
IMPACTS = (BOUNCE, CAPTURE, REST)
"""Kinds of events that are blows."""


@dataclass(frozen=True)
class FootHistory:
    """What one foot did: nf flights and nh holds, in time order, and ni impacts.

    flight_start, flight_end (nf,) [s]; apex (nf,) [m] highest gap (inf where a flight is cut off by the end before
    it was seen); rebound (nf,) True where the flight began by a bounce; hold_start, hold_end (nh,) [s];
    impact_time (ni,) [s], impact_speed (ni,) [m/s] approach speeds; top_time [s], top [m]: highest gaps seen, for
    peaks by period.
    """

    flight_start: Floats
    flight_end: Floats
    apex: Floats
    rebound: NDArray[np.bool_]
    hold_start: Floats
    hold_end: Floats
    impact_time: Floats
    impact_speed: Floats
    top_time: Floats
    top: Floats

    def bounces(self, resolution: float) -> Floats:
        """Times [s] of the bounces: rebounds from contact whose apex clears ``resolution`` [m]."""
        return self.flight_start[self.rebound & (self.apex > resolution)]

    def contacts(self, resolution: float) -> tuple[Floats, Floats]:
        """Start and end [s] of every stay on the ground, held or in chatter below ``resolution`` [m]; stays that
        touch are one."""
        start, end = self._spans(resolution)
        if start.size == 0:
            return start, end
        begins = np.append(True, start[1:] > np.maximum.accumulate(end)[:-1])
        return start[begins], np.maximum.reduceat(end, np.flatnonzero(begins))

    def contact_until(self, times: Floats, resolution: float) -> Floats:
        """Total time in contact [s] from 0 to each of ``times``: held, or in chatter below ``resolution`` [m]."""
        start, end = self._spans(resolution)
        if start.size == 0:
            return np.zeros(len(times))
        knots = np.column_stack([start, end]).ravel()
        total = np.cumsum(end - start)
        values = np.column_stack([np.concatenate([[0.0], total[:-1]]), total]).ravel()
        return np.interp(times, knots, values)

    def _spans(self, resolution: float) -> tuple[Floats, Floats]:
        """Start and end [s] of holds and of flights below ``resolution`` [m], in time order."""
        chatter = self.rebound & (self.apex <= resolution)
        start = np.concatenate([self.hold_start, self.flight_start[chatter]])
        end = np.concatenate([self.hold_end, self.flight_end[chatter]])
        order = np.argsort(start, kind="stable")
        start = start[order]
        return start, np.maximum(end[order], start)


def foot_history(events: np.ndarray, foot: int, duration: float) -> FootHistory:
    """History of foot number ``foot`` over ``duration`` [s].

    ``events`` is a structured array with fields time, foot, kind, speed_before, apex, apex_time, period marks
    included (kind 6), in time order.
    """
    own = events[events["foot"] == foot]
    kind, time = own["kind"], own["time"]
    starts = (kind == BOUNCE) | (kind == RELEASE)
    contact = (kind == BOUNCE) | (kind == CAPTURE) | (kind == REST) | (kind == CONTACT_AT_START)
    touching = np.flatnonzero(contact | (kind == RELEASE))
    airborne = not (len(touching) and kind[touching[0]] in (CONTACT_AT_START, RELEASE))
    # the flight an event looks back on: the number of flights begun before it
    number = np.concatenate([[0], np.cumsum(starts)[:-1]]) if len(own) else np.zeros(0, dtype=int)
    if not airborne:
        number = number - 1
    count = int(starts.sum()) + int(airborne)
    first = np.array([0.0] if airborne else [])
    flight_start = np.concatenate([first, time[starts]])
    rebound = np.concatenate([np.zeros(int(airborne), dtype=bool), kind[starts] == BOUNCE])
    apex = np.zeros(count)
    seen = (number >= 0) & (contact | (kind == PERIOD_MARK))
    np.maximum.at(apex, number[seen], own["apex"][seen])
    flight_end = np.full(count, duration)
    landed = contact & (number >= 0)
    flight_end[number[landed]] = time[landed]
    if count and not (number[landed] == count - 1).any() and apex[-1] == 0.0:
        apex[-1] = np.inf
    holds = (kind == CAPTURE) | (kind == REST) | (kind == CONTACT_AT_START)
    hold_start = time[holds]
    releases = time[kind == RELEASE]
    after = np.searchsorted(releases, hold_start, side="left")
    hold_end = np.append(releases, duration)[np.minimum(after, len(releases))]
    impact = (kind == BOUNCE) | (kind == CAPTURE) | (kind == REST)
    up = own["apex"] > 0.0
    return FootHistory(
        flight_start, flight_end, apex, rebound, hold_start, hold_end, time[impact], own["speed_before"][impact],
        own["apex_time"][up], own["apex"][up],
    )  # fmt: skip
