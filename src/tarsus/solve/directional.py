"""Directional derivatives of measures through their one definition: along the derivatives of a run's events."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.base.events import EventKind
from tarsus.base.spec import get_value, with_values
from tarsus.core.arrays import E_APEX, E_FOOT, E_KIND, E_TIME
from tarsus.measure.history import RESOLUTION
from tarsus.measure.origins import TOGETHER, event_slopes
from tarsus.measure.table import Judgement, RunTable, periods_used
from tarsus.measure.walking import measured
from tarsus.plan.slots import Kind, slot
from tarsus.solve.codes import EVENT_TYPE, event_order, structured_events, structured_marks

if TYPE_CHECKING:
    from tarsus.model.scene import Scene

Floats = NDArray[np.float64]

_NAMES = EVENT_TYPE.names or ()
STEPS = np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
"""Where the values of a difference are, in steps; with these weights its error is of fourth order."""
_WEIGHTS = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / 12.0
MOVED = 0.02
"""Part of an interval by which events move at most: none changes places with another, or with the edge of a period."""
LARGEST = 1e-3
"""Part of themselves that times and heights move by at most: measures are ratios of sums of events' numbers, of which
the stencil leaves 1e-14 then."""
WAY = 1e-5
"""Part of themselves that a walker's strides change by at most: costs per way bend by twice as much."""
_ONE_SIDE = np.array([1.5, -2.0, 0.5])
"""Weights of a difference of second order from a value to one side."""
KINK = 1e-4
"""Part by which differences of second order to both sides must differ for a kink or a jump: of a smooth measure that is
the square of what it bends by over `LARGEST`, or over the `MOVED` part of a flight that a window cuts."""


@dataclass(frozen=True)
class Ways:
    """What a walker's run has beside its events: rows of marks (nm, width) and their derivatives slopes (nm, width, P)
    along directions of its scene (P): weights of its numbers by path."""

    rows: Floats
    slopes: Floats
    scene: Scene
    directions: Sequence[Mapping[str, float]]

    def sizes(self, p: int) -> tuple[Floats, Floats]:
        """Sizes of the numbers of direction p, and how fast each moves along it."""
        one = self.directions[p]
        values = [float(get_value(self.scene, path)) for path in one]
        return np.abs(np.array(values)), np.array(list(one.values()))

    def described(self, p: int, along: float) -> Scene:
        """The scene so far along direction p, but for numbers of its ground and its start: of those measures know by
        the run alone."""
        known = {path: slot(self.scene, path) for path in self.directions[p]}
        moved = {
            path: float(get_value(self.scene, path)) + along * self.directions[p][path]
            for path, place in known.items()
            if place is not None and place.kind in (Kind.DRIVE, Kind.GAIT, Kind.GRAVITY)
        }
        return with_values(self.scene, moved) if moved else self.scene


@dataclass(frozen=True)
class EventDerivatives:
    """Events of a run: rows (ne, 12) with its marks, and their derivatives slopes (ne, 12, P); time reached end [s],
    drive period [s] and its derivatives by_period (P,); ways: of a walker's run."""

    rows: Floats
    slopes: Floats
    end: float
    period: float
    by_period: Floats
    ways: Ways | None = None


def measure_slopes(log: EventDerivatives, feet: Sequence[str], name: str) -> tuple[Floats, NDArray[np.bool_]]:
    """Derivatives (P,) of a measure of a run of feet by name, and where (P,) it has a kink or a jump."""

    def differences(log: EventDerivatives) -> tuple[Floats, NDArray[np.bool_]]:
        return directional_slopes(
            log, lambda rows, periods, along: _values(log, feet, rows, periods, along, name)
        )

    known = row_slopes(log, feet, name)
    if known is None:
        return differences(log)
    rows, period = known
    used = np.nonzero(rows)
    slopes, kinked = (
        rows[used] @ log.slopes[used] + period * log.by_period,
        np.zeros(len(log.by_period), dtype=bool),
    )
    apart = _leave_edges(log)
    if log.by_period.any() and jumps(log):
        apart |= log.by_period != 0.0
    moved = np.flatnonzero(apart)
    if len(moved):
        part = replace(log, slopes=log.slopes[..., moved], by_period=log.by_period[moved], ways=None)
        slopes[moved], kinked[moved] = differences(part)
    return slopes, kinked


def _leave_edges(log: EventDerivatives) -> NDArray[np.bool_]:
    """Along which derivatives (P,) an event leaves the edge of a period that it is at."""
    rows, kinds = log.rows, (EventKind.PERIOD_MARK, EventKind.CONTACT_AT_START)
    time = rows[:, E_TIME]
    turns = np.round(time / log.period)
    exact = np.abs(time - turns * log.period) <= 8.0 * np.spacing(time)
    at = np.flatnonzero(exact & (time > 0.0) & ~np.isin(rows[:, E_KIND], kinds))
    ways = np.abs(log.slopes[at, E_TIME] - turns[at, None] * log.by_period)
    # of what moves with it to rounding nothing is left in a difference over `LARGEST`
    return np.asarray((ways > 1e-9 * np.abs(turns[at, None] * log.by_period)).any(axis=0))


def row_slopes(log: EventDerivatives, feet: Sequence[str], name: str) -> tuple[Floats, float] | None:
    """Derivatives of a measure by event rows (ne, 12) in the order in which the engine met them, and by the drive
    period, with which the marks move; None where they are not known, or the measure may have a kink or a jump."""
    place, given = event_order(log.rows)
    table = table_of(replace(log, ways=None), feet, log.rows[None], np.array([log.period]), np.zeros((1, 1)))
    found = event_slopes(Judgement(table), name)
    if found is None:
        return None
    rows = np.zeros_like(log.rows)
    for field, column in found.fields.items():
        np.add.at(rows[:, _NAMES.index(field)], given[place] if field == "time" else place, column)
    return rows, found.period


def jumps(log: EventDerivatives) -> bool:
    """Whether the number of whole periods of a run changes with the period, however little that moves."""
    sides = log.period * (1.0 + np.array([-1e-6, 0.0, 1e-6]))
    return len({tuple(one) for one in np.transpose(periods_used(np.full(3, log.end), sides, None))}) > 1


def directional_slopes(
    log: EventDerivatives, of: Callable[[Floats, Floats, Floats], Floats]
) -> tuple[Floats, NDArray[np.bool_]]:
    """Derivatives (P, ...) of what a function makes of runs' events (nr, ne, 12), periods (nr,) and steps (P, nr / P)
    along the derivatives, a number of each run or several (nr, ...), and where (P, ...) it has a kink or a jump."""
    size = np.array([step_along(log, p) for p in range(len(log.by_period))])
    along = STEPS * size[:, None]
    rows = log.rows + along[:, :, None, None] * np.moveaxis(log.slopes, 2, 0)[:, None]
    periods = log.period + along * log.by_period[:, None]
    made = of(rows.reshape(-1, *log.rows.shape), periods.ravel(), along)
    slopes, kinked = difference(np.moveaxis(made.reshape(len(size), len(STEPS), *made.shape[1:]), 1, -1))
    return slopes / size.reshape(-1, *(1,) * (slopes.ndim - 1)), kinked


def difference(values: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """From values (..., 5) at `STEPS`, the difference a step and whether there is a kink or a jump."""
    moved = (
        values - values[..., 2:3]
    )  # of equal numbers no weights leave their rounding: counts have no slope
    ahead, behind = moved[..., 2:] @ -_ONE_SIDE, moved[..., 2::-1] @ _ONE_SIDE
    largest = np.maximum(np.abs(ahead), np.abs(behind))
    rounding = 5e-13 * np.abs(values).max(axis=-1, initial=0.0)
    kinked = np.abs(ahead - behind) > KINK * largest + rounding
    return moved @ _WEIGHTS, kinked


def _values(
    log: EventDerivatives, feet: Sequence[str], rows: Floats, periods: Floats, along: Floats, name: str
) -> Floats:
    """The measure of runs that differ in their events (nr, ne, 12), periods and steps along the derivatives."""
    return measured(Judgement(table_of(log, feet, rows, periods, along)), [name])[name].value


def table_of(
    log: EventDerivatives, feet: Sequence[str], rows: Floats, periods: Floats, along: Floats
) -> RunTable:
    """Runs of feet that differ in their events (nr, ne, 12), periods (nr,) and steps (P, nr / P) along the derivatives,
    as measures see them."""
    runs, events = rows.shape[:2]
    ways, marks, first = log.ways, None, None
    if ways is not None:
        moved = ways.rows + along[:, :, None, None] * np.moveaxis(ways.slopes, 2, 0)[:, None]
        marks = structured_marks(moved.reshape(-1, ways.rows.shape[1]), len(feet))
        first = len(ways.rows) * np.arange(runs + 1)
    return RunTable(
        np.concatenate([structured_events(np.ascontiguousarray(one)) for one in rows]), events * np.arange(runs + 1),
        tuple(feet), np.full(runs, log.end), periods, np.arange(runs) if ways else np.zeros(runs, dtype=np.intp),
        lambda r: ways and ways.described(r // len(STEPS), float(along.ravel()[r])), marks, first,
    )  # fmt: skip


def step_along(log: EventDerivatives, p: int) -> float:
    """How far along derivative number p events may move."""
    events, slopes, period, by_period = log.rows, log.slopes[..., p], log.period, float(log.by_period[p])
    limits: list[float] = []

    def hold(room: Floats, moving: Floats, part: float, least: float = 0.0) -> None:
        meant = (room > least) & (np.abs(moving) > 0.0)
        limits.extend(part * room[meant] / np.abs(moving[meant]))

    time, moved = events[:, E_TIME], slopes[:, E_TIME]
    hold(np.abs(time), moved, LARGEST)
    hold(np.array([period]), np.array([by_period]), LARGEST)
    for foot in np.unique(events[:, E_FOOT]):
        own = events[:, E_FOOT] == foot
        hold(np.diff(time[own]), np.diff(moved[own]), MOVED, TOGETHER * period)
    edges = np.round(time / period)
    hold(np.abs(time - edges * period), moved - edges * by_period, MOVED, TOGETHER * period)
    apex = events[:, E_APEX]
    hold(np.abs(apex - RESOLUTION), slopes[:, E_APEX], MOVED)
    hold(np.abs(apex), slopes[:, E_APEX], LARGEST)
    if log.ways is not None:
        way, moved = log.ways.rows, log.ways.slopes[..., p]
        strides, change = (np.abs(np.diff(one, axis=0)).max(axis=0, initial=0.0) for one in (way, moved))
        hold(strides, change, WAY)
        hold(*log.ways.sizes(p), LARGEST)
    numbers = np.abs(events).max(axis=0, initial=0.0)
    hold(numbers, np.abs(slopes).max(axis=0, initial=0.0), LARGEST)
    return float(min(limits, default=1.0))
