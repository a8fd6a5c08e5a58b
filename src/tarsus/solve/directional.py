"""Directional derivatives of measures through their one definition: along the derivatives of a run's events."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.core.arrays import E_APEX, E_FOOT, E_TIME
from tarsus.measure import Judgement, RunTable, measured
from tarsus.measure.history import RESOLUTION
from tarsus.solve.codes import structured_events

__all__ = ["Log", "directional_slopes", "measure_slopes", "table_of"]

Floats = NDArray[np.float64]

_STEPS = np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
_WEIGHTS = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / 12.0
MOVED = 0.02
"""Part of an interval by which events move at most: none changes places with another, or with the edge of a period."""
LARGEST = 1e-3
"""Part of themselves that times and heights move by at most: measures are ratios of sums of events' numbers, of which
the stencil leaves 1e-14 then."""
TOGETHER = 1e-9
"""Part of a period within which events, and the edges of periods, count as coinciding: a kink of a measure tells if
they should not."""
_ONE_SIDE = np.array([1.5, -2.0, 0.5])
KINK = 1e-4
"""Part by which differences of second order to both sides must differ for a kink or a jump: of a smooth measure that is
the square of what it bends by over `LARGEST`, or over the `MOVED` part of a flight that a window cuts."""


@dataclass(frozen=True)
class Log:
    """Events of a run: rows (ne, 12) with its marks, and their derivatives slopes (ne, 12, P); time reached end [s],
    drive period [s] and its derivatives by_period (P,)."""

    rows: Floats
    slopes: Floats
    end: float
    period: float
    by_period: Floats


def measure_slopes(log: Log, feet: Sequence[str], name: str) -> tuple[Floats, NDArray[np.bool_]]:
    """Derivatives (P,) of a measure of a run of feet by name, and where (P,) it has a kink or a jump."""
    return directional_slopes(log, lambda rows, periods: _values(rows, feet, log.end, periods, name))


def directional_slopes(log: Log, of: Callable[[Floats, Floats], Floats]) -> tuple[Floats, NDArray[np.bool_]]:
    """Derivatives (P, ...) of what a function makes of runs' events (nr, ne, 12) and periods (nr,), a number of each
    run or several (nr, ...), and where (P, ...) it has a kink or a jump."""
    size = np.array([_step(log, p) for p in range(len(log.by_period))])
    along = _STEPS * size[:, None]
    rows = log.rows + along[:, :, None, None] * np.moveaxis(log.slopes, 2, 0)[:, None]
    periods = log.period + along * log.by_period[:, None]
    made = of(rows.reshape(-1, *log.rows.shape), periods.ravel())
    values = np.moveaxis(made.reshape(len(size), len(_STEPS), *made.shape[1:]), 1, -1)
    ahead, behind = values[..., 2:] @ -_ONE_SIDE, values[..., 2::-1] @ _ONE_SIDE
    largest = np.maximum(np.abs(ahead), np.abs(behind))
    rounding = 5e-13 * np.abs(values).max(axis=-1, initial=0.0)
    kinked = np.abs(ahead - behind) > KINK * largest + rounding
    slopes = values @ _WEIGHTS
    return slopes / size.reshape(-1, *(1,) * (slopes.ndim - 1)), kinked


def _values(rows: Floats, feet: Sequence[str], end: float, periods: Floats, name: str) -> Floats:
    """The measure of runs that differ in their events (nr, ne, 12) and periods."""
    return measured(Judgement(table_of(rows, feet, end, periods)), [name])[name].value


def table_of(rows: Floats, feet: Sequence[str], end: float, periods: Floats) -> RunTable:
    """Runs of feet up to ``end`` [s] that differ in their events (nr, ne, 12) and periods (nr,), as measures see
    them."""
    runs, events = rows.shape[:2]
    return RunTable(
        np.concatenate([structured_events(np.ascontiguousarray(one)) for one in rows]), events * np.arange(runs + 1),
        tuple(feet), np.full(runs, end), periods, np.zeros(runs, dtype=np.intp), lambda _: None,
    )  # fmt: skip


def _step(log: Log, p: int) -> float:
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
    numbers = np.abs(events).max(axis=0, initial=0.0)
    hold(numbers, np.abs(slopes).max(axis=0, initial=0.0), LARGEST)
    return float(min(limits, default=1.0))
