"""Which numbers of its events a measure of a run is made of: its derivatives by them.

Flights, contacts and knots take their numbers from single events. A second history of the same run, in which every time
is the number of its event, tells from which.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from tarsus.measure.history import EventHistories
from tarsus.measure.measure import Scope
from tarsus.measure.periods import PER_WINDOW
from tarsus.measure.segments import Floats, Rows, largest, sums
from tarsus.measure.table import Judgement
from tarsus.measure.walking import measured
from tarsus.measure.whole import WHOLE_RUN
from tarsus.measure.windows import Seen

__all__ = ["event_slopes"]


@dataclass(frozen=True)
class _Told:
    """What a run's feet did, and by which events: there the times are numbers of events from 1 on, 0 where none tells.

    slopes: derivatives (ne,) of the measure by fields of the events.
    """

    seen: Seen
    by: EventHistories
    height: float
    slopes: dict[str, Floats] = field(default_factory=dict)

    def add(self, name: str, events: Floats, values: Floats) -> None:
        """Add derivatives (n,) by a field of events (n,) that are numbered from 1 on."""
        to = self.slopes.setdefault(name, np.zeros(len(self.by.events["time"])))
        known = events > 0.0
        np.add.at(to, events[known].astype(np.intp) - 1, values[known])

    def add_largest(self, name: str, cell: Rows, values: Floats, events: Floats, weights: Floats) -> None:
        """The same of the largest value of each cell."""
        most = largest(cell, len(weights), values)
        at = np.full(len(weights), -1)
        highest = np.flatnonzero(values == most[cell])
        at[cell[highest]] = highest
        some = np.flatnonzero(at >= 0)
        self.add(name, events[at[some]], weights[some])


def event_slopes(judgement: Judgement, name: str) -> dict[str, Floats] | None:
    """Derivatives of a measure of one run by fields of its events, each (ne,), period marks included; None where that
    is not known of it; in SI units, of the measure by those of the field. The drive period stands still.

    They are those of the measure's definition, where it has one there; what it selects (the largest, flights above a
    height) stays selected.
    """
    table, seen = judgement.table, judgement.seen
    if len(table) != 1 or not (name in _OF_WINDOWS or name in _OF_RUNS):
        return None
    found = measured(judgement, [name])[name]
    assert found.per_foot is not None
    means = found.per_foot[0]
    met = np.isfinite(means)
    if found.about.scope is Scope.WORST:
        share = np.arange(len(means)) == np.argmax(np.where(met, means, -np.inf))
    else:
        share = met / max(met.sum(), 1)
    events, numbers = table.events, 1.0 + np.arange(len(table.events["time"]))
    columns = {one: np.asarray(events[one]) for one in ("foot", "kind", "speed_before", "apex")}
    columns |= {"time": numbers, "apex_time": numbers, "gap_integral": numbers}
    by = EventHistories(columns, table.first, np.zeros(1), range(len(table.feet)), len(table.feet))
    told = _Told(seen, by, judgement.height)
    if name in _OF_RUNS:
        _OF_RUNS[name](told, share.astype(float))
        return told.slopes
    values, own = PER_WINDOW[name].of(seen), seen.windows.own
    known = np.isfinite(values)
    count = np.bincount(own[known], minlength=len(means))
    _OF_WINDOWS[name](told, np.where(known, share[own] / np.maximum(count[own], 1), 0.0))
    return told.slopes


def _contact(told: _Told, weights: Floats) -> None:
    windows = told.seen.windows
    own, start, end = told.seen.flights.contacts(told.height)
    _, begun, ended = told.by.flights.contacts(told.height)
    first, count = windows.first[own], windows.count[own]
    low, high = windows.edges[first], windows.edges[first + count]
    met = np.minimum(end, high) > np.maximum(start, low)
    for times, events, moves, sign in ((start, begun, start > low, -1.0), (end, ended, end < high, 1.0)):
        some = np.flatnonzero(met & moves)
        k = np.minimum(windows.number(own[some], times[some]), count[some] - 1)
        told.add("time", events[some], sign * weights[windows.cell[own[some]] + k])


def _peak(told: _Told, weights: Floats) -> None:
    tops = told.seen.histories.tops
    found, cell = told.seen.until(tops.own, tops.time)
    told.add_largest("apex", cell, tops.value[found], told.by.tops.time[found], weights)


def _hardest(told: _Told, weights: Floats) -> None:
    impacts = told.seen.histories.impacts
    found, cell = told.seen.until(impacts.own, impacts.time)
    told.add_largest("speed_before", cell, impacts.value[found], told.by.impacts.time[found], weights)


def _mean_apex(told: _Told, weights: Floats) -> None:
    flights = told.seen.flights
    hops = flights.hops(told.height)
    found, cell = told.seen.inside(flights.own[hops], flights.apex_time[hops])
    count = sums(cell, len(weights))
    told.add("apex", told.by.flights.apex_time[hops][found], weights[cell] / count[cell])


def _mean_impact(told: _Told, weights: Floats) -> None:
    impacts = told.seen.histories.impacts
    found, cell = told.seen.inside(impacts.own, impacts.time)
    count = sums(cell, len(weights))
    told.add("speed_before", told.by.impacts.time[found], weights[cell] / count[cell])


def _mean_height(told: _Told, weights: Floats) -> None:
    windows, knots, by = told.seen.windows, told.seen.histories.knots, told.by.knots
    at_edges = np.zeros(len(windows.edges))
    np.add.at(at_edges, windows.begin + 1, weights / windows.lengths)
    np.add.at(at_edges, windows.begin, -weights / windows.lengths)
    own = np.repeat(np.arange(len(windows.count)), np.diff(windows.first))
    some = np.flatnonzero((at_edges != 0.0) & (np.diff(knots.first)[own] > 1))
    own, edges, at_edges = own[some], windows.edges[some], at_edges[some]
    at, s, whole = told.seen.flights.share(knots, own, edges)
    part = np.where(whole, s * s * (3.0 - 2.0 * s), s)
    told.add("gap_integral", by.integral[at], at_edges * (1.0 - part))
    told.add("gap_integral", by.integral[at + 1], at_edges * part)
    length, between = knots.time[at + 1] - knots.time[at], (s > 0.0) & (s < 1.0)
    steep = np.where(whole, 6.0 * s * (1.0 - s), 1.0) * (knots.integral[at + 1] - knots.integral[at])
    by_part = np.divide(at_edges * steep, length, out=np.zeros(len(at)), where=between)
    told.add("time", by.time[at], -by_part * (1.0 - s))
    told.add("time", by.time[at + 1], -by_part * s)


def _highest(told: _Told, weights: Floats) -> None:
    tops = told.seen.histories.tops
    told.add_largest("apex", tops.own, tops.value, told.by.tops.time, weights)


def _longest(told: _Told, weights: Floats) -> None:
    own, start, end = told.seen.flights.contacts(told.height)
    _, begun, ended = told.by.flights.contacts(told.height)
    told.add_largest("time", own, end - start, ended, weights)
    told.add_largest("time", own, end - start, begun, -weights)


def _count(told: _Told, weights: Floats) -> None:
    """What counts stays as it is."""


Rule = Callable[[_Told, Floats], None]
_OF_WINDOWS: dict[str, Rule] = {
    "contact_duration": _contact,
    "duty_factor": lambda told, weights: _contact(told, weights / told.seen.windows.lengths),
    "peak": _peak, "hardest_impact": _hardest, "mean_apex": _mean_apex, "impact_speed": _mean_impact,
    "mean_height": _mean_height,
    **dict.fromkeys(("bounces", "bounces_per_second", "rebounds", "impacts"), _count),
}  # fmt: skip
_OF_RUNS: dict[str, Rule] = {
    "max_peak": _highest, "longest_contact": _longest,
    **dict.fromkeys((name for name in WHOLE_RUN if name.startswith("total_")), _count),
}  # fmt: skip
