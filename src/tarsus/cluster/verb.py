"""`tarsus.sweep`: the verb of Python for the whole of it."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from tarsus.base.arguments import ProgramOptions
from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.base.verb import verb
from tarsus.base.workers import Workers
from tarsus.cluster.array import Submission, prepare
from tarsus.cluster.dask import executor_of
from tarsus.cluster.slurm import submit
from tarsus.files.library import device_names, load_scene
from tarsus.files.runstore import PLAN_FILE
from tarsus.model.laws.userfile import laws_of
from tarsus.model.scene import Scene
from tarsus.study.progress import OnProgress
from tarsus.study.studyfile import frozen_sweep, load_sweep
from tarsus.study.sweep import Sweep
from tarsus.study.sweeping import SweepResult, run_sweep

Study = Sweep | str | os.PathLike[str]


@verb
def sweep(
    study: Study,
    output: str | os.PathLike[str] | None = None,
    *,
    seed: int | None = None,
    array: int | None = None,
    sbatch: ProgramOptions | None = None,
    law: Sequence[str | os.PathLike[str]] = (),
    resume: bool = False,
    threads: Workers = None,
    progress: OnProgress | None = None,
) -> SweepResult | Submission:
    """Run a study: a scene over many values of its numbers, with measures of every run.

    Parameters
    ----------
    study
        A packaged study, a study file (TOML), or the folder of a sweep, which is continued; in Python also a `Sweep`.
    output
        Folder for the study, its finished parts and sweep.nc; by default the study's name with `.sweep`.
    seed
        Of what is drawn at random; the study's own when left out.
    array
        Instead of running write a script that makes the runs in so many tasks of an array, for any scheduler.
    sbatch
        Submit that array to SLURM, with these options of sbatch, e.g. "--partition=main --time=1:00:00".
    law
        Python files with laws of your own.
    resume
        Continue what the folder holds.
    threads
        Threads of this process; by default one for each processor that it may use. Or who does the work instead: any
        executor of ``concurrent.futures``, or a ``dask.distributed.Client``. Results are the same, byte for byte.
    progress
        Called as ``progress(runs done, runs, runs of this call by worker)``.

    Returns
    -------
    SweepResult or Submission
        How many runs were done, and the collected file with measures over all points; of an array its script.

    Raises
    ------
    InputError
        As `tarsus.study.sweeping.run_sweep`.

    Examples
    --------
    >>> import tarsus as ts
    >>> from tarsus.study.axes import Grid, Linspace
    >>> from tarsus.study.sweep import Sweep
    >>> gaps = Linspace(start=60e-6, stop=80e-6, count=3)
    >>> study = Sweep(name="gaps", scene=ts.load_scene("cantilever"), duration=0.02, measures=("impacts",),
    ...               design=Grid(), vary={"robot.feet.tip.gap": gaps})
    >>> found = ts.sweep(study, "gaps.sweep")
    >>> found.runs, found.outcomes
    (3, {'DONE': 3})
    """
    _check_study(study, output)
    if array is not None and array < 1:
        raise InputError(f"array: expected a number of tasks of 1 or more, got {array}")
    if sbatch is not None and array is None:
        raise InputError("sbatch: these are options of an array; say with array how many tasks it has")
    named = None if isinstance(study, Sweep) else Path(study)
    if named is not None and (named / PLAN_FILE).exists() and (output is None or Path(output) == named):
        chosen, folder, resume = frozen_sweep(named), named, True
    else:
        chosen = study if isinstance(study, Sweep) else load_sweep(study, laws_of(law))
        name = chosen.name if isinstance(study, Sweep) else Path(study).stem
        folder = Path(output) if output is not None else Path(f"{name}.sweep")
    if seed is not None:
        chosen = redrawn(chosen, seed, resume)
    if array is not None:
        found = (
            prepare(chosen, folder, array, resume=resume)
            if sbatch is None
            else submit(chosen, folder, sbatch, array, resume=resume)
        )
        if found is not None:
            return found
        resume = True  # nothing is missing: it is collected
    done_by = threads if isinstance(threads, int | None) else executor_of(threads)
    return run_sweep(chosen, folder, resume=resume, threads=done_by, progress=progress)


def _check_study(study: object, output: object) -> None:
    """Raise InputError for what others' sweeps take: a scene or a device, and values by path."""
    scene = study if isinstance(study, Scene) else None
    if scene is None and isinstance(study, str) and study in device_names():
        scene = load_scene(study)
    known = isinstance(study, (Sweep, str, os.PathLike))
    if scene is None and known and not isinstance(output, Mapping):
        return
    name = f'"{study}"' if isinstance(study, str) else "scene"
    got = name if known or scene is not None else f"a {type(study).__name__}"
    base = name if scene is None or scene is study else f"ts.load_scene({name})"
    raise InputError(
        [
            f"expected a Sweep, a study's name or a study file, got {got}: a sweep into a folder is ts.sweep("
            f'ts.Sweep(name="mine", scene={base}, vary={{...}}, '
            f'measures=("peak",)), "mine.sweep"); runs in memory are ts.simulate_batch({name}, {{...}})'
        ]
    )


def redrawn(sweep: Sweep, seed: int, resume: bool = False) -> Sweep:
    """The sweep with another seed. Raises InputError where it draws nothing, and of one that is continued."""
    if resume:
        raise InputError("seed: a sweep that is continued keeps the values it was begun with")
    if "seed" not in type(sweep.design).model_fields:
        raise InputError(f"seed: a {sweep.design.kind} draws nothing at random")
    return with_values(sweep, {"design.seed": seed})
