"""Runs a sweep on all cores, unit by unit, into a store that survives being killed."""

from __future__ import annotations

import hashlib
import inspect
import os
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tarsus.base.spec import float_paths
from tarsus.base.workers import spread, workers
from tarsus.files.series import Variable
from tarsus.files.store import package_version
from tarsus.files.sweepstore import SweepStore
from tarsus.plan.lowering import source_hash
from tarsus.solve.engines import Shared
from tarsus.solve.labelled import measure_variables, outcome_variable
from tarsus.study.axes import Floats, Grid
from tarsus.study.scores import offered
from tarsus.study.studyfile import frozen_texts
from tarsus.study.sweep import Sweep
from tarsus.study.workunit import OUTCOMES, work_unit

__all__ = ["SweepResult", "collected_variables", "plan_digest", "run_sweep", "score_runs"]


@dataclass(frozen=True)
class SweepResult:
    """A finished sweep.

    file: the collected NetCDF; runs: how many; kept: how many of them an earlier call had done; outcomes: how many runs
    ended how, by name in `OUTCOMES`, those that occurred.
    """

    file: Path
    runs: int
    kept: int
    outcomes: Mapping[str, int]


def plan_digest(sweep: Sweep, points: Mapping[str, Floats]) -> str:
    """Digest of everything that the results of a sweep depend on: description, values, version, engine, own laws."""
    digest = hashlib.sha256()
    for text in (*frozen_texts(sweep).values(), package_version(), source_hash(), *OUTCOMES):
        digest.update(text.encode() + b"\0")
    for values in points.values():
        digest.update(values.tobytes())
    for law in sweep.scene.ground.laws.values():
        digest.update(Path(inspect.getfile(type(law))).read_bytes())
    return digest.hexdigest()


def run_sweep(
    sweep: Sweep,
    folder: str | os.PathLike[str],
    *,
    resume: bool = False,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
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
        Worker threads; by default one for each processor that this process may use.
    progress
        Called as ``progress(runs done, runs)`` after each unit.

    Raises
    ------
    InputError
        If the folder holds a sweep that is not to be continued, or another one.
    KeyboardInterrupt
        When interrupted, after the units under way are kept.
    """
    points = sweep.points()
    store = SweepStore.open(
        Path(folder), plan_digest(sweep, points), sweep.units, frozen_texts(sweep), resume=resume
    )
    pending = store.pending()
    size = {unit: sweep.unit(unit).stop - sweep.unit(unit).start for unit in pending}
    kept = done = sweep.runs - sum(size.values())

    shared = Shared()

    def work(unit: int) -> int:
        part = sweep.unit(unit)
        store.write(unit, work_unit(sweep, {axis: values[part] for axis, values in points.items()}, shared))
        return unit

    if pending:
        if progress is not None:
            progress(done, sweep.runs)
        pool = ThreadPoolExecutor(workers(threads))
        try:
            for future in as_completed([pool.submit(work, unit) for unit in pending]):
                done += size[future.result()]
                if progress is not None:
                    progress(done, sweep.runs)
        finally:
            pool.shutdown(cancel_futures=True)
    arrays = store.collect()
    attrs = {
        "title": sweep.name,
        "source": f"tarsus {package_version()}",
        "scene": sweep.scene.name,
        "duration_s": sweep.seconds,
        "plan": store.digest,
    }
    file = store.finish(collected_variables(sweep, points, arrays), attrs)
    counts = np.bincount(arrays["code"], minlength=len(OUTCOMES)).tolist()
    outcomes = {name: count for name, count in zip(OUTCOMES, counts, strict=True) if count}
    return SweepResult(file, sweep.runs, kept, outcomes)


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
    slices = [sweep.unit(unit) for unit in range(sweep.units)]
    chosen = [{axis: values[part] for axis, values in points.items()} for part in slices]
    parts = []
    for part, arrays in zip(
        slices, spread(lambda one: work_unit(sweep, one, shared), chosen, threads), strict=True
    ):
        parts.append(arrays)
        if progress is not None:
            progress(part.stop, sweep.runs)
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def collected_variables(
    sweep: Sweep, points: Mapping[str, Floats], arrays: Mapping[str, np.ndarray]
) -> dict[str, Variable]:
    """Results of all runs as named series: one dimension an axis on a grid, else one dimension ``run``.

    Parameters
    ----------
    sweep
        The sweep.
    points
        Values (nr,) of every run, by axis.
    arrays
        Of all runs, as `tarsus.study.workunit.work_unit` gives them for a unit.
    """
    grid = isinstance(sweep.design, Grid)
    axes = {name: axis.values_on_grid() for name, axis in sweep.vary.items()} if grid else {}
    dims = tuple(axes) if grid else ("run",)
    shape = tuple(map(len, axes.values())) if grid else (sweep.runs,)
    feet = list(sweep.scene.robot.feet)
    known, definitions = float_paths(sweep.scene), offered(sweep.scene, sweep.seconds)
    out: dict[str, Variable] = {}
    for name in sweep.vary:
        paths = sweep.paths(name)
        about = known[paths[0]]
        notes = {"units": about.unit, "long_name": about.doc or name, "paths": " ".join(paths)}
        out[name] = Variable((name,), axes[name], notes) if grid else Variable(dims, points[name], notes)
    # on a grid the axes are coordinates by their names; elsewhere the file has to say so
    where = {} if grid else {"coordinates": " ".join(sweep.vary)}
    out["code"] = outcome_variable(arrays["code"].reshape(shape), OUTCOMES, dims, where)
    for j, name in enumerate(sweep.measures):
        value, deviation = (arrays[key][:, j].reshape(shape) for key in ("value", "spread"))
        each = arrays["per_foot"][:, j].reshape(*shape, len(feet)) if len(feet) > 1 else None
        out |= measure_variables(name, definitions[name], dims, value, deviation, each, where)
    if len(feet) > 1:
        out["foot"] = Variable(("foot",), np.array(feet), {})
    return out
