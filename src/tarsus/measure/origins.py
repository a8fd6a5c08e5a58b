"""Which numbers of its events a measure of a run is made of: its derivatives by them.

Flights, contacts and knots take their numbers from single events. A second history of the same run, in which every time
is the number of its event, says from which. Where a measure has a kink or a jump within a run's error, it has none.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.measure.history import PERIOD_MARK, EventHistories
from tarsus.measure.measure import Moments, Scope
from tarsus.measure.periods import PER_WINDOW
from tarsus.measure.segments import Floats, Rows, largest, sums
from tarsus.measure.whole import WHOLE_RUN, value_of

if TYPE_CHECKING:
    from tarsus.measure.table import Judgement
    from tarsus.measure.windows import WindowedHistories

TOGETHER = 1e-9
"""Part of a period within which an event and the edge of a period may be in the other order, and part by which numbers
must differ for one to be the larger: what a run is known to."""


@dataclass(frozen=True)
class EventSlopes:
    """Derivatives of a measure: by fields of the events, each (ne,), and by the drive period [s], with which the marks
    move and all other events stay."""

    fields: dict[str, Floats]
    period: float


class _Kink(Exception):
    """A measure changes its formula within rounding of a run."""


@dataclass(frozen=True)
class _EventOrigins:
    """What a run's feet did, and by which events: there times are numbers of events from 1 on, 0 where there is none.

    slopes: derivatives (ne,) of the measure by fields of the events.
    """

    seen: WindowedHistories
    by: EventHistories
    height: float
    span: float
    slopes: dict[str, Floats] = field(default_factory=dict)

    def add(self, name: str, events: Floats, values: Floats) -> None:
        """Add derivatives (n,) by a field of events (n,) that are numbered from 1 on."""
        to = self.slopes.setdefault(name, np.zeros(len(self.by.events["time"])))
        known = events > 0.0
        np.add.at(to, events[known].astype(np.intp) - 1, values[known])

    def add_largest(
        self, name: str, cell: Rows, values: Floats, times: Floats, events: Floats, weights: Floats
    ) -> None:
        """The same of the largest value of each cell that counts."""
        most = largest(cell, len(weights), values)
        at = np.full(len(weights), -1)
        highest = np.flatnonzero(values == most[cell])
        at[cell[highest]] = highest
        near = (values >= most[cell] * (1.0 - TOGETHER)) & (weights[cell] != 0.0)
        if (near & self._apart(times, times[at[cell]])).any():
            raise _Kink
        some = np.flatnonzero(at >= 0)
        self.add(name, events[at[some]], weights[some])

    def clear(self) -> None:
        """Flights that count do so beyond doubt."""
        if (np.abs(self.seen.flights.apex - self.height) <= TOGETHER * self.height).any():
            raise _Kink

    def off_edges(self, own: Rows, times: Floats) -> None:
        """Times (n,) of histories lie in their windows beyond doubt; those that lie exactly at an edge are fixed, or
        move with it."""
        windows = self.seen.windows
        first, count = windows.first[own], windows.count[own]
        k = np.clip(windows.number(own, times), 0, count)
        for edge in (windows.edges[first + k], windows.edges[first + np.minimum(k + 1, count)]):
            near = np.abs(times - edge) <= TOGETHER * self.span
            if (near & self._apart(times, edge)).any():
                raise _Kink

    @staticmethod
    def _apart(times: Floats, others: Floats) -> NDArray[np.bool_]:
        """Whether times differ by more than rounding."""
        return np.abs(times - others) > 8.0 * np.spacing(np.abs(others))


def event_slopes(judgement: Judgement, name: str) -> EventSlopes | None:
    """Derivatives of a measure of one run by fields of its events, period marks included, and by the drive period; SI
    units, of the measure by those of the field. None where they are not known of it, and near a kink or a jump. An
    event that is at the edge of a period to rounding moves with it, as what a drive's own edge brings about does while
    that edge stays where it is in the period.

    They are those of the measure's definition, where it has one there; what it selects (the largest, flights above a
    height) stays selected. With all times the measure grows like a power of them: that gives the last derivative.
    """
    table, seen = judgement.table, judgement.seen
    rule = _OF_WINDOWS.get(name) or _OF_RUNS.get(name)
    if len(table) != 1 or rule is None:
        return None
    by_window = name in _OF_WINDOWS
    own = seen.windows.own if by_window else np.arange(len(table.feet))
    values = seen.of(name) if by_window else value_of(name, seen.histories, seen.counting)
    moments = Moments.of(values, own, len(table.feet))
    means, met = moments.mean, moments.count > 0
    if (PER_WINDOW[name] if by_window else WHOLE_RUN[name]).scope is Scope.WORST:
        worst = np.where(met, means, -np.inf)
        share = np.arange(len(means)) == np.argmax(worst)
        if ((worst >= worst.max() * (1.0 - TOGETHER)) & met & ~share).any():
            return None
    else:
        share = met / max(met.sum(), 1)
    events, numbers = table.events, 1.0 + np.arange(len(table.events["time"]))
    columns = {one: np.asarray(events[one]) for one in ("foot", "kind", "speed_before", "apex")}
    columns |= {"time": numbers, "apex_time": numbers, "gap_integral": numbers}
    by = EventHistories(columns, table.first, np.zeros(1), range(len(table.feet)), len(table.feet))
    origins = _EventOrigins(seen, by, judgement.height, float(judgement.spans[0]))
    weights = np.where(np.isfinite(values), share[own] / np.maximum(moments.count[own], 1), 0.0)
    try:
        rule(origins, weights)
    except _Kink:
        return None
    marks = np.asarray(events["kind"]) == PERIOD_MARK
    by_time = origins.slopes.get("time", np.zeros(len(marks)))
    by_time[marks] = 0.0
    value = float(np.where(share, share * np.nan_to_num(means), 0.0).sum())
    period = (_POWERS.get(name, 0.0) * value - float(by_time @ events["time"])) / origins.span
    return EventSlopes(origins.slopes, period if by_window else 0.0)


def _contact(origins: _EventOrigins, weights: Floats) -> None:
    windows = origins.seen.windows
    own, start, end = origins.seen.histories.contacts(origins.height)
    _, begun, ended = origins.by.contacts(origins.height)
    first, count = windows.first[own], windows.count[own]
    low, high = windows.edges[first], windows.edges[first + count]
    met = np.minimum(end, high) > np.maximum(start, low)
    origins.clear()
    origins.off_edges(own, start)
    origins.off_edges(own, end)
    for times, events, moves, sign in ((start, begun, start > low, -1.0), (end, ended, end < high, 1.0)):
        some = np.flatnonzero(met & moves)
        k = np.minimum(windows.number(own[some], times[some]), count[some] - 1)
        origins.add("time", events[some], sign * weights[windows.cell[own[some]] + k])


def _peak(origins: _EventOrigins, weights: Floats) -> None:
    tops = origins.seen.histories.tops
    origins.off_edges(tops.own, tops.time)
    found, cell = origins.seen.until(tops.own, tops.time)
    origins.add_largest(
        "apex", cell, tops.value[found], tops.time[found], origins.by.tops.time[found], weights
    )


def _hardest(origins: _EventOrigins, weights: Floats) -> None:
    impacts = origins.seen.histories.impacts
    origins.off_edges(impacts.own, impacts.time)
    found, cell = origins.seen.until(impacts.own, impacts.time)
    origins.add_largest(
        "speed_before",
        cell,
        impacts.value[found],
        impacts.time[found],
        origins.by.impacts.time[found],
        weights,
    )


def _mean_apex(origins: _EventOrigins, weights: Floats) -> None:
    flights = origins.seen.flights
    hops = origins.seen.histories.hops(origins.height)
    origins.clear()
    origins.off_edges(flights.own[hops], flights.apex_time[hops])
    found, cell = origins.seen.inside(flights.own[hops], flights.apex_time[hops])
    count = sums(cell, len(weights))
    origins.add("apex", origins.by.flights.apex_time[hops][found], weights[cell] / count[cell])


def _mean_impact(origins: _EventOrigins, weights: Floats) -> None:
    impacts = origins.seen.histories.impacts
    origins.off_edges(impacts.own, impacts.time)
    found, cell = origins.seen.inside(impacts.own, impacts.time)
    count = sums(cell, len(weights))
    origins.add("speed_before", origins.by.impacts.time[found], weights[cell] / count[cell])


def _mean_height(origins: _EventOrigins, weights: Floats) -> None:
    windows, knots, by = origins.seen.windows, origins.seen.histories.knots, origins.by.knots
    at_edges = np.zeros(len(windows.edges))
    np.add.at(at_edges, windows.begin + 1, weights / windows.lengths)
    np.add.at(at_edges, windows.begin, -weights / windows.lengths)
    own = np.repeat(np.arange(len(windows.count)), np.diff(windows.first))
    some = np.flatnonzero((at_edges != 0.0) & (np.diff(knots.first)[own] > 1))
    own, edges, at_edges = own[some], windows.edges[some], at_edges[some]
    at, s, whole = origins.seen.histories.share(own, edges)
    part = np.where(whole, s * s * (3.0 - 2.0 * s), s)
    origins.add("gap_integral", by.integral[at], at_edges * (1.0 - part))
    origins.add("gap_integral", by.integral[at + 1], at_edges * part)
    length, between = knots.time[at + 1] - knots.time[at], (s > 0.0) & (s < 1.0)
    steep = np.where(whole, 6.0 * s * (1.0 - s), 1.0) * (knots.integral[at + 1] - knots.integral[at])
    by_part = np.divide(at_edges * steep, length, out=np.zeros(len(at)), where=between)
    origins.add("time", by.time[at], -by_part * (1.0 - s))
    origins.add("time", by.time[at + 1], -by_part * s)


def _highest(origins: _EventOrigins, weights: Floats) -> None:
    tops = origins.seen.histories.tops
    origins.add_largest("apex", tops.own, tops.value, tops.time, origins.by.tops.time, weights)


def _longest(origins: _EventOrigins, weights: Floats) -> None:
    own, start, end = origins.seen.histories.contacts(origins.height)
    _, begun, ended = origins.by.contacts(origins.height)
    origins.clear()
    origins.add_largest("time", own, end - start, end, ended, weights)
    origins.add_largest("time", own, end - start, end, begun, -weights)


def _count(origins: _EventOrigins, weights: Floats) -> None:
    """What counts stays as it is: flights that clear the height, after contacts that are shorter than the dwell, which
    begin within a window."""
    flights, counting = origins.seen.flights, origins.seen.counting
    origins.clear()
    origins.off_edges(flights.own, flights.start)
    origins.off_edges(origins.seen.histories.impacts.own, origins.seen.histories.impacts.time)
    found = origins.seen.histories.seen(origins.height)
    stay = flights.start[found[1:]] - flights.end[found[:-1]]
    dwell = np.broadcast_to(counting.dwell, flights.until.shape)[flights.own[found[1:]]]
    if (np.abs(stay - dwell) <= TOGETHER * origins.span).any():
        raise _Kink


Rule = Callable[[_EventOrigins, Floats], None]
_OF_WINDOWS: dict[str, Rule] = {
    "contact_duration": _contact,
    "duty_factor": lambda origins, weights: _contact(origins, weights / origins.seen.windows.lengths),
    "peak": _peak, "hardest_impact": _hardest, "mean_apex": _mean_apex, "impact_speed": _mean_impact,
    "mean_height": _mean_height,
    **dict.fromkeys(("bounces", "bounces_per_second", "rebounds", "impacts"), _count),
}  # fmt: skip
_OF_RUNS: dict[str, Rule] = {
    "max_peak": _highest, "longest_contact": _longest,
    **dict.fromkeys((name for name in WHOLE_RUN if name.startswith("total_")), _count),
}  # fmt: skip
_POWERS = {"contact_duration": 1.0, "mean_height": -1.0, "bounces_per_second": -1.0}
"""What power of all times together, with heights and speeds as they are, a measure by windows grows like; else none."""
