"""Measures of a walk: where the body gets to, what its feet slide, and what it costs."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Protocol

import numpy as np

from tarsus.errors import InputError
from tarsus.measure.history import RESOLUTION, Floats
from tarsus.measure.measure import Measure, Measures, Scope, of_feet, of_robot
from tarsus.measure.periods import (
    Judged,
    histories_of,
    period_statistics,
    periods_used,
)
from tarsus.measure.switching import charging_energy
from tarsus.measure.whole import whole_run_statistics
from tarsus.structure import Walker

__all__ = ["STANDSTILL", "measures_of", "walk_statistics"]

STANDSTILL = 1e-10
"""Stride [m] below which a walker stands: ratios to its stride have no value there."""


class Walked(Judged, Protocol):
    """What is judged: a walker's run, or one run of a batch of them."""

    @property
    def scene(self) -> Any: ...
    @property
    def marks(self) -> np.ndarray | None: ...


def measures_of(
    run: Any,
    period: float | None = None,
    skip: int | None = None,
    height: float = RESOLUTION,
    dwell: float | None = None,
    names: Collection[str] | None = None,
) -> Measures:
    """Every measure of a run: those of its walk, where it walks, then those of its feet by drive period and in the
    whole run; see `walk_statistics`, `period_statistics` and `whole_run_statistics`. Or, without warnings, those of
    ``names`` that it has, at the cost of these alone."""
    histories = histories_of(run)
    feet = period_statistics(run, period, skip, height, dwell, histories, names)
    whole = whole_run_statistics(run, period, height, dwell, histories, names)
    return Measures({**walk_statistics(run, period, skip, names), **feet, **whole}, feet.warnings)


def walk_statistics(
    run: Walked, period: float | None = None, skip: int | None = None, names: Collection[str] | None = None
) -> Measures:
    """Measures of a walk by drive period; none for a structure that is no `Walker`.

    Parameters
    ----------
    period
        Drive period [s], a whole multiple of the run's own, which is the default.
    skip
        Periods dropped as transient at the start; by default a third of the whole ones (none of a single one).
    names
        Measures that are asked for; all by default.

    Raises
    ------
    InputError
        If ``period`` is no multiple of the run's own, at whose ends alone the way is known.
    """
    walker = run.scene.robot.structure
    if not isinstance(walker, Walker):
        return Measures({})
    way = _way(run, walker, period, skip)
    groups = (
        (_ON_THE_WAY, lambda: _on_the_way(way, walker)),
        (_COST, lambda: _cost(run, way, walker)),
        (_WHOLE_RUN, lambda: _whole_run(run.marks)),
    )
    found: dict[str, Measure] = {}
    for members, measures in groups:
        wanted = [name for name in members if names is None or name in names]
        if wanted:
            group = dict(measures())
            found |= {name: group[name] for name in wanted}
    return Measures(found)


@dataclass(frozen=True)
class _Way:
    """A walk by drive period after transients: np periods between ``edges`` (np + 1,) [s].

    stride (np,) [m] surge of the body; slip (np, m) [m] path each foot slid in contact; swing (np,) [m] highest minus
    lowest heave.
    """

    edges: Floats
    stride: Floats
    slip: Floats
    swing: Floats
    feet: tuple[str, ...]


def _way(run: Walked, walker: Walker, period: float | None, skip: int | None) -> _Way:
    span = run.period if period is None else period
    each = round(span / run.period)
    if each < 1 or abs(span / run.period - each) > 1e-6 * each:
        raise InputError(
            f"period: expected a multiple of {run.period:g} s, at which the way is known, got {span:g} s"
        )
    feet = tuple(run.foot_names)
    dropped, count = periods_used(run.end_time, span, skip)
    marks = run.marks
    if marks is None or not len(marks) or count == 0:
        return _Way(np.zeros(1), np.zeros(0), np.zeros((0, len(feet))), np.zeros(0), feet)
    if count == 1:
        rows = np.unique([0, min(each, len(marks) - 1)])
    else:
        rows = np.arange(dropped * each, min(count * each, _whole(marks["time"], run.period)) + 1, each)
    at = marks[rows]
    surge = at["body"][:, 0]
    spans = [slice(a + 1, b + 1) for a, b in pairwise(rows)]
    swing = [marks["highest"][one].max() - marks["lowest"][one].min() for one in spans]
    return _Way(at["time"], np.diff(surge), np.diff(at["slipped"], axis=0), np.array(swing), feet)


def _whole(times: Floats, period: float) -> int:
    """Number of the last mark at the end of a whole period; one may follow at the end of a broken one."""
    broken = len(times) > 1 and times[-1] - times[-2] < period * (1.0 - 1e-6)
    return len(times) - 1 - broken


_ON_THE_WAY = (
    "stride", "mean_speed", "body_lengths_per_second", "vertical_amplitude", "foot_slip", "slip_ratio",
)  # fmt: skip
_COST = "electrical_energy", "cost_of_transport"
_WHOLE_RUN = "max_heave", "max_surge"


def _on_the_way(way: _Way, walker: Walker) -> Iterator[tuple[str, Measure]]:
    yield "stride", of_robot(way.stride, "m", "surge of the body per drive period")
    speed = way.stride / np.diff(way.edges)
    yield "mean_speed", of_robot(speed, "m/s", "stride over drive period")
    length = walker.length
    yield "body_lengths_per_second", of_robot(
        speed / length if length > 0.0 else np.zeros(0), "1/s",
        "mean speed over the length of the body: that of its description, else from its first hip to its last; none "
        "where all hips are side by side",
    )  # fmt: skip
    yield (
        "vertical_amplitude",
        of_robot(way.swing, "m", "highest minus lowest heave of the body in a drive period"),
    )
    yield (
        "foot_slip",
        of_feet(way.slip.T, way.feet, "m", "path that a foot slides in contact per drive period", Scope.MEAN),
    )
    stride = np.abs(way.stride)[:, None]
    path = way.slip + stride
    ratio = np.full(path.shape, np.nan)
    np.divide(way.slip, path, out=ratio, where=path > STANDSTILL)
    yield "slip_ratio", of_feet(
        ratio.T, way.feet, "1",
        "foot slip over the sum of foot slip and stride, both without sign: 0 if the foot never slides, 1 if it slides "
        f"and the body gets nowhere; none where neither exceeds {STANDSTILL * 1e9:g} nm",
        Scope.MEAN,
    )  # fmt: skip


def _cost(run: Walked, way: _Way, walker: Walker) -> Iterator[tuple[str, Measure]]:
    scene, count = run.scene, len(way.stride)
    energy = np.zeros(count)
    if count:
        signals = scene.actuator_volts
        for name, drive in scene.robot.drives.items():
            energy += charging_energy(drive, signals[name], way.edges)
    known = energy[np.isfinite(energy)]
    drawn = of_robot(
        known if len(known) == count else np.zeros(0), "J",
        "electrical energy that all drives draw per drive period, one step of every leg: C dV^2 for every rise of a "
        "voltage by dV, less the share of the charge that is recovered; none where a capacitance is not given",
    )  # fmt: skip
    yield "electrical_energy", drawn
    gravity = scene.ground.gravity
    weight = 0.0 if gravity is None else walker.total_mass * gravity.acceleration
    stride = float(way.stride.mean()) if count else math.nan
    there = weight > 0.0 and abs(stride) > STANDSTILL
    cost = drawn.value / (weight * abs(stride)) if there else math.nan
    vary = float(way.stride.std(ddof=1)) / abs(stride) if there and count > 1 else math.nan
    yield "cost_of_transport", Measure(
        cost, "1", cost * vary, drawn.n if math.isfinite(cost) else 0,
        "electrical energy per drive period over the weight of the walker times the mean stride without its sign, its "
        f"spread that of the stride in proportion; none without gravity or where the stride is below "
        f"{STANDSTILL * 1e9:g} nm",
    )  # fmt: skip


def _whole_run(marks: np.ndarray | None) -> Iterator[tuple[str, Measure]]:
    """What the source plots of the body in a whole run from its start, transients included (Figs. 4.8-4.11)."""
    heave = surge = math.nan
    if marks is not None and len(marks):
        heave = float(marks["highest"].max())
        surge = float(np.abs(marks["body"][:, 0] - marks["body"][0, 0]).max())
    seen = int(math.isfinite(heave))
    yield (
        "max_heave",
        Measure(
            heave, "m", math.nan, seen, "largest heave of the body in the whole run, transients included"
        ),
    )
    yield "max_surge", Measure(
        surge, "m", math.nan, seen,
        "farthest that the body gets from its start in the whole run, without sign, seen at the ends of drive periods",
    )  # fmt: skip
