"""Statistics by drive period or by any window of time, with their spread."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from tarsus.errors import InputError
from tarsus.measure.cautions import cautions
from tarsus.measure.history import RESOLUTION, Counting, Floats, FootHistory, foot_history
from tarsus.measure.measure import Measures, Moments, Scope, of_feet


class Judged(Protocol):
    """What is judged: a run, or one run of a batch."""

    @property
    def all_events(self) -> np.ndarray: ...
    @property
    def foot_names(self) -> tuple[str, ...]: ...
    @property
    def end_time(self) -> float: ...
    @property
    def period(self) -> float: ...


def scene_period(scene: Any, duration: float) -> float:
    """Period [s] that statistics refer to: the longest of the drives' periods, or the whole run without one."""
    periods = [p for p in (waveform.period for waveform in scene.waveforms.values()) if p is not None]
    return max((p for p in periods if p <= duration), default=duration)


def periods_used(reached: float, period: float, skip: int | None) -> tuple[int, int]:
    """Number of the first drive period of the statistics, and of whole periods in all, of a run that reached a time
    [s]: at least one, which is a broken one if need be, but none where no time passed; see `period_statistics`."""
    if not reached > 0.0:
        return 0, 0
    count = max(int(np.floor(reached / period * (1.0 + 1e-9))), 1)
    return ((count + 2) // 3 if skip is None and count > 1 else min(skip or 0, count - 1)), count


def period_edges(run: Judged, period: float | None = None, skip: int | None = None) -> Floats:
    """Edges (np + 1,) [s] of the drive periods that `period_statistics` is taken over."""
    span = run.period if period is None else period
    dropped, count = periods_used(run.end_time, span, skip)
    edges = np.arange(dropped, count + 1, dtype=float) * span
    if count == 1:
        edges[1] = min(span, run.end_time)
    return edges


def histories_of(run: Judged) -> dict[str, FootHistory]:
    """What every foot of a run did, by its name."""
    return {name: foot_history(run.all_events, i, run.end_time) for i, name in enumerate(run.foot_names)}


def period_statistics(
    run: Judged,
    period: float | None = None,
    skip: int | None = None,
    height: float = RESOLUTION,
    dwell: float | None = None,
    histories: Mapping[str, FootHistory] | None = None,
    names: Collection[str] | None = None,
) -> Measures:
    """Measures of a run by drive period, after transients.

    Parameters
    ----------
    period
        Drive period [s]; the run's own by default.
    skip
        Periods dropped as transient at the start; by default a third of the whole ones (none of a single one).
    height
        Height [m] that a flight must clear to be seen; lower ones are contact.
    dwell
        Length [s] that the contact before a flight must stay below for it to be a bounce; by default 0.5 ms or a tenth
        of the period, whichever is shorter.
    histories
        Of the run's feet, where they are known already.
    names
        Measures that are asked for, without warnings; all by default. Those of other kinds are passed over.
    """
    span = run.period if period is None else period
    counting = Counting.of(span, height, dwell)
    histories = histories_of(run) if histories is None else histories
    edges = period_edges(run, period, skip)
    if names is not None:
        wanted = [name for name in _DEFINITIONS if name in names]
        return _statistics(histories, edges, counting, "drive period", wanted)
    found = _statistics(histories, edges, counting, "drive period")
    return Measures(found, cautions(histories, edges, counting, found, periods=True))


def window_statistics(
    run: Judged,
    start: float,
    length: float,
    count: int = 1,
    height: float = RESOLUTION,
    dwell: float | None = None,
    histories: Mapping[str, FootHistory] | None = None,
) -> Measures:
    """The measures of `period_statistics` as an instrument takes them: over windows of time, whatever the drive does.

    ``count`` windows of ``length`` [s] follow each other from ``start`` [s]; value and spread are taken over them. A
    flight counts in the window in which it begins, and its apex in the window in which it is reached. ``peak`` is the
    highest apex or gap at a period mark in the window; ``duty_factor`` the share of the window in contact.

    Raises
    ------
    InputError
        If the windows are not within the time that the run reached.
    """
    last = start + count * length
    if not (start >= 0.0 and length > 0.0 and count >= 1 and last <= run.end_time * (1.0 + 1e-9)):
        raise InputError(
            f"window: expected {count} times {length:g} s from {start:g} s on to lie within the {run.end_time:g} s "
            "that the run reached, each longer than 0 s"
        )
    counting = Counting.of(run.period, height, dwell)
    histories = histories_of(run) if histories is None else histories
    edges = start + length * np.arange(count + 1, dtype=float)
    found = _statistics(histories, edges, counting, f"window of {length * 1e3:.4g} ms")
    return Measures(found, cautions(histories, edges, counting, found, periods=False))


def by_window(
    histories: Mapping[str, FootHistory],
    edges: Floats,
    counting: Counting,
    names: Iterable[str] | None = None,
) -> dict[str, Floats]:
    """Measures of the feet (m, np) in each window between ``edges`` (np + 1,) [s], SI, NaN where there is none: all
    that `period_statistics` has, or those in ``names``."""
    feet = [_Seen(history, edges, counting) for history in histories.values()]
    shape = len(feet), max(len(edges) - 1, 0)
    wanted = _DEFINITIONS if names is None else names
    return {name: np.array([_DEFINITIONS[name].of(foot) for foot in feet]).reshape(shape) for name in wanted}


def _statistics(
    histories: Mapping[str, FootHistory],
    edges: Floats,
    counting: Counting,
    span: str,
    names: Iterable[str] | None = None,
) -> Measures:
    words = {"span": span, **counting.words()}
    found = by_window(histories, edges, counting, names)
    if not found:
        return Measures({})
    moments = Moments.of(np.stack(list(found.values())))
    values = {}
    for number, name in enumerate(found):
        one = _DEFINITIONS[name]
        values[name] = of_feet(
            moments[number], tuple(histories), one.unit, one.words.format(**words), one.scope,
            height=counting.height if "{height}" in one.words else None,
            dwell=counting.dwell if "{dwell}" in one.words else None,
        )  # fmt: skip
    return Measures(values)


@dataclass(frozen=True)
class _Seen:
    """What a foot did, by window: between instants ``edges`` (np + 1,) [s]."""

    history: FootHistory
    edges: Floats
    counting: Counting

    def total(self, times: Floats, values: Floats | None = None) -> Floats:
        """Sum of the values at times in each window, or how many times there are; one at the last edge is inside."""
        windows = len(self.edges) - 1
        index = np.searchsorted(self.edges, times, side="right") - 1
        index[times == self.edges[-1]] = windows - 1
        inside = (index >= 0) & (index < windows)
        weights = None if values is None else values[inside]
        return np.bincount(index[inside], weights, minlength=windows).astype(float)

    def mean(self, times: Floats, values: Floats) -> Floats:
        """Mean of the values at times in each window, NaN where there is none."""
        count = self.total(times)
        return np.where(count > 0, self.total(times, values) / np.maximum(count, 1.0), np.nan)

    def largest(self, times: Floats, values: Floats) -> Floats:
        """Largest value in each window, NaN where there is none."""
        out = np.full(len(self.edges) - 1, -np.inf)
        index = np.searchsorted(self.edges, times * (1.0 - 1e-12), side="right") - 1
        inside = (index >= 0) & (index < len(out)) & (times >= self.edges[0])
        np.maximum.at(out, index[inside], values[inside])
        return np.where(np.isfinite(out), out, np.nan)

    @cached_property
    def bounces(self) -> Floats:
        return self.total(self.history.flight_start[self.history.bounces(self.counting)])

    @cached_property
    def contact(self) -> Floats:
        return np.diff(self.history.contact_until(self.edges, self.counting.height))

    @cached_property
    def lengths(self) -> Floats:
        return np.diff(self.edges)


def _bounces(foot: _Seen) -> Floats:
    return foot.bounces


def _bounces_per_second(foot: _Seen) -> Floats:
    return foot.bounces / foot.lengths


def _rebounds(foot: _Seen) -> Floats:
    return foot.total(foot.history.flight_start[foot.history.rebounds(foot.counting.height)])


def _contact(foot: _Seen) -> Floats:
    return foot.contact


def _duty(foot: _Seen) -> Floats:
    return foot.contact / foot.lengths


def _peak(foot: _Seen) -> Floats:
    peak = foot.largest(foot.history.top_time, foot.history.top)
    held = foot.contact > 0.999999 * foot.lengths
    return np.where(np.isnan(peak) & held, 0.0, peak)


def _mean_apex(foot: _Seen) -> Floats:
    hops = foot.history.hops(foot.counting.height)
    return foot.mean(foot.history.apex_time[hops], foot.history.apex[hops])


def _mean_height(foot: _Seen) -> Floats:
    return np.diff(foot.history.integral_until(foot.edges)) / foot.lengths


def _impacts(foot: _Seen) -> Floats:
    return foot.total(foot.history.impact_time)


def _mean_impact(foot: _Seen) -> Floats:
    return foot.mean(foot.history.impact_time, foot.history.impact_speed)


def _hardest(foot: _Seen) -> Floats:
    return foot.largest(foot.history.impact_time, foot.history.impact_speed)


@dataclass(frozen=True)
class _Definition:
    unit: str
    scope: Scope
    words: str
    of: Callable[[_Seen], Floats]


_BOUNCE = (
    "flights from a touchdown to the next, or cut off by the end, whose apex clears {height}, after a contact shorter "
    "than {dwell}, however they began"
)
_DEFINITIONS: dict[str, _Definition] = {
    "bounces": _Definition("1", Scope.MEAN, f"bounces per {{span}}: {_BOUNCE}", _bounces),
    "contact_duration": _Definition(
        "s", Scope.MEAN, "total time per {span} with zero gap, flights below {height} included", _contact
    ),
    "peak": _Definition(
        "m", Scope.WORST,
        "peak oscillation amplitude: from the contact level to the highest point in a {span}; 0 if always held",
        _peak,
    ),
    "mean_apex": _Definition(
        "m", Scope.MEAN, "mean of the highest points in a {span} of the flights from the ground that clear {height}",
        _mean_apex,
    ),
    "mean_height": _Definition("m", Scope.MEAN, "gap averaged over the time of a {span}", _mean_height),
    "bounces_per_second": _Definition(
        "1/s", Scope.MEAN, f"bounces in a {{span}} over its length: {_BOUNCE}", _bounces_per_second
    ),
    "rebounds": _Definition(
        "1", Scope.MEAN, "flights per {span} that begin by restitution and clear {height}", _rebounds
    ),
    "duty_factor": _Definition("1", Scope.MEAN, "contact duration over {span}, flights below {height} included", _duty),
    "impacts": _Definition("1", Scope.MEAN, "touchdowns per {span}, captures and chatter included", _impacts),
    "impact_speed": _Definition(
        "m/s", Scope.MEAN, "mean approach speed of the touchdowns in a {span}", _mean_impact
    ),
    "hardest_impact": _Definition(
        "m/s", Scope.WORST, "highest approach speed of a touchdown in a {span}", _hardest
    ),
}  # fmt: skip
