"""Runs a sweep, unit by unit, into a store that survives being killed: on all cores, or on an executor's workers."""

from __future__ import annotations

import contextlib
import os
import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.workers import Workers, is_executor, workers
from tarsus.files.runstore import RunStore
from tarsus.solve.codes import ResultCode
from tarsus.solve.simulate import Shared
from tarsus.study.collecting import collect
from tarsus.study.layout import UnitPlan, open_store, runs_per_unit
from tarsus.study.pool import Arrays, Remote, Threads, WorkerPool
from tarsus.study.progress import OnProgress, Progress
from tarsus.study.sweep import Sweep
from tarsus.study.workunit import OUTCOMES, work_unit
from tarsus.tables.table import Table

__all__ = ["SweepResult", "do_units", "run_sweep", "score_runs"]

TRIES = 5
"""Times that a unit is handed out whose workers die: a unit that kills its worker must not go round for ever."""

LATE = 5.0
"""A unit that takes this many times the median is handed out once more when nothing else is waiting: its node may be
gone or slow, and to do a unit twice is harmless."""

KEPT = "finished parts are kept, continue with --resume"

LOOK = 1.0
"""Seconds between two looks for late units."""


@dataclass(frozen=True)
class SweepResult:
    """A finished sweep.

    file: the collected NetCDF; runs: how many; kept: how many of them an earlier call had done; outcomes: how many runs
    ended how, by name in `OUTCOMES`, those that occurred; units: units of work; workers: runs of this call by who made
    them: node, or node and process; name, seconds: of the sweep, and the time [s] of every run.
    """

    file: Path
    runs: int
    kept: int
    outcomes: Mapping[str, int]
    units: int = 0
    workers: Mapping[str, int] = field(default_factory=dict)
    name: str = ""
    seconds: float = 0.0

    @property
    def failed(self) -> int:
        """Runs that did not reach their end."""
        return self.runs - self.outcomes.get(ResultCode.DONE.name, 0)

    def __str__(self) -> str:
        return self.table().text()

    def _repr_html_(self) -> str:
        return self.table().html()

    def table(self) -> Table:
        """How the runs ended."""
        earlier = f", {self.kept} of them done before" if self.kept else ""
        title = f"{self.name}: {self.runs} runs of {self.seconds:g} s{earlier}"
        return Table(title, ["runs", "outcome"], [(n, OUTCOMES[name]) for name, n in self.outcomes.items()])


def run_sweep(
    sweep: Sweep,
    folder: str | os.PathLike[str],
    *,
    resume: bool = False,
    threads: Workers = None,
    progress: OnProgress | None = None,
) -> SweepResult:
    """Run a sweep into a folder; what is finished is kept whenever the process ends, and never run again.

    Parameters
    ----------
    sweep
        What to run.
    folder
        Where; without a sweep in it unless `resume`.
    resume
        Continue the sweep that the folder holds.
    threads
        Worker threads; by default one for each processor that this process may use. Or who does the units instead: any
        executor of `concurrent.futures`, its processes here or on other machines. It is left open.
    progress
        Called as ``progress(runs done, runs, runs of this call by worker)`` after each unit.

    Raises
    ------
    InputError
        If the folder holds a sweep that is not to be continued, or another one; when its disk is full or gone; when a
        worker has another version. What was finished is kept.
    KeyboardInterrupt
        When interrupted, after the units under way are kept.
    """
    store, layout = open_store(sweep, Path(folder), resume=resume)
    pending = store.pending()
    kept = sweep.runs - sum(map(layout.size, pending))
    made: Counter[str] = Counter()
    for last in (False, True):
        if pending:
            with Progress(store.place, runs=sweep.runs, told=progress) as counted:
                pool: WorkerPool = (
                    Remote(sweep, layout, store, threads)
                    if is_executor(threads)
                    else Threads(sweep, layout, store, workers(threads))
                )
                do_units(store, layout, pool, pending, counted)
            made += counted.runs
        try:
            file, outcomes = collect(sweep, store)
            break
        except InputError:
            store.check()
            pending = store.pending()
            if last or not pending:
                raise
    return SweepResult(file, sweep.runs, kept, outcomes, layout.units, dict(made), sweep.name, sweep.seconds)


def do_units(
    store: RunStore,
    layout: UnitPlan,
    pool: WorkerPool,
    units: Iterable[int],
    progress: Progress,
) -> None:
    """Have units done and kept, however often workers die; those that appear in the store meanwhile are left out.

    Raises
    ------
    InputError
        As `run_sweep`; when a unit's workers died `TRIES` times.
    """
    work = _Work(store, layout, pool, deque(units), progress)
    try:
        work.run()
    except BaseException:
        pool.close(wait=True)
        work.keep_finished()
        raise
    pool.close(wait=False)


@dataclass
class _Work:
    """Units that wait, and those under way by their futures."""

    store: RunStore
    layout: UnitPlan
    pool: WorkerPool
    waiting: deque[int]
    progress: Progress
    under_way: dict[Future[tuple[str, Arrays | None]], tuple[int, float]] = field(default_factory=dict)
    missing: set[int] = field(default_factory=set)
    tries: dict[int, int] = field(default_factory=dict)
    seconds: deque[float] = field(default_factory=lambda: deque(maxlen=200))

    def run(self) -> None:
        self.missing = set(self.waiting)
        self.progress.expect(sum(map(self.layout.size, self.missing)))
        while self.missing:
            self._hand_out()
            ready, _ = wait(self.under_way, timeout=LOOK, return_when=FIRST_COMPLETED)
            for future in ready:
                self._take(future)
            if not ready and not self.waiting and self.pool.elsewhere:
                self._again()

    def _hand_out(self) -> None:
        wanted = self.pool.wanted()
        while self.waiting and len(self.under_way) < wanted:
            unit = self.waiting.popleft()
            if unit not in self.missing:
                continue
            if self.store.has(unit):  # another process was here
                self._done(unit, None)
                continue
            try:
                future = self.pool.submit(unit)
            except RuntimeError as error:
                raise InputError(f"no worker takes units any more ({error}); {KEPT}") from error
            self.under_way[future] = unit, time.monotonic()

    def _take(self, future: Future[tuple[str, Arrays | None]]) -> None:
        unit, begin = self.under_way.pop(future)
        if unit not in self.missing:
            return
        try:
            who, arrays = future.result()
        except InputError:
            raise
        except Exception as error:
            if not self.pool.elsewhere:
                raise
            # a worker died, or was taken away
            self.tries[unit] = self.tries.get(unit, 0) + 1
            if self.tries[unit] >= TRIES:
                raise InputError(
                    f"unit {unit} was begun {TRIES} times and its worker did not come back "
                    f"({type(error).__name__}: {error}); {KEPT}"
                ) from error
            self.waiting.append(unit)
            return
        if arrays is not None:
            self.store.write(unit, arrays)
        self.seconds.append(time.monotonic() - begin)
        self._done(unit, who)

    def _done(self, unit: int, who: str | None) -> None:
        self.missing.discard(unit)
        self.progress.count(who, self.layout.size(unit))

    def _again(self) -> None:
        """Hand out late units once more."""
        if not self.seconds:
            return
        limit = max(LATE * float(np.median(self.seconds)), LOOK)
        count = [unit for unit, _ in self.under_way.values()]
        now = time.monotonic()
        self.waiting.extend(
            unit for unit, begin in self.under_way.values() if now - begin > limit and count.count(unit) == 1
        )

    def keep_finished(self) -> None:
        """What workers have given back is kept, also when the sweep stops."""
        for future, (unit, _) in self.under_way.items():
            if future.done() and not future.cancelled() and future.exception() is None:
                _, arrays = future.result()
                if arrays is not None and unit in self.missing:
                    with contextlib.suppress(InputError):  # why the sweep stops is said already
                        self.store.write(unit, arrays)


def score_runs(
    sweep: Sweep, *, threads: int | None = None, progress: Callable[[int, int], None] | None = None
) -> dict[str, np.ndarray]:
    """Run a sweep in memory: what `tarsus.study.workunit.work_unit` gives for a unit, of all runs.

    Parameters
    ----------
    sweep
        What to run.
    threads
        Worker threads; by default one for each processor that this process may use.
    progress
        Called as ``progress(runs done, runs)`` after each unit.
    """
    points, shared = sweep.points(), Shared()
    return RunStore().evaluate(
        np.column_stack(list(points.values())),
        lambda rows: work_unit(sweep, dict(zip(points, rows.T, strict=True)), shared),
        chunk=runs_per_unit(sweep), threads=threads, progress=progress,
    )  # fmt: skip
