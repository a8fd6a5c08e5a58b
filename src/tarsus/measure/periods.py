"""Statistics by drive period, after transients, with their spread."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from tarsus.measure.history import FootHistory, foot_history

RESOLUTION = 1e-7
"""Height [m] a rebound must clear to count as a bounce: the resolution of the source's vibrometer."""


@dataclass(frozen=True)
class Measure:
    """One number with its unit, its spread over ``n`` drive periods and its definition.

    ``value`` is the mean over feet, ``per_foot`` that of each foot; ``spread`` is the standard deviation from
    period to period (the largest of the feet).
    """

    value: float
    unit: str
    spread: float
    n: int
    definition: str
    per_foot: Mapping[str, float] = field(default_factory=dict)


class Measures(Mapping[str, Measure]):
    """Measures by name; also as attributes: ``run.measures.contact_duration``."""

    def __init__(self, values: dict[str, Measure]) -> None:
        self._values = values

    def __getitem__(self, name: str) -> Measure:
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __getattr__(self, name: str) -> Measure:
        values: dict[str, Measure] = self.__dict__.get("_values", {})  # none yet while it is unpickled
        if name not in values:
            raise AttributeError(f"there is no measure {name!r}; there are {', '.join(values)}")
        return values[name]


class Judged(Protocol):
    """What is judged: a run, or one run of a batch."""

    @property
    def all_events(self) -> np.ndarray: ...
    @property
    def foot_names(self) -> tuple[str, ...]: ...
    @property
    def duration(self) -> float: ...
    @property
    def period(self) -> float: ...


def scene_period(scene: Any, duration: float) -> float:
    """Period [s] that statistics refer to: the longest of the drives' periods, or the whole run without one."""
    periods = [p for p in (waveform.period for waveform in scene.waveforms.values()) if p is not None]
    return max((p for p in periods if p <= duration), default=duration)


def periods_used(duration: float, period: float, skip: int | None) -> tuple[int, int]:
    """Number of the first drive period of the statistics, and of whole periods in all (at least one); see
    `period_statistics`."""
    count = max(int(np.floor(duration / period * (1.0 + 1e-9))), 1)
    return ((count + 2) // 3 if skip is None and count > 1 else min(skip or 0, count - 1)), count


def histories_of(run: Judged) -> dict[str, FootHistory]:
    """What every foot of a run did, by its name."""
    return {name: foot_history(run.all_events, i, run.duration) for i, name in enumerate(run.foot_names)}


def period_statistics(
    run: Judged,
    period: float | None = None,
    skip: int | None = None,
    resolution: float = RESOLUTION,
    histories: Mapping[str, FootHistory] | None = None,
) -> Measures:
    """Measures of a run by drive period.

    Parameters
    ----------
    period
        Drive period [s]; the run's own by default.
    skip
        Periods dropped as transient at the start; by default a third of the whole ones (none of a single one).
    resolution
        Height [m] a rebound must clear to count as a bounce.
    histories
        Of the run's feet, where they are known already.
    """
    span = run.period if period is None else period
    dropped, count = periods_used(run.duration, span, skip)
    edges = np.arange(dropped, count + 1) * span
    if count == 1:
        edges = np.array([0.0, run.duration])
    histories = histories_of(run) if histories is None else histories
    feet = [_Seen(history, edges, resolution) for history in histories.values()]
    values: dict[str, Measure] = {}
    for name, (unit, definition, by_period) in _DEFINITIONS.items():
        rows = np.array([by_period(foot) for foot in feet]).reshape(len(feet), len(edges) - 1)
        about = definition.format(resolution=f"{resolution * 1e6:g} um")
        values[name] = _measure(rows, tuple(histories), unit, about)
    return Measures(values)


def _measure(rows: np.ndarray, feet: tuple[str, ...], unit: str, definition: str) -> Measure:
    """A measure from its values (m, np) by foot and period, NaN where there is none."""
    known = np.isfinite(rows)
    count = known.sum(axis=1)
    mean = np.full(len(feet), np.nan)
    np.divide(np.where(known, rows, 0.0).sum(axis=1), count, out=mean, where=count > 0)
    square = np.where(known, rows - mean[:, None], 0.0) ** 2
    several = count > 1
    spread = np.sqrt(square.sum(axis=1)[several] / (count[several] - 1))
    met = mean[count > 0]
    return Measure(
        value=float(met.mean()) if met.size else float("nan"), unit=unit,
        spread=float(spread.max()) if spread.size else float("nan"), n=int(count.min()) if feet else 0,
        definition=definition, per_foot=dict(zip(feet, mean.tolist(), strict=True)),
    )  # fmt: skip


@dataclass(frozen=True)
class _Seen:
    """What a foot did, by period: between instants ``edges`` (np + 1,) [s], bounces from ``resolution`` [m] on."""

    history: FootHistory
    edges: np.ndarray
    resolution: float

    def count(self, times: np.ndarray) -> np.ndarray:
        """How many of the times are in each period."""
        return np.histogram(times, bins=self.edges)[0].astype(float)

    @cached_property
    def impacts(self) -> np.ndarray:
        return self.count(self.history.impact_time)

    @cached_property
    def contact(self) -> np.ndarray:
        return np.diff(self.history.contact_until(self.edges, self.resolution))

    @cached_property
    def lengths(self) -> np.ndarray:
        return np.diff(self.edges)

    def largest(self, times: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Largest value in each period, NaN where there is none."""
        out = np.full(len(self.edges) - 1, -np.inf)
        index = np.searchsorted(self.edges, times * (1.0 - 1e-12), side="right") - 1
        inside = (index >= 0) & (index < len(out)) & (times >= self.edges[0])
        np.maximum.at(out, index[inside], values[inside])
        return np.where(np.isfinite(out), out, np.nan)


def _bounces(foot: _Seen) -> np.ndarray:
    return foot.count(foot.history.bounces(foot.resolution))


def _contact(foot: _Seen) -> np.ndarray:
    return foot.contact


def _duty(foot: _Seen) -> np.ndarray:
    return foot.contact / foot.lengths


def _peak(foot: _Seen) -> np.ndarray:
    peak = foot.largest(foot.history.top_time, foot.history.top)
    held = foot.contact > 0.999999 * foot.lengths
    return np.where(np.isnan(peak) & held, 0.0, peak)


def _hardest(foot: _Seen) -> np.ndarray:
    return foot.largest(foot.history.impact_time, foot.history.impact_speed)


def _mean_impact(foot: _Seen) -> np.ndarray:
    total = np.histogram(foot.history.impact_time, bins=foot.edges, weights=foot.history.impact_speed)[0]
    return np.where(foot.impacts > 0, total / np.maximum(foot.impacts, 1), np.nan)


def _impacts(foot: _Seen) -> np.ndarray:
    return foot.impacts


_Definition = tuple[str, str, Callable[[_Seen], np.ndarray]]
_DEFINITIONS: dict[str, _Definition] = {
    "bounces": (
        "1",
        "rebounds from contact per drive period whose apex clears {resolution}",
        _bounces,
    ),
    "contact_duration": (
        "s",
        "total time per drive period with zero gap, chatter below {resolution} included",
        _contact,
    ),
    "peak": (
        "m",
        "peak oscillation amplitude: from the contact level to the highest point in a drive period; 0 if always held",
        _peak,
    ),
    "duty_factor": ("1", "contact duration over drive period", _duty),
    "impacts": ("1", "touchdowns per drive period, captures and chatter included", _impacts),
    "impact_speed": ("m/s", "mean approach speed of the touchdowns in a drive period", _mean_impact),
    "hardest_impact": ("m/s", "highest approach speed of a touchdown in a drive period", _hardest),
}
