"""Thousands of runs at once: any described float may vary."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.errors import InputError
from tarsus.measure import scene_period
from tarsus.plan import Plan, initial_column, law_column
from tarsus.scene import Scene
from tarsus.solve.codes import ResultCode
from tarsus.solve.engine import Accuracy
from tarsus.solve.engines import Engine, Shared, engine_for
from tarsus.solve.results import Batch, BatchRun, Part
from tarsus.solve.simulate import check_duration, simulate
from tarsus.spec import with_values
from tarsus.units import format_quantity
from tarsus.workers import spread

__all__ = ["Batch", "BatchRun", "simulate_batch"]

_CHUNK = 256  # runs handed to the kernel at a time


def simulate_batch(
    scene: Scene,
    vary: Mapping[str, ArrayLike],
    duration: float | None = None,
    *,
    grid: bool = False,
    threads: int | None = None,
    accuracy: Accuracy | None = None,
    track: bool = True,
    shared: Shared | None = None,
    ledger: bool = False,
) -> Batch:
    """Simulate a scene for many values of any of its floats.

    Parameters
    ----------
    scene
        The scene; values that do not vary are its own.
    vary
        Values (nr,) by path, e.g. ``{"ground.film.coefficient": [...], "signals.pzt.amplitude": [...]}``; all of one
        length, run i having the values number i. Runs that differ in parameters of ground laws and in initial state
        only share everything else.
    duration
        Model time of every run [s].
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

    Raises
    ------
    InputError
        For unknown paths, values out of bounds, or arrays of different lengths.
    """
    seconds = scene.duration if duration is None else float(duration)
    check_duration(seconds)
    given = _columns(vary, grid=grid)
    values = _combined(given) if grid else given
    axes = given if grid else {}
    count = len(next(iter(values.values()))) if values else 1
    native = {path: law_column(scene, path) for path in values}
    own = {path: where for path, where in native.items() if where is not None}
    starts = {path: initial_column(scene, path) for path in values if path not in own}
    starts = {path: column for path, column in starts.items() if column is not None}
    rest = [path for path in values if path not in own and path not in starts]
    if own:  # bounds are intervals: both ends suffice
        lowest = {path: float(values[path].min()) for path in own}
        highest = {path: float(values[path].max()) for path in own}
        for ends in (lowest, highest) if lowest != highest else (lowest,):
            with_values(scene, ends)
    groups: dict[tuple[float, ...], list[int]] = {}
    for i in range(count):
        groups.setdefault(tuple(values[path][i] for path in rest), []).append(i)
    shared = shared or Shared()
    periods = np.zeros(count)
    jobs: list[_Job] = []
    for chosen, several in groups.items():
        members = np.array(several)
        variant = with_values(scene, dict(zip(rest, chosen, strict=True))) if rest else scene
        engine = engine_for(variant, seconds, shared)
        periods[members] = scene_period(variant, seconds)
        parameters = _filled(engine.plan.laws.parameters, values, own, members)
        initial = _filled(engine.plan.initial, values, starts, members)
        if starts:
            _check_starts(scene, engine.plan, initial)
        for first in range(0, len(members), _CHUNK):
            part = slice(first, first + _CHUNK)
            jobs.append(
                _Job(engine, parameters[part], initial[part], float(periods[members[0]]), members[part])
            )
    if ledger:
        return _with_accounts(scene, values, axes, seconds, periods, accuracy, threads)
    parts = spread(lambda job: job.run(accuracy, track), jobs, threads)
    return Batch(scene, values, seconds, periods, list(parts), None, axes)


@dataclass(frozen=True)
class _Job:
    """Runs of one plan and drive period [s] with their law parameters (k, m, np) and starts (k, 2n)."""

    engine: Engine
    parameters: np.ndarray
    initial: np.ndarray
    period: float
    members: NDArray[np.int64]

    def run(self, accuracy: Accuracy | None, track: bool) -> Part:
        raw = self.engine.run(self.parameters, self.initial, self.period, accuracy, track)
        return Part.of(raw, self.members)


def _filled(
    base: np.ndarray, values: Mapping[str, np.ndarray], columns: Mapping[str, int], members: NDArray[np.int64]
) -> np.ndarray:
    """A row of numbers (..., nc) for each run, with its own values in these columns."""
    out = np.repeat(base[None], len(members), axis=0)
    for path, column in columns.items():
        own = values[path][members]
        out[..., column] = own.reshape(-1, *[1] * (out.ndim - 2))
    return out


def _with_accounts(
    scene: Scene,
    values: Mapping[str, np.ndarray],
    axes: Mapping[str, np.ndarray],
    seconds: float,
    periods: NDArray[np.float64],
    accuracy: Accuracy | None,
    threads: int | None,
) -> Batch:
    """The batch made of single runs, each with its energy account."""

    def work(i: int) -> tuple[Part, bool]:
        run = simulate(
            with_values(scene, {path: float(v[i]) for path, v in values.items()}), seconds, accuracy
        )
        open_ = run.code is ResultCode.LEDGER_OPEN
        return Part.of(run.raw, np.array([i])), open_

    found = list(spread(work, range(len(periods)), threads))
    unclosed = frozenset(i for i, (_, open_) in enumerate(found) if open_)
    return Batch(scene, values, seconds, periods, [part for part, _ in found], unclosed, axes)


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


def _check_starts(scene: Scene, plan: Plan, initial: np.ndarray) -> None:
    """No run starts with a foot below the ground."""
    rest = plan.system.rest_gap
    moved = initial[:, : len(plan.system.mass)] @ plan.system.normals
    below = rest + moved < -1e-12 * np.maximum(rest, np.abs(moved))
    for run, foot in np.argwhere(below)[:1]:
        name = list(scene.robot.feet)[foot]
        depth = format_quantity(-float(rest[foot] + moved[run, foot]), "m")
        raise InputError(
            f"initial.displacement: in run {run} foot '{name}' would start {depth} below the ground"
        )
