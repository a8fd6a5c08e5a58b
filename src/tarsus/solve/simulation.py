"""Simulation of one scene, and of thousands at once of which any described float varies."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.base.errors import InputError
from tarsus.base.spec import by_path, get_value, number_at, one_number, paths_of, with_values
from tarsus.base.units import parse_quantity
from tarsus.base.verb import verb
from tarsus.base.workers import Workers, is_executor, places, spread, workers
from tarsus.files.library import SceneLike, as_scene
from tarsus.model.scene import seconds_of
from tarsus.plan.slots import check_bounds, courses_of_all, slot
from tarsus.solve.codes import ResultCode
from tarsus.solve.engine import Accuracy
from tarsus.solve.results import Batch, Part
from tarsus.solve.run import Run, changed_run, increasing, prepared
from tarsus.solve.shared import Shared

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from tarsus.model.scene import Scene
    from tarsus.solve.gradients import Gradient, GradientRun

_CHUNK, _FEWEST = 256, 16
"""Runs handed to the kernel at a time: at most, and at least where there are several threads."""

_TOGETHER = 1024
"""Runs of a batch up to which what drives do is made once for all of its plans: of more it would fill the memory."""


MOST_STEPS = 1e8
"""Longest run that is started: about an hour of computing and more samples than anyone reads."""

STEPS_PER_CYCLE = 20.0
"""Steps a cycle of the fastest motion, a round number: the estimate is only there to refuse the absurd."""


@overload
def simulate(
    scene: SceneLike,
    duration: float | str | None = None,
    accuracy: Accuracy | None = None,
    *,
    shared: Shared | None = None,
    gradients: None = None,
    **values: Any,
) -> Run: ...
@overload
def simulate(
    scene: SceneLike,
    duration: float | str | None = None,
    accuracy: Accuracy | None = None,
    *,
    shared: Shared | None = None,
    gradients: Sequence[str] | Mapping[str, Mapping[str, float]],
    **values: Any,
) -> GradientRun: ...
def simulate(
    scene: SceneLike,
    duration: float | str | None = None,
    accuracy: Accuracy | None = None,
    *,
    shared: Shared | None = None,
    gradients: Sequence[str] | Mapping[str, Mapping[str, float]] | None = None,
    **values: Any,
) -> Run:
    """Simulate a scene exactly from event to event: a walker by the walking engine, everything else by contact modes.

    Parameters
    ----------
    scene
        What to simulate, or a device's name or a scene file's path; a user's laws are part of its ground
        (``ground.laws``).
    duration
        How long [s], or a text with a unit (``"50 ms"``); the scene's own duration by default.
    accuracy
        Tolerances and the bound on steps; by default `SINGLE_RUN`.
    shared
        What the engine makes for a structure, kept from one run to the next where both are given the same one; see
        `tarsus.Session`.
    gradients
        Paths of numbers of the scene: the run is a `GradientRun` then, which has first derivatives by them, each
        with its error. Or
        directions by name: how much each of some numbers moves, by path, where several follow from one.
    **values
        What is changed in the scene before, as `load_scene` takes it: ``volts=6, hz=100``, or values by path.

    Returns
    -------
    Run
        Events, measures, ledger, states at any time [SI], and how it ended (`Run.code`); a `GradientRun` with
        ``gradients``.

    Raises
    ------
    InputError
        For an unknown device, a duration that is not positive, a user's law that cannot be compiled, and paths by
        which there is no derivative.

    The run always ends, with a `ResultCode` that is a sentence.

    Examples
    --------
    >>> import tarsus as ts
    >>> run = ts.simulate("cantilever", "100 ms", volts=8, hz=50, wave="square")
    >>> run.ok, run.ledger.closure < 1e-8
    (True, True)
    >>> peak = run.measures["peak"]
    >>> 1e-4 < peak.value < 3e-4, peak.unit
    (True, 'm')
    >>> run.states([0.0, 0.05]).gap.shape  # feet, times
    (1, 2)
    """
    scene = as_scene(scene, **values)
    seconds = seconds_of(scene, duration)
    if gradients is not None:
        from tarsus.solve.gradients import gradient_run

        return gradient_run(scene, gradients, seconds, accuracy, shared or Shared())
    return changed_run(scene, {}, seconds, accuracy, shared)


NumberOf = Callable[..., float]
"""A function of the events with the period marks, or of these and of states at given times (`SampledStates`)."""


def gradient(
    objective: str | NumberOf,
    scene: SceneLike,
    wrt: Sequence[str],
    duration: float | str | None = None,
    accuracy: Accuracy | None = None,
    *,
    times: ArrayLike | None = None,
) -> Gradient:
    """First derivatives of one number of a run by numbers of its scene, each with its error.

    Parameters
    ----------
    objective
        Name of a measure or of a term of the ledger, as `GradientRun.gradient` takes it, or a function of the events
        (ne,) with the period marks, smooth in their numbers.
    scene
        The scene, or a device's name or a scene file's path.
    wrt
        Paths of its numbers.
    duration, accuracy
        As for `simulate`.
    times
        Times [s] (nt,), increasing: the function is one of the events and of the states then (`SampledStates`).

    Returns
    -------
    Gradient
        The derivative by each path [unit of the number over that of the path], with its error, and flags where there
        is none.

    Raises
    ------
    InputError
        As `simulate` and `GradientRun.gradient` do.
    """
    run = simulate(scene, duration, accuracy, gradients=wrt)
    if isinstance(objective, str):
        return run.gradient(objective)
    if times is None:
        return run.gradient_of(objective)
    when = increasing(times)
    return run.gradient_of_runs(lambda one: objective(one.all_events, one.states(when)))


def too_long(scene: Scene, seconds: float) -> str | None:
    """What is said of runs of so many seconds that are refused, for they take more than `MOST_STEPS`; None of
    others."""
    steps = estimated_steps(scene, seconds)
    if steps <= MOST_STEPS:
        return None
    return (
        f"a run would take about {steps:.1e} steps, and at most {MOST_STEPS:.0e} are allowed; "
        f"the longest run is about {seconds * MOST_STEPS / steps:.2g} s"
    )


def estimated_steps(scene: Scene, duration: float) -> float:
    """Rough number of engine steps for `duration` [s]: 20 a cycle of the fastest mode or drive."""
    matrices = scene.robot.structure.matrices()
    squares = np.linalg.eigvals(np.linalg.solve(matrices.mass, matrices.stiffness)).real
    fastest = math.sqrt(max(float(np.max(squares, initial=0.0)), 0.0)) / (2.0 * math.pi)
    drives = [float(getattr(signal, "frequency", 0.0)) for signal in scene.waves.values()]
    return duration * max([fastest, *drives, 1.0]) * STEPS_PER_CYCLE


def _moves_drive(path: str) -> bool:
    """Whether what a drive does depends on a number that makes a plan of its own: its load on a structure does not."""
    return path.startswith(("gait.", "signals.", "robot.drives.")) and ".load." not in path


@verb
def simulate_batch(
    scene: SceneLike,
    vary: Mapping[str, ArrayLike] | None = None,
    duration: float | str | None = None,
    *,
    grid: bool = False,
    threads: Workers = None,
    accuracy: Accuracy | None = None,
    track: bool = True,
    shared: Shared | None = None,
    ledger: bool = False,
    gradients: Sequence[str] | None = None,
    **values: Any,
) -> Batch:
    """Simulate a scene for many values of any of its floats.

    Parameters
    ----------
    scene
        The scene, or a device's name or a scene file's path; values that do not vary are its own.
    vary
        Values (nr,) by path or short word, e.g. ``{"ground.film.coefficient": [...], "volts": ["6 V", "8 V"]}``, SI or
        texts with a unit; all of one length, run i having the values number i. Runs that differ in slots only
        (`tarsus.plan.slots`: laws, gaps, gravity, initial state, drives over time) share one plan and its tables;
        every other value makes a plan, and as a rule tables, of its own.
    duration
        Model time of every run [s], or a text with a unit.
    grid
        Make a run for every combination instead: the values of each path are an axis of any length, and results have
        the shape of the grid, axes in the order of the paths.
    threads
        Worker threads; by default one for each processor that this process may use. Or an executor of
        ``concurrent.futures``, whose processes, here or on other machines, make a share of the runs each.
    accuracy
        Tolerances of the engine.
    track
        Find the highest gap of every flight and the mean height (needed to separate bounces from chatter, too).
    shared
        What the engine makes for a structure, kept from one batch to the next where both are given the same one.
    ledger
        Make every run as `simulate` does, at its accuracy unless another is given and with its energy account, so that
        no run whose account is open counts as done. That takes several times as long.
    gradients
        Paths of numbers of the scene: every run is made as `simulate` makes it with them, and the batch is a
        `GradientBatch`, which has first derivatives of every run.
    **values
        What is changed in the scene of all runs before, as `load_scene` takes it: ``wave="sine"``, or values by path.

    Returns
    -------
    Batch
        Measures of all runs as arrays (nr,), or of the shape of the grid [SI]; ``run(i)`` makes one of them again with
        its motion. A `GradientBatch` with ``gradients``.

    Raises
    ------
    InputError
        For unknown paths, values out of bounds, or arrays of different lengths.

    Examples
    --------
    >>> import tarsus as ts
    >>> vary = {"ground.film.coefficient": [0.5e-21, 2e-21], "robot.feet.tip.gap": ["60 um", "70 um", "80 um"]}
    >>> batch = ts.simulate_batch("cantilever", vary, "40 ms", grid=True)
    >>> batch.measure("impacts").shape
    (2, 3)
    >>> bool(batch.done.all())
    True
    """
    if vary is None:
        word = next(iter(values), "volts")
        raise InputError(f"vary: missing; expected values by path, as ts.simulate_batch(scene, {{'{word}': [...]}})")
    scene = as_scene(scene, **values)
    seconds = seconds_of(scene, duration)
    given = columns(scene, vary, grid=grid)
    values = by_path(scene, _combined(given) if grid else given)
    axes = {paths_of(scene, name)[0]: of for name, of in given.items()} if grid else {}
    asked = _BatchAsked(scene, values, axes, seconds, accuracy, track, Shared() if shared is None else shared)
    if ledger or gradients is not None:
        local = None if is_executor(threads) else threads  # runs with accounts or derivatives do not travel
        return asked.run_by_run(local, None if gradients is None else tuple(gradients))
    if is_executor(threads):
        return asked.elsewhere(threads) if len(asked) > 1 else asked.on_threads(None)
    return asked.on_threads(threads)


@dataclass(frozen=True)
class _BatchAsked:
    """Runs that are asked for together: of a scene with values (nr,) by path, of a grid also those of each axis, how
    long [s], how exactly, and what engines share."""

    scene: Scene
    values: Mapping[str, np.ndarray]
    axes: Mapping[str, np.ndarray]
    seconds: float
    accuracy: Accuracy | None
    track: bool
    shared: Shared

    def __len__(self) -> int:
        return len(next(iter(self.values.values()))) if self.values else 1

    def _batch(self, periods: NDArray[np.float64], parts: Sequence[Part]) -> Batch:
        """What has come of them."""
        accuracy = self.accuracy or Accuracy()
        return Batch(self.scene, self.values, self.seconds, periods, parts, None, self.axes, accuracy, self.track)

    def on_threads(self, threads: Workers) -> Batch:
        """Those that differ in data of a plan together, some at a time. Raises InputError as `simulate_batch`."""
        scene, values, seconds, count = self.scene, self.values, self.seconds, len(self)
        data, rest = _divided(scene, values)
        each = zip(*(values[path].tolist() for path in rest), strict=True) if rest else [()] * count
        groups: dict[tuple[float, ...], list[int]] = {}
        for i, chosen in enumerate(each):
            groups.setdefault(chosen, []).append(i)
        periods = np.zeros(count)
        once = len(groups) > 1 and count <= _TOGETHER and not any(map(_moves_drive, rest))
        courses = courses_of_all(scene, {path: values[path] for path in data}) if once else None
        again = scene is self.shared.resident  # and its variants with it: searches run the same ones many times

        def work(job: tuple[tuple[float, ...], NDArray[np.int64]]) -> Part:
            chosen, members = job
            changes = tuple(zip(rest, chosen, strict=True))
            variant = self.shared.variant(scene, changes) if again else with_values(scene, dict(changes))
            own = {path: values[path][members] for path in data}
            known = None if courses is None else courses(members)
            engine, rows = prepared(variant, own, seconds, self.shared, len(members), known, changes if again else ())
            periods[members] = rows.periods
            return Part.of(engine.run(rows, self.accuracy, self.track), members)

        size = min(_CHUNK, max(_FEWEST, -(-count // workers(threads))))
        jobs = [
            (chosen, np.array(members[first : first + size]))
            for chosen, members in groups.items()
            for first in range(0, len(members), size)
        ]
        return self._batch(periods, list(spread(work, jobs, threads)))

    def elsewhere(self, executor: Executor) -> Batch:
        """In shares, one after the other for each worker of an executor."""
        count = len(self)
        shares = np.array_split(np.arange(count), min(places(executor) * _SHARES, count))
        own = [{path: of[members] for path, of in self.values.items()} for members in shares]
        jobs = [replace(self, values=values, axes={}) for values in own]
        found = list(spread(_alone, jobs, executor))
        parts = [
            Part(members[part.members], part.log)
            for members, (_, made) in zip(shares, found, strict=True)
            for part in made
        ]
        return self._batch(np.concatenate([periods for periods, _ in found]), parts)

    def run_by_run(self, threads: Workers, paths: tuple[str, ...] | None) -> Batch:
        """Single runs, each with its energy account, or with its derivatives by the numbers at paths."""

        def work(i: int) -> tuple[Part, float, bool, GradientRun | None]:
            own, one = {path: float(v[i]) for path, v in self.values.items()}, np.array([i])
            if paths is None:
                run = changed_run(self.scene, own, self.seconds, self.accuracy, self.shared)
                return Part.of(run.log, one), run.period, run.code is ResultCode.LEDGER_OPEN, None
            from tarsus.solve.gradients import gradient_run

            made = gradient_run(with_values(self.scene, own), paths, self.seconds, self.accuracy, self.shared)
            return Part.of(made.log, one), made.period, False, made

        parts, periods, opened, made = zip(*spread(work, range(len(self)), threads), strict=True)
        common = (self.scene, self.values, self.seconds, np.array(periods), parts)
        if paths is None:
            return Batch(*common, frozenset(np.flatnonzero(opened).tolist()), self.axes, self.accuracy)
        from tarsus.solve.gradients import GradientBatch

        return GradientBatch(*common, None, self.axes, self.accuracy, made=made)


def _alone(asked: _BatchAsked) -> tuple[NDArray[np.float64], Sequence[Part]]:
    """Some runs of a batch on one thread: their periods, and what the engine noted."""
    batch = asked.on_threads(1)
    return batch.periods, batch.parts


_SHARES = 2
"""Shares of a batch for each worker: a slow one then delays the others by half a share at most."""


def _divided(scene: Scene, values: Mapping[str, np.ndarray]) -> tuple[list[str], list[str]]:
    """Paths that are data of a plan, within their bounds, and those that make a plan of their own."""
    places = {path: slot(scene, path) for path in values}
    for path, place in places.items():
        if place is not None and place.bounded:
            check_bounds(scene, path, values[path])
    return [path for path, p in places.items() if p is not None], [path for path, p in places.items() if p is None]


def _combined(axes: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Values (nr,) of every combination, the last axis running fastest."""
    mesh = np.meshgrid(*axes.values(), indexing="ij")
    return {path: one.ravel() for path, one in zip(axes, mesh, strict=True)}


def columns(scene: Scene, vary: Mapping[str, ArrayLike], *, grid: bool) -> dict[str, np.ndarray]:
    """Varied values [SI] by path or short word, as given, checked.

    Raises InputError for those that do not fit each other or the scene.
    """
    problems: list[str] = []
    values = {path: np.atleast_1d(_in_si(scene, path, v, problems)) for path, v in vary.items()}
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


def _in_si(scene: Scene, name: str, given: ArrayLike, problems: list[str]) -> np.ndarray:
    """Numbers as they are; texts with units in the unit of the number at the path."""
    values = np.asarray(given)
    try:
        path = paths_of(scene, name)[0]
        if values.dtype.kind not in "UO":
            return values.astype(float)
        unit = number_at(scene, path if get_value(scene, path) is None else one_number(scene, path)).unit
        return np.array([parse_quantity(one, unit) for one in values.ravel().tolist()]).reshape(values.shape)
    except InputError as error:
        said = error.problems
        problems += [one if one.startswith(f"{name}: ") else f"{name}: {one}" for one in said]
        return np.zeros(max(values.size, 1))
