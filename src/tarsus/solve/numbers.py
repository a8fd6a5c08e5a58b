"""Derivatives of one number of a run by the run's own events and states, where reverse derivatives begin."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tarsus.base.events import EventKind
from tarsus.core.arrays import E_APEX, E_APEX_TIME, E_FOOT, E_INTEGRAL, E_KIND, E_TIME
from tarsus.core.replay import Sampled
from tarsus.measure import RESOLUTION, Judgement, RunTable, event_slopes, periods_used
from tarsus.solve.adjoint import Seeds
from tarsus.solve.codes import EVENT_TYPE, event_order, structured_events
from tarsus.solve.directional import (
    LARGEST,
    MOVED,
    STEPS,
    TOGETHER,
    Log,
    difference,
    measure_slopes,
    step_along,
)

__all__ = ["STATES", "NumberOf", "measure_seeds", "number_seeds"]

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]
NumberOf = Callable[..., float]
"""A function of the events with the period marks, or of these and of states at given times (`Sampled`)."""

FINER = (1.0, 1e-2, 1e-4)
"""Parts of the longest steps that are tried where a number seems to have a kink: events that nearly repeat take turns
in being the largest."""
ROUNDING = 1e-14
"""Part of the largest number of the events that a measure of them may be off by: a difference of a few of them."""
AGREE = 1e-6
"""Part of all that a number is made of by which its derivative along a direction may miss what its derivatives by
single events come to; what differs more has a kink there."""
STATES = ("x", "v", "gap", "rate", "resistive", "smooth", "pull")
"""Fields of states in the order in which the engine's derivatives have them."""
_NAMES = EVENT_TYPE.names or ()


def measure_seeds(log: Log, feet: tuple[str, ...], name: str) -> Seeds | None:
    """Of a measure of a run by name. log: of the run, its derivatives not used but by_period, which tells whether the
    drive period moves.

    None where its derivatives by events are not known, and where it has a kink; by the period NaN
    where it has one there, infinite where it jumps with the number of periods.
    """
    rows, (place, given) = log.rows, event_order(log.rows)
    table = RunTable(
        structured_events(rows), np.array([0, len(rows)]), feet, np.array([log.end]), np.array([log.period]),
        np.zeros(1, dtype=np.intp), lambda _: None,
    )  # fmt: skip
    found = event_slopes(Judgement(table), name)
    if found is None:
        return None
    seeds = np.zeros_like(rows)
    for field, column in found.items():
        np.add.at(seeds[:, _NAMES.index(field)], given[place] if field == "time" else place, column)
    marks, rising = _marks(rows)
    seeds[marks, E_TIME] = seeds[rising, E_APEX_TIME] = 0.0
    rng = np.random.default_rng(len(rows))
    way = rng.uniform(0.5, 1.0, rows.shape) * np.abs(rows).max(axis=0, initial=0.0)
    way[:, [E_FOOT, E_KIND, E_APEX_TIME]] = 0.0
    way[marks, E_TIME] = 0.0
    order = np.lexsort((rows[:, E_TIME], rows[:, E_FOOT]))
    alike = (np.diff(rows[order][:, [E_TIME, E_FOOT]], axis=0) == 0.0).all(axis=1)
    for k in np.flatnonzero(alike & ~marks[order][1:] & ~marks[order][:-1]):
        way[order[k + 1], E_TIME] = way[order[k], E_TIME]
    if not _moves_by(replace(log, slopes=way[..., None], by_period=np.zeros(1)), feet, name, seeds * way):
        return None
    period = 0.0
    if log.by_period.any():
        # with all times stretched alike no event changes places with an edge of a period
        way = np.zeros_like(rows)
        way[:, [E_TIME, E_APEX_TIME]] = rows[:, [E_TIME, E_APEX_TIME]] / log.period
        way[marks, E_TIME] = _turns(log)[marks]
        way[rising, E_APEX_TIME] = way[rising, E_TIME]
        moved = replace(log, slopes=way[..., None], by_period=np.ones(1))
        (stretched,), (kinked,) = measure_slopes(moved, feet, name)
        period = float(stretched - (seeds * way).sum()) if seeds.any() else 0.0
        if kinked:
            period = np.inf if _jumps(log) else np.nan
    return Seeds(seeds, np.zeros(0), np.zeros((0, 0)), period)


def _jumps(log: Log) -> bool:
    """Whether the number of whole periods of a run changes with the period, however little that moves."""
    sides = log.period * (1.0 + np.array([-1e-6, 0.0, 1e-6]))
    return len({tuple(one) for one in np.transpose(periods_used(np.full(3, log.end), sides, None))}) > 1


def _moves_by(trial: Log, feet: tuple[str, ...], name: str, parts: Floats) -> bool:
    """Whether a measure moves along the direction of a log by what its single derivatives times that come to, over some
    step."""
    for part in FINER:
        (along,), (kinked,) = measure_slopes(trial, feet, name, part)
        rounding = 1e-11 * abs(along) + ROUNDING * np.abs(trial.rows).max() / (part * step_along(trial, 0))
        if not kinked and abs(parts.sum() - along) <= AGREE * (np.abs(parts).sum() + abs(along)) + rounding:
            return True
    return False


def number_seeds(log: Log, number: NumberOf, times: Floats, states: Sampled | None) -> Seeds | None:
    """Of a function of a run's events, and of its states at times (nt,) where they are given. log as for
    `measure_seeds`.

    Numbers are tried in groups, and groups that do not matter left alone. Kinks as there.
    """
    order, given = event_order(log.rows)
    events = structured_events(log.rows)
    seeds = Seeds(np.zeros_like(log.rows), times, np.zeros((len(times), 0 if states is None else _width(states))))
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
                kinked = place.told(value, own)
                if kinked:
                    return None
        elif any(_moved(group, sign, value) != own for sign in (1.0, -1.0)):
            half = len(group) // 2
            groups += [group[:half], group[half:]]
    period = np.zeros(1)
    if log.by_period.any() and _period_place(log, events, order, period).told(value, own):
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

    def told(self, value: Callable[[], float], own: float) -> bool:
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


def _turns(log: Log) -> Floats:
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


def _event_places(log: Log, events: NDArray[np.void], order: Rows, given: Rows, to: Floats) -> list[_Place]:
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
        beside = [groups[k][0] for k in (n - 1, n + 1) if 0 <= k < len(groups)]
        rooms += [MOVED * abs(time[k] - when) for k in beside if events["foot"][k] == events["foot"][group[0]]]
        step = min((float(room) for room in rooms if room > MOVED * TOGETHER * log.period), default=LARGEST * log.end)
        row = int(given[order[group[-1]]])
        out.append(_Place(((time, group, np.ones(len(group))),), step, to, (row, E_TIME)))
    return out


def _period_place(log: Log, events: NDArray[np.void], order: Rows, to: Floats) -> _Place:
    """The drive period, with which the marks move."""
    marks, rising = (np.flatnonzero(one[order]) for one in _marks(log.rows))
    turns = _turns(log)[order]
    parts = (
        (events["time"], marks, turns[marks]),
        (events["apex_time"], rising, turns[rising]),
    )
    return _Place(parts, LARGEST * log.period / max(float(turns.max(initial=1.0)), 1.0), to, (0,))


def _width(states: Sampled) -> int:
    return sum(len(getattr(states, name)) for name in STATES)


def _state_places(states: Sampled, to: Floats) -> list[_Place]:
    """Every number of the states."""
    out, column, one = [], 0, np.ones(1)
    for name in STATES:
        for row in getattr(states, name):
            step = LARGEST * (float(np.abs(row).max(initial=0.0)) or 1.0)
            out += [_Place(((row, np.array([k]), one),), step, to, (k, column)) for k in range(len(row))]
            column += 1
    return out
