"""`tarsus.sweep`: the verb of Python for the whole of it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.cluster.dask import executor_of
from tarsus.study.progress import OnProgress
from tarsus.study.studyfile import load_sweep
from tarsus.study.sweep import Sweep
from tarsus.study.sweeping import SweepResult, run_sweep


def sweep(
    study: Sweep | str | os.PathLike[str],
    output: str | os.PathLike[str] | None = None,
    *,
    seed: int | None = None,
    client: Any = None,
    resume: bool = False,
    threads: int | None = None,
    progress: OnProgress | None = None,
) -> SweepResult:
    """Run a sweep into a folder, here or on a cluster.

    Parameters
    ----------
    study
        A `Sweep`, a packaged study's name, or a study file.
    output
        The folder; by default the study's name with `.sweep`.
    seed
        Of what is drawn at random; the study's own when left out.
    client
        Who does the work: a ``dask.distributed.Client`` of any cluster, or any executor of ``concurrent.futures``.
        Threads of this process without one. The results are the same, byte for byte.
    resume
        Continue what the folder holds.
    threads
        Threads of this process; by default one for each processor that it may use.
    progress
        Called as ``progress(runs done, runs, runs of this call by worker)``.

    Returns
    -------
    SweepResult
        How many runs were done, and the collected file with measures over all points.

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
    chosen = study if isinstance(study, Sweep) else load_sweep(study)
    name = chosen.name if isinstance(study, Sweep) else Path(study).stem
    if seed is not None:
        chosen = redrawn(chosen, seed, resume)
    return run_sweep(
        chosen,
        output if output is not None else f"{name}.sweep",
        resume=resume,
        threads=threads if client is None else executor_of(client),
        progress=progress,
    )


def redrawn(sweep: Sweep, seed: int, resume: bool = False) -> Sweep:
    """The sweep with another seed. Raises InputError where it draws nothing, and of one that is continued."""
    if resume:
        raise InputError("--seed: a sweep that is continued keeps the values it was begun with")
    if "seed" not in type(sweep.design).model_fields:
        raise InputError(f"--seed: a {sweep.design.kind} draws nothing at random")
    return with_values(sweep, {"design.seed": seed})
