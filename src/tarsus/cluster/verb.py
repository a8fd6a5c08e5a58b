"""`tarsus.sweep`: the verb of Python for the whole of it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.cluster.dask import executor_of
from tarsus.files.library import device_names, load_scene
from tarsus.model.scene import Scene
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
    _check_study(study, output)
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


def _check_study(study: object, output: object) -> None:
    """Raise InputError for what others' sweeps take: a scene or a device, and values by path."""
    scene = study if isinstance(study, Scene) else None
    if scene is None and isinstance(study, str) and study in device_names():
        scene = load_scene(study)
    if scene is None and not isinstance(output, Mapping):
        return
    name = f'"{study}"' if isinstance(study, str) else "scene"
    raise InputError([
        f"expected a Sweep, a study's name or a study file, got {name}: a sweep into a folder is ts.sweep(ts.Sweep("
        f'name="mine", scene={name if scene is None or scene is study else f"ts.load_scene({name})"}, vary={{...}}, '
        f'measures=("peak",)), "mine.sweep"); runs in memory are ts.simulate_batch({name}, {{...}})'
    ])  # fmt: skip


def redrawn(sweep: Sweep, seed: int, resume: bool = False) -> Sweep:
    """The sweep with another seed. Raises InputError where it draws nothing, and of one that is continued."""
    if resume:
        raise InputError("--seed: a sweep that is continued keeps the values it was begun with")
    if "seed" not in type(sweep.design).model_fields:
        raise InputError(f"--seed: a {sweep.design.kind} draws nothing at random")
    return with_values(sweep, {"design.seed": seed})
