"""Directional derivatives of measures through their one definition: along the derivatives of a run's events."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tarsus.core.arrays import E_APEX, E_FOOT, E_TIME
from tarsus.measure import Judgement, RunTable, measured
from tarsus.measure.history import RESOLUTION
from tarsus.solve.codes import structured_events

__all__ = ["measure_slopes"]

Floats = NDArray[np.float64]

_STEPS = np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
_WEIGHTS = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / 12.0
MOVED = 0.02
"""Part of an interval by which events move at most: none changes places with another, or with the edge of a period."""
LARGEST = 1e-3
"""Part of themselves that times and heights move by at most: measures are ratios of sums of events' numbers, of which the
stencil leaves 1e-14 then."""
TOGETHER = 1e-9
"""Part of a period within which events, and the edges of periods, count as coinciding: a kink of a measure tells if they
should not."""
KINK = 1e-4
"""Part by which differences to both sides must differ for a kink or a jump: a smooth measure bends by less over `LARGEST`."""


def measure_slopes(
    events: Floats, slopes: Floats, feet: Sequence[str], end: float, period: float, by_period: Floats, name: str
) -> tuple[Floats, NDArray[np.bool_]]:
    """Derivatives (P,) of a measure of a run, and where (P,) it has a kink or a jump.

    Parameters
    ----------
    events, slopes
        Event rows (ne, 12) of the run with its marks, and their derivatives (ne, 12, P).
    feet, end, period, by_period
        Names of the feet, time reached [s], drive period [s] and its derivatives (P,).
    name
        Of the measure.
    """
    count = slopes.shape[2]
    size = np.array([_step(events, slopes[..., p], period, float(by_period[p])) for p in range(count)])
    rows = events[None, None] + _STEPS[None, :, None, None] * np.moveaxis(slopes, 2, 0)[:, None] * size[:, None, None, None]
    periods = period + _STEPS * (size * by_period)[:, None]
    values = _values(rows.reshape(-1, *events.shape), feet, end, periods.ravel(), name).reshape(count, 5)
    ahead, behind = values[:, 3] - values[:, 2], values[:, 2] - values[:, 1]
    largest = np.maximum(np.abs(ahead), np.abs(behind))
    rounding = 1e-13 * np.abs(values).max(axis=1)
    kinked = np.abs(ahead - behind) > KINK * largest + rounding
    return values @ _WEIGHTS / size, kinked


def _values(rows: Floats, feet: Sequence[str], end: float, periods: Floats, name: str) -> Floats:
    """The measure of runs that differ in their events (nr, ne, 12) and periods."""
    runs, events = rows.shape[:2]
    table = RunTable(
        np.concatenate([structured_events(np.ascontiguousarray(one)) for one in rows]), events * np.arange(runs + 1),
        tuple(feet), np.full(runs, end), periods, np.zeros(runs, dtype=np.intp), lambda _: None,
    )  # fmt: skip
    return measured(Judgement(table), [name])[name].value


def _step(events: Floats, slopes: Floats, period: float, by_period: float) -> float:
    """How far along the derivatives events may move."""
    limits = []

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
