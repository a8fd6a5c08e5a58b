"""What an instrument reads of one foot in windows of a run: the measures a table can hold."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tarsus.measure import FootHistory, foot_history
from tarsus.solve.batch import BatchRun

__all__ = ["MEASURES", "MOTION", "Reading", "readings"]

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Reading:
    """A foot's history in nw windows with edges (nw + 1,) [s], under a drive period [s] and a resolution [m]."""

    history: FootHistory
    edges: Floats
    period: float
    resolution: float

    @property
    def length(self) -> float:
        """Length of a window [s]."""
        return float(self.edges[1] - self.edges[0])

    @cached_property
    def flights(self) -> NDArray[np.bool_]:
        """Flights between two contacts that clear the resolution."""
        return self.history.rebound & (self.history.apex > self.resolution) & np.isfinite(self.history.apex)

    def count(self, times: Floats) -> Floats:
        return np.histogram(times, bins=self.edges)[0].astype(float)

    @cached_property
    def bounces(self) -> Floats:
        return self.count(self.history.bounces(self.resolution))

    @cached_property
    def contact(self) -> Floats:
        return np.diff(self.history.contact_until(self.edges, self.resolution))

    def largest(self) -> Floats:
        out = np.zeros(len(self.edges) - 1)
        at = np.searchsorted(self.edges, self.history.top_time, side="right") - 1
        inside = (at >= 0) & (at < len(out))
        np.maximum.at(out, at[inside], self.history.top[inside])
        return out

    def mean_apex(self) -> Floats:
        start, apex = self.history.flight_start[self.flights], self.history.apex[self.flights]
        total = np.histogram(start, bins=self.edges, weights=apex)[0]
        number = self.count(start)
        return np.where(number > 0, total / np.maximum(number, 1.0), np.nan)


MEASURES: dict[str, tuple[str, Callable[[Reading], Floats]]] = {
    "bounces": ("1", lambda r: r.bounces * r.period / r.length),
    "bounces_per_second": ("1/s", lambda r: r.bounces / r.length),
    "peak": ("m", Reading.largest),
    "mean_apex": ("m", Reading.mean_apex),
    "contact_duration": ("s", lambda r: r.contact * r.period / r.length),
    "duty_factor": ("1", lambda r: r.contact / r.length),
}
"""Measures by name: SI unit, and values (nw,) by window; counts and durations are per drive period."""

MOTION = {"swing": "m", "oscillations_per_step": "1"}
"""Measures of the foot's motion in a single recorded run, for constraints; see `tarsus.calibrate.motion`."""


def readings(
    run: BatchRun, foot: int, names: Sequence[str], edges: Floats, resolution: float
) -> NDArray[np.float64]:
    """Measures (names, windows) of a foot; NaN where a window has none."""
    history = foot_history(run.all_events, foot, run.duration)
    seen = Reading(history, edges, run.period, resolution)
    return np.array([MEASURES[name][1](seen) for name in names])
