"""Thousands of runs at once: any described float may vary."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.base.workers import spread
from tarsus.model.scene import Scene
from tarsus.plan.slots import check_bounds, slot
from tarsus.solve.codes import ResultCode
from tarsus.solve.engine import Accuracy
from tarsus.solve.engines import Shared, prepared
from tarsus.solve.gradients import GradientBatch, GradientRun, gradient_run
from tarsus.solve.results import Batch, Part
from tarsus.solve.simulate import changed_run, scene_of, seconds_of

__all__ = ["Batch", "simulate_batch"]

_CHUNK = 256  # runs handed to the kernel at a time


def simulate_batch(
    scene: Scene | str | PathLike[str],
    vary: Mapping[str, ArrayLike],
    duration: float | str | None = None,
    *,
    grid: bool = False,
    threads: int | None = None,
    accuracy: Accuracy | None = None,
    track: bool = True,
    shared: Shared | None = None,
    ledger: bool = False,
    gradients: Sequence[str] | None = None,
) -> Batch:
    """Simulate a scene for many values of any of its floats.

    Parameters
    ----------
    scene
        The scene, or the name of a device, or a scene file; values that do not vary are its own.
    vary
        Values (nr,) by path, e.g. ``{"ground.film.coefficient": [...], "signals.pzt.amplitude": [...]}``; all of one
        length, run i having the values number i. Runs that differ in slots only (`tarsus.plan.slots`: laws,
        gaps, gravity, initial state, drives over time) share one plan and its tables; every other value makes a plan,
        and as a rule tables, of its own.
    duration
        Model time of every run [s], or ``"50 ms"``.
    grid
        Make a run for every combination instead: the values of each path are an axis of any length, and results have
        the shape of the grid, axes in the order of the paths.
    threads
        Worker threads; by default one for each processor that this process may use.
    accuracy
        Tolerances of the engine.
    track
        Find the highest gap of every flight and the mean height (needed for telling bounces from chatter, too).
    shared
        What the engine makes for a structure, kept from one batch to the next where both are given the same one.
    ledger
        Make every run as `simulate` does, at its accuracy unless another is given and with its energy account, so that
        no run whose account is open counts as done. That takes several times as long.
    gradients
        Paths of numbers of the scene: every run is made as `simulate` makes it with them, and the batch is a
        `GradientBatch`, which has exact first derivatives of every run.

    Raises
    ------
    InputError
        For unknown paths, values out of bounds, or arrays of different lengths.
    """
    scene = scene_of(scene)
    seconds = seconds_of(scene, duration)
    given = _columns(vary, grid=grid)
    values = _combined(given) if grid else given
    axes = given if grid else {}
    count = len(next(iter(values.values()))) if values else 1
    data, rest = _divided(scene, values)
    groups: dict[tuple[float, ...], list[int]] = {}
    for i, chosen in enumerate(
        zip(*(values[path].tolist() for path in rest), strict=True) if rest else [()] * count
    ):
        groups.setdefault(chosen, []).append(i)
    shared = Shared() if shared is None else shared
    periods = np.zeros(count)
    if gradients is not None:
        return _with_gradients(
            scene, values, axes, seconds, periods, accuracy, threads, shared, tuple(gradients)
        )
    if ledger:
        return _with_accounts(scene, values, axes, seconds, periods, accuracy, threads, shared)

    def work(job: tuple[tuple[float, ...], NDArray[np.int64]]) -> Part:
        chosen, members = job
        variant = with_values(scene, dict(zip(rest, chosen, strict=True))) if rest else scene
        own = {path: values[path][members] for path in data}
        engine, rows = prepared(variant, own, seconds, shared, len(members))
        periods[members] = rows.periods
        return Part.of(engine.run(rows, accuracy, track), members)

    jobs = [
        (chosen, np.array(members[first : first + _CHUNK]))
        for chosen, members in groups.items()
        for first in range(0, len(members), _CHUNK)
    ]
    parts = list(spread(work, jobs, threads))
    return Batch(scene, values, seconds, periods, parts, None, axes, accuracy or Accuracy(), track)


def _divided(scene: Scene, values: Mapping[str, np.ndarray]) -> tuple[list[str], list[str]]:
    """Paths that are data of a plan, within their bounds, and those that make a plan of their own."""
    places = {path: slot(scene, path) for path in values}
    for path, place in places.items():
        if place is not None and place.bounded:
            check_bounds(scene, path, values[path])
    return [path for path, p in places.items() if p is not None], [
        path for path, p in places.items() if p is None
    ]


def _with_accounts(
    scene: Scene,
    values: Mapping[str, np.ndarray],
    axes: Mapping[str, np.ndarray],
    seconds: float,
    periods: NDArray[np.float64],
    accuracy: Accuracy | None,
    threads: int | None,
    shared: Shared,
) -> Batch:
    """The batch made of single runs, each with its energy account."""

    def work(i: int) -> tuple[Part, bool]:
        run = changed_run(scene, {path: float(v[i]) for path, v in values.items()}, seconds, accuracy, shared)
        periods[i] = run.period
        return Part.of(run.log, np.array([i])), run.code is ResultCode.LEDGER_OPEN

    found = list(spread(work, range(len(periods)), threads))
    unclosed = frozenset(i for i, (_, open_) in enumerate(found) if open_)
    return Batch(scene, values, seconds, periods, [part for part, _ in found], unclosed, axes, accuracy)


def _with_gradients(
    scene: Scene,
    values: Mapping[str, np.ndarray],
    axes: Mapping[str, np.ndarray],
    seconds: float,
    periods: NDArray[np.float64],
    accuracy: Accuracy | None,
    threads: int | None,
    shared: Shared,
    paths: tuple[str, ...],
) -> GradientBatch:
    """The batch made of single runs, each with its derivatives."""

    def work(i: int) -> GradientRun:
        variant = with_values(scene, {path: float(v[i]) for path, v in values.items()})
        run = gradient_run(variant, paths, seconds, accuracy, shared)
        periods[i] = run.period
        return run

    made = tuple(spread(work, range(len(periods)), threads))
    parts = [Part.of(run.log, np.array([i])) for i, run in enumerate(made)]
    return GradientBatch(scene, values, seconds, periods, parts, None, axes, accuracy, made=made)


def _combined(axes: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Values (nr,) of every combination, the last axis running fastest."""
    mesh = np.meshgrid(*axes.values(), indexing="ij")
    return {path: one.ravel() for path, one in zip(axes, mesh, strict=True)}


def _columns(vary: Mapping[str, ArrayLike], *, grid: bool) -> dict[str, np.ndarray]:
    values = {path: np.atleast_1d(np.asarray(v, dtype=float)) for path, v in vary.items()}
    problems = []
    for path, v in values.items():
        if v.ndim != 1:
            problems.append(f"{path}: expected a list of numbers, got an array of {v.ndim} dimensions")
        if not np.isfinite(v).all():
            problems.append(f"{path}: every value must be a finite number")
    lengths = {len(v) for v in values.values()}
    if len(lengths) > 1 and not grid:
        shown = ", ".join(f"{path} has {len(v)}" for path, v in values.items())
        problems.append(f"varied values must be of one length: {shown} (grid=True runs every combination)")
    if 0 in lengths and (grid or lengths == {0}):
        problems.append("varied values: expected at least one run, got none")
    if problems:
        raise InputError(problems)
    return values
