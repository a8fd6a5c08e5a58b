"""Statistics by drive period, after transients, with their spread."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
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
    values: dict[str, Measure] = {}
    for name, (unit, definition, by_period) in _DEFINITIONS.items():
        rows = {foot: by_period(history, edges, resolution) for foot, history in histories.items()}
        values[name] = _measure(rows, unit, definition.format(resolution=f"{resolution * 1e6:g} um"))
    return Measures(values)


def _measure(rows: dict[str, np.ndarray], unit: str, definition: str) -> Measure:
    per_foot, spreads, counts = {}, [], []
    for foot, row in rows.items():
        known = row[np.isfinite(row)]
        per_foot[foot] = float(known.mean()) if known.size else float("nan")
        spreads.append(float(known.std(ddof=1)) if known.size > 1 else float("nan"))
        counts.append(known.size)
    known = [v for v in per_foot.values() if np.isfinite(v)]
    spread = [s for s in spreads if np.isfinite(s)]
    return Measure(
        value=float(np.mean(known)) if known else float("nan"), unit=unit, spread=max(spread, default=float("nan")),
        n=min(counts, default=0), definition=definition, per_foot=per_foot,
    )  # fmt: skip


def _count(times: np.ndarray, edges: np.ndarray) -> np.ndarray:
    return np.histogram(times, bins=edges)[0].astype(float)


def _bounces(history: FootHistory, edges: np.ndarray, resolution: float) -> np.ndarray:
    return _count(history.bounces(resolution), edges)


def _contact(history: FootHistory, edges: np.ndarray, resolution: float) -> np.ndarray:
    return np.diff(history.contact_until(edges, resolution))


def _duty(history: FootHistory, edges: np.ndarray, resolution: float) -> np.ndarray:
    return _contact(history, edges, resolution) / np.diff(edges)


def _largest(times: np.ndarray, values: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Largest value in each period, NaN where there is none."""
    out = np.full(len(edges) - 1, -np.inf)
    index = np.searchsorted(edges, times * (1.0 - 1e-12), side="right") - 1
    inside = (index >= 0) & (index < len(out)) & (times >= edges[0])
    np.maximum.at(out, index[inside], values[inside])
    return np.where(np.isfinite(out), out, np.nan)


def _peak(history: FootHistory, edges: np.ndarray, resolution: float) -> np.ndarray:
    peak = _largest(history.top_time, history.top, edges)
    held = _contact(history, edges, resolution) > 0.999999 * np.diff(edges)
    return np.where(np.isnan(peak) & held, 0.0, peak)


def _hardest(history: FootHistory, edges: np.ndarray, resolution: float) -> np.ndarray:
    return _largest(history.impact_time, history.impact_speed, edges)


def _mean_impact(history: FootHistory, edges: np.ndarray, resolution: float) -> np.ndarray:
    count = _count(history.impact_time, edges)
    total = np.histogram(history.impact_time, bins=edges, weights=history.impact_speed)[0]
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _impacts(history: FootHistory, edges: np.ndarray, resolution: float) -> np.ndarray:
    return _count(history.impact_time, edges)


_Definition = tuple[str, str, Callable[[FootHistory, np.ndarray, float], np.ndarray]]
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
