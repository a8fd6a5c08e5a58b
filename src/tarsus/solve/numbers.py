"""Derivatives of one number of a run by the run's own events and states, where reverse derivatives begin."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.base.events import EventKind
from tarsus.core.arrays import E_APEX, E_APEX_TIME, E_INTEGRAL, E_KIND, E_TIME
from tarsus.measure.history import RESOLUTION
from tarsus.measure.origins import TOGETHER
from tarsus.solve.adjoint import Seeds
from tarsus.solve.codes import EVENT_TYPE, event_order, structured_events
from tarsus.solve.directional import (
    LARGEST,
    MOVED,
    STEPS,
    EventDerivatives,
    difference,
    jumps,
    measure_slopes,
    row_slopes,
)

if TYPE_CHECKING:
    from tarsus.core.replay import SampledStates

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]
NumberOf = Callable[..., float]
"""A function of the events with the period marks, or of these and of states at given times (`SampledStates`)."""

FINER = (1.0, 1e-2, 1e-4)
"""Parts of the longest steps that are tried where a number seems to have a kink: events that nearly repeat take turns
in being the largest."""
STATES = ("x", "v", "gap", "rate", "resistive", "smooth", "pull")
"""Fields of states in the order in which the engine's derivatives have them."""
_NAMES = EVENT_TYPE.names or ()


def measure_seeds(log: EventDerivatives, feet: tuple[str, ...], name: str, edges_move: bool) -> Seeds | None:
    """Of a measure of a run by name. log: of the run, its derivatives not used but by_period, which says whether the
    drive period moves. edges_move: whether edges of drives do.

    None where its derivatives by events are not known, and where it may have a kink; by the period NaN
    where it has one there, infinite where it jumps with the number of periods.
    """
    found = row_slopes(log, feet, name, together=not edges_move)
    if found is None:
        return None
    seeds, period = found
    if log.by_period.any() and jumps(log):
        # with all times stretched alike no event changes places with an edge of a period
        rows, (marks, rising) = log.rows, _marks(log.rows)
        way = np.zeros_like(rows)
        way[:, [E_TIME, E_APEX_TIME]] = rows[:, [E_TIME, E_APEX_TIME]] / log.period
        way[marks, E_TIME] = _turns(log)[marks]
        way[rising, E_APEX_TIME] = way[rising, E_TIME]
        _, (kinked,) = measure_slopes(replace(log, slopes=way[..., None], by_period=np.ones(1)), feet, name)
        period = np.inf if kinked else period
    return Seeds(seeds, np.zeros(0), np.zeros((0, 0)), period)


def number_seeds(
    log: EventDerivatives, number: NumberOf, times: Floats, states: SampledStates | None
) -> Seeds | None:
    """Of a function of a run's events, and of its states at times (nt,) where they are given. log as for
    `measure_seeds`.

    Numbers are tried in groups, and groups that do not matter left alone. Kinks as there.
    """
    order, given = event_order(log.rows)
    events = structured_events(log.rows)
    seeds = Seeds(
        np.zeros_like(log.rows), times, np.zeros((len(times), 0 if states is None else _width(states)))
    )
    places = _event_places(log, events, order, given, seeds.events)
    asked: tuple[object, ...] = (events,)
    if states is not None:
        states = replace(states, **{name: getattr(states, name).copy() for name in STATES})
        places += _state_places(states, seeds.samples)
        asked = (events, states)

    def value() -> float:
        return float(number(*asked))

    own = value()
    groups: list[Sequence[_Place]] = [list(group) for group in _by_column(places)]
    while groups:
        group = groups.pop()
        if len(group) <= 2:
            for place in group:
                kinked = place.differentiate(value, own)
                if kinked:
                    return None
        elif any(_moved(group, sign, value) != own for sign in (1.0, -1.0)):
            half = len(group) // 2
            groups += [group[:half], group[half:]]
    period = np.zeros(1)
    if log.by_period.any() and _period_place(log, events, order, period).differentiate(value, own):
        period[0] = np.nan
    return replace(seeds, period=float(period[0]))


@dataclass(frozen=True)
class _Place:
    """Numbers that move together: entries ``at`` of arrays that a function reads, by weights times ``step``; where the
    derivative goes."""

    parts: tuple[tuple[Floats, Rows, Floats], ...]
    step: float
    to: Floats
    entry: tuple[int, ...]

    def move(self, by: float) -> None:
        for array, at, weights in self.parts:
            array[at] += by * self.step * weights

    def differentiate(self, value: Callable[[], float], own: float) -> bool:
        """Note the derivative; True where there is a kink."""
        kept = [array[at] for array, at, _ in self.parts]
        values = np.full(len(STEPS), own)
        for part in FINER:
            for k in np.flatnonzero(STEPS):
                self.move(part * float(STEPS[k]))
                values[k] = value()
                for (array, at, _), was in zip(self.parts, kept, strict=True):
                    array[at] = was
            slope, kinked = difference(values)
            if not kinked:
                self.to[self.entry] += slope / (part * self.step)
                return False
        return True


def _moved(group: Sequence[_Place], by: float, value: Callable[[], float]) -> float:
    """The function with all of a group moved, each by another part of its step."""
    kept = [[array[at] for array, at, _ in place.parts] for place in group]
    for k, place in enumerate(group):
        place.move(by * (1.0 - 0.5 / (k + 2)))
    found = value()
    for place, was in zip(group, kept, strict=True):
        for (array, at, _), old in zip(place.parts, was, strict=True):
            array[at] = old
    return found


def _by_column(places: Sequence[_Place]) -> Iterator[list[_Place]]:
    """Places whose derivatives go to one column."""
    columns: dict[tuple[int, int], list[_Place]] = {}
    for place in places:
        columns.setdefault((id(place.to), place.entry[-1]), []).append(place)
    yield from columns.values()


def _marks(rows: Floats) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which event rows are marks, and at which of these a foot is highest: that moment moves with the mark."""
    marks = rows[:, E_KIND] == EventKind.PERIOD_MARK
    return marks, marks & (rows[:, E_APEX_TIME] == rows[:, E_TIME]) & (rows[:, E_APEX] > 0.0)


def _turns(log: EventDerivatives) -> Floats:
    """Of which end of a period each event row (ne,) is a mark; 0 where of none: the mark at the end of a run stays."""
    time = log.rows[:, E_TIME]
    turns = np.round(time / log.period)
    whole = (np.abs(time - turns * log.period) <= 1e-12 * time) & (time < log.end)
    return np.where(whole & _marks(log.rows)[0], turns, 0.0)


def _at_once(foot: NDArray[np.generic], time: Floats, among: Rows) -> list[Rows]:
    """Those of some events that are of one foot at one moment."""
    ordered = among[np.lexsort((time[among], foot[among]))]
    cuts = np.flatnonzero((np.diff(time[ordered]) != 0.0) | (np.diff(foot[ordered]) != 0)) + 1
    return np.split(ordered, cuts) if len(ordered) else []


def _event_places(
    log: EventDerivatives, events: NDArray[np.void], order: Rows, given: Rows, to: Floats
) -> list[_Place]:
    """Every number of the events that may move."""
    marks, rising = (one[order] for one in _marks(log.rows))
    out = []
    one = np.ones(1)
    for column in (*range(E_KIND + 1, E_INTEGRAL + 1),):
        array = events[_NAMES[column]]
        step = LARGEST * (float(np.abs(array).max(initial=0.0)) or 1.0)
        for k in range(len(events)):
            if column == E_APEX_TIME and rising[k]:
                continue
            own = step
            if column == E_APEX and array[k] > 0.0:
                own = min(step, LARGEST * array[k], MOVED * (abs(array[k] - RESOLUTION) or RESOLUTION))
            out.append(_Place(((array, np.array([k]), one),), own, to, (int(order[k]), column)))
    time = events["time"]
    groups = _at_once(events["foot"], time, np.flatnonzero(~marks))
    for n, group in enumerate(groups):
        when = float(time[group[0]])
        rooms = [LARGEST * when, MOVED * abs(when - round(when / log.period) * log.period)]
        neighbours = [groups[k][0] for k in (n - 1, n + 1) if 0 <= k < len(groups)]
        rooms += [
            MOVED * abs(time[k] - when) for k in neighbours if events["foot"][k] == events["foot"][group[0]]
        ]
        step = min(
            (float(room) for room in rooms if room > MOVED * TOGETHER * log.period), default=LARGEST * log.end
        )
        row = int(given[order[group[-1]]])
        out.append(_Place(((time, group, np.ones(len(group))),), step, to, (row, E_TIME)))
    return out


def _period_place(log: EventDerivatives, events: NDArray[np.void], order: Rows, to: Floats) -> _Place:
    """The drive period, with which the marks move."""
    marks, rising = (np.flatnonzero(one[order]) for one in _marks(log.rows))
    turns = _turns(log)[order]
    parts = (
        (events["time"], marks, turns[marks]),
        (events["apex_time"], rising, turns[rising]),
    )
    return _Place(parts, LARGEST * log.period / max(float(turns.max(initial=1.0)), 1.0), to, (0,))


def _width(states: SampledStates) -> int:
    return sum(len(getattr(states, name)) for name in STATES)


def _state_places(states: SampledStates, to: Floats) -> list[_Place]:
    """Every number of the states."""
    out, column, one = [], 0, np.ones(1)
    for name in STATES:
        for row in getattr(states, name):
            step = LARGEST * (float(np.abs(row).max(initial=0.0)) or 1.0)
            out += [_Place(((row, np.array([k]), one),), step, to, (k, column)) for k in range(len(row))]
            column += 1
    return out
