"""Runs a sweep, unit by unit, into a store that survives being killed: on all cores, or on an executor's workers."""

from __future__ import annotations

import os
import socket
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.workers import Workers, is_executor, workers
from tarsus.files.runstore import RunStore
from tarsus.solve import ResultCode, Shared
from tarsus.study.collecting import collect
from tarsus.study.layout import open_store, runs_per_unit
from tarsus.study.pool import WorkerPool
from tarsus.study.progress import OnProgress, Progress
from tarsus.study.workunit import OUTCOMES, work_unit
from tarsus.tables.table import Table, Tabled

if TYPE_CHECKING:
    from tarsus.study.sweep import Sweep


@dataclass(frozen=True, repr=False)
class SweepResult(Tabled):
    """A finished sweep.

    file: the collected NetCDF; runs: how many; kept: how many of them an earlier call had done; outcomes: how many runs
    ended how, by name in `OUTCOMES`, those that occurred; units: units of work; workers: runs of this call by who made
    them: node, or node and process; name: of the sweep; motion: what its measures are taken over, in words.
    """

    file: Path
    runs: int
    kept: int
    outcomes: Mapping[str, int]
    units: int = 0
    workers: Mapping[str, int] = field(default_factory=dict)
    name: str = ""
    motion: str = ""

    @property
    def failed(self) -> int:
        """Runs that did not reach their end."""
        return self.runs - self.outcomes.get(ResultCode.DONE.name, 0)

    @property
    def ok(self) -> bool:
        """Whether any run reached its end."""
        return self.failed < self.runs

    def to_dict(self) -> dict[str, Any]:
        """Plain data."""
        data: dict[str, Any] = {"runs": self.runs, "motion": self.motion, "units": self.units, "failed": self.failed}
        return data | {"workers": dict(self.workers), "kept": self.kept, "file": str(self.file)}

    def table(self) -> Table:
        """How the runs ended."""
        earlier = f", {self.kept} of them done before" if self.kept else ""
        title = f"{self.name}: {self.runs} runs, {self.motion}{earlier}"
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
    store = open_store(sweep, Path(folder), resume=resume)
    kept = sweep.runs - sum(map(store.size, store.pending()))
    made: Counter[str] = Counter()

    def do(units: Sequence[int]) -> None:
        with Progress(store.place, runs=sweep.runs, report=progress) as counted:
            counted.expect(sum(map(store.size, units)))
            if is_executor(threads):
                WorkerPool(sweep, store, threads, counted).do(units)
            else:
                do_units(sweep, store, units, workers(threads), counted)
        made.update(counted.runs)

    file, outcomes = finish(sweep, store, do)
    return SweepResult(file, sweep.runs, kept, outcomes, store.units, dict(made), sweep.name, str(sweep.motion))


def finish(sweep: Sweep, store: RunStore, do: Callable[[Sequence[int]], None]) -> tuple[Path, dict[str, int]]:
    """Have what is missing done, and collect it; units that turn out damaged are done again, once.

    do: has units done and kept. Gives what `collect` does.
    """
    pending = store.pending()
    if pending:
        do(pending)
    try:
        return collect(sweep, store)
    except InputError:
        store.check()
        damaged = store.pending()
        if not damaged:
            raise
    do(damaged)
    return collect(sweep, store)


def do_units(sweep: Sweep, store: RunStore, units: Sequence[int], threads: int, progress: Progress) -> None:
    """Have units done and kept by threads of this process; those that appear in the store meanwhile are skipped.

    However it ends, units that are under way then are finished and kept.
    """
    shared, node = Shared(), socket.gethostname()

    def do(unit: int) -> str | None:
        if store.has(unit):  # another process was here
            return None
        arrays = work_unit(sweep, sweep.points(store.part(unit)), shared)
        if not store.has(unit):
            store.write(unit, arrays)
        return node

    pool = ThreadPoolExecutor(threads)
    try:
        for first in range(0, len(units), TOGETHER):
            some = units[first : first + TOGETHER]
            for unit, who in zip(some, pool.map(do, some), strict=True):
                progress.count(who, store.size(unit))
    finally:
        pool.shutdown(cancel_futures=True)


TOGETHER = 1000
"""Units that wait for threads at a time: a plan may have a million, and each that waits takes memory."""


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
        chunk=runs_per_unit(sweep),
        threads=threads,
        progress=progress,
    )
