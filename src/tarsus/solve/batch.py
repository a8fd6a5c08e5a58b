"""Thousands of runs at once: any described float may vary."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.core.arrays import PERIOD_MARK
from tarsus.errors import InputError
from tarsus.measure import Measures, measures_of, no_measure, scene_period
from tarsus.plan import Plan, initial_column, law_column
from tarsus.scene import Scene
from tarsus.solve.codes import EventLog, ResultCode
from tarsus.solve.engine import Accuracy, RawRuns
from tarsus.solve.engines import Engine, Shared, engine_for
from tarsus.solve.march import RawWalks
from tarsus.solve.simulate import check_duration, simulate
from tarsus.solve.walkrun import structured_marks
from tarsus.spec import with_values
from tarsus.structure.walker import Walker
from tarsus.units import format_quantity

T = TypeVar("T")

_CHUNK = 256  # runs handed to the kernel at a time


@dataclass(frozen=True)
class BatchRun:
    """One run of a batch: its events and what measures need; of a walker also the marks of its way (see `WalkRun`).

    base: the batch's scene; values: those that this run has instead, by path; reached [s]: where it stopped early.
    """

    all_events: np.ndarray
    foot_names: tuple[str, ...]
    duration: float
    period: float
    code: ResultCode
    base: Scene
    values: Mapping[str, float] = field(default_factory=dict)
    marks: np.ndarray | None = None
    reached: float | None = None

    @cached_property
    def scene(self) -> Scene:
        """The scene of this run."""
        return with_values(self.base, self.values) if self.values else self.base

    @property
    def events(self) -> np.ndarray:
        """Events in time order, without the period marks."""
        return self.all_events[self.all_events["kind"] != PERIOD_MARK]

    @property
    def end_time(self) -> float:
        """Time reached [s]; the duration unless the run stopped early."""
        return self.duration if self.reached is None else self.reached

    @property
    def ok(self) -> bool:
        """True when the run reached its end (and its energy account closed, where the batch keeps accounts)."""
        return self.code is ResultCode.DONE


@dataclass(frozen=True)
class Batch:
    """Results of `simulate_batch`: nr runs in the order of the varied values.

    vary: the varied values (nr,) by path; periods (nr,) [s]: drive period of the statistics; unclosed: numbers of the
    runs whose energy account is open, None where the batch kept none.
    """

    scene: Scene
    vary: Mapping[str, np.ndarray]
    duration: float
    periods: NDArray[np.float64]
    _parts: Sequence[tuple[RawRuns | RawWalks, int]]
    unclosed: frozenset[int] | None = None

    def __len__(self) -> int:
        return len(self.periods)

    @property
    def codes(self) -> list[ResultCode]:
        """How every run ended.

        A batch keeps no steps and so no energy account: `ResultCode.DONE` says here that the end was reached, and
        `ResultCode.LEDGER_OPEN` occurs only with ``simulate_batch(..., ledger=True)``. One run's account is that of
        ``simulate(batch.run(i).scene, batch.duration)``.
        """
        return [self._code(i) for i in range(len(self))]

    def run(self, i: int) -> BatchRun:
        """Run number ``i``."""
        raw, k = self._parts[i]
        feet = tuple(self.scene.robot.feet)
        marks = None
        if isinstance(raw, RawWalks):
            walker = self.scene.robot.structure
            assert isinstance(walker, Walker)
            marks = structured_marks(raw.marks_of(k), walker.body_size, len(feet))
        values = {path: float(column[i]) for path, column in self.vary.items()}
        return BatchRun(
            self._log(raw).all_of(k), feet, self.duration, float(self.periods[i]), self._code(i), self.scene,
            values, marks, float(raw.finish[k, 0]),
        )  # fmt: skip

    @cached_property
    def _logs(self) -> dict[int, EventLog]:
        return {}

    def _log(self, raw: RawRuns | RawWalks) -> EventLog:
        """Events of the runs that were made together, in order; made once."""
        if id(raw) not in self._logs:
            self._logs[id(raw)] = EventLog(raw.events, raw.event_end)
        return self._logs[id(raw)]

    def _code(self, i: int) -> ResultCode:
        if self.unclosed is not None and i in self.unclosed:
            return ResultCode.LEDGER_OPEN
        raw, k = self._parts[i]
        return ResultCode.of(int(raw.codes[k]), makes_energy=self.scene.ground.makes_energy)

    def events(self, i: int) -> np.ndarray:
        """Events of run number ``i``; see `tarsus.solve.codes.EVENT_TYPE`."""
        raw, k = self._parts[i]
        return self._log(raw).of(k)

    def measures(self, i: int, **options: Any) -> Measures:
        """Measures of run number ``i``; options as for `tarsus.measure.measures_of`."""
        return measures_of(self.run(i), **options)

    def measure(self, name: str, **options: Any) -> NDArray[np.float64]:
        """One measure of every run (nr,), computed alone; NaN for runs that did not reach their end.

        Raises InputError for a name that no measure has, once a run that reached its end is asked.
        """
        values = np.full(len(self), np.nan)
        for i, code in enumerate(self.codes):
            if code is not ResultCode.DONE:
                continue
            found = self.measures(i, names=(name,), **options)
            if name not in found:
                raise InputError(no_measure(name, self.measures(i)))
            values[i] = found[name].value
        return values


def simulate_batch(
    scene: Scene,
    vary: Mapping[str, ArrayLike],
    duration: float | None = None,
    *,
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
        length. Runs that differ in parameters of ground laws and in initial state only share everything else.
    duration
        Model time of every run [s].
    threads
        Worker threads; all cores by default.
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
    values = _columns(vary)
    count = len(next(iter(values.values()))) if values else 1
    native = {path: law_column(scene, path) for path in values}
    own = [path for path, where in native.items() if where is not None]
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
    jobs: list[tuple[Engine, np.ndarray, np.ndarray, float, NDArray[np.int64]]] = []
    results: list[tuple[RawRuns | RawWalks, int] | None] = [None] * count

    def work(job: tuple[Engine, np.ndarray, np.ndarray, float, NDArray[np.int64]]) -> None:
        engine, parameters, initial, period, members = job
        raw = engine.run(parameters, initial, period, accuracy, track)
        for k, i in enumerate(members):
            results[i] = (raw, k)

    for chosen, several in groups.items():
        members = np.array(several)
        variant = with_values(scene, dict(zip(rest, chosen, strict=True))) if rest else scene
        engine = engine_for(variant, seconds, shared)
        plan = engine.plan
        period = scene_period(variant, seconds)
        periods[members] = period
        parameters = np.repeat(plan.laws.parameters[None], len(members), axis=0)
        for path in own:
            column = native[path]
            assert column is not None
            parameters[:, :, column] = values[path][members, None]
        initial = np.repeat(plan.initial[None], len(members), axis=0)
        for path, column in starts.items():
            initial[:, column] = values[path][members]
        if starts:
            _check_starts(scene, plan, initial)
        for first in range(0, len(members), _CHUNK):
            part = slice(first, first + _CHUNK)
            jobs.append((engine, parameters[part], initial[part], period, members[part]))
    if ledger:
        return _with_accounts(scene, values, seconds, periods, accuracy, threads)
    _spread(work, jobs, threads)
    return Batch(scene, values, seconds, periods, [r for r in results if r is not None])


def _spread(work: Callable[[T], None], jobs: Sequence[T], threads: int | None) -> None:
    """Do jobs on threads; the first alone, which compiles the engine once."""
    workers = threads or os.cpu_count() or 1
    if workers == 1 or len(jobs) == 1:
        for job in jobs:
            work(job)
        return
    work(jobs[0])
    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(work, jobs[1:]))


def _with_accounts(
    scene: Scene,
    values: Mapping[str, np.ndarray],
    seconds: float,
    periods: NDArray[np.float64],
    accuracy: Accuracy | None,
    threads: int | None,
) -> Batch:
    """The batch made of single runs, each with its energy account."""
    parts: dict[int, tuple[RawRuns | RawWalks, int]] = {}
    unclosed: set[int] = set()

    def work(i: int) -> None:
        run = simulate(
            with_values(scene, {path: float(v[i]) for path, v in values.items()}), seconds, accuracy
        )
        if run.code is ResultCode.LEDGER_OPEN:
            unclosed.add(i)
        raw = run.raw
        parts[i] = (raw if isinstance(raw, RawWalks) else replace(raw, trace=raw.trace[:0].copy()), 0)

    _spread(work, range(len(periods)), threads)
    return Batch(
        scene, values, seconds, periods, [parts[i] for i in range(len(periods))], frozenset(unclosed)
    )


def _columns(vary: Mapping[str, ArrayLike]) -> dict[str, np.ndarray]:
    values = {path: np.atleast_1d(np.asarray(v, dtype=float)) for path, v in vary.items()}
    problems = []
    for path, v in values.items():
        if v.ndim != 1:
            problems.append(f"{path}: expected a list of numbers, got an array of {v.ndim} dimensions")
        if not np.isfinite(v).all():
            problems.append(f"{path}: every value must be a finite number")
    lengths = {len(v) for v in values.values()}
    if len(lengths) > 1:
        shown = ", ".join(f"{path} has {len(v)}" for path, v in values.items())
        problems.append(f"varied values must be of one length: {shown}")
    if lengths == {0}:
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
