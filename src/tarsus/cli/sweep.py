"""`tarsus sweep`: many runs of one scene, scored, into a store that survives being killed, here or on a cluster."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from tarsus.cli.options import (
    FLAG,
    HERE,
    PAGES,
    LawFiles,
    MaybeFolder,
    MaybeSeed,
    Pages,
    Resume,
    Work,
    at_least,
)

if TYPE_CHECKING:
    from tarsus.base.workers import Workers
    from tarsus.study.sweep import Sweep


def sweep(
    study: str,
    /,
    *,
    output: MaybeFolder = None,
    seed: MaybeSeed = None,
    work: Work = HERE,
    resume: Resume = False,
    law: LawFiles = None,
    slurm: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None,
    tasks: Annotated[int | None, at_least(1)] = None,
    task: int | None = None,
    submission: int = 1,
    status: Annotated[bool, FLAG] = False,
    pages: Pages = PAGES,
) -> int:
    """Run a study: a scene over many values of its floats, every run scored.

    Parameters
    ----------
    study
        a packaged study, a study file (TOML), or the folder of a sweep, which is continued.
    output
        folder for the study, its finished parts and sweep.nc; by default the study's name with .sweep.
    slurm
        submit an array to SLURM with these words for sbatch ("--partition=main --time=1:00:00"); on a folder that
        holds a sweep, of what is missing.
    tasks
        tasks of the array; without --slurm its script is only written, for any scheduler.
    task
        do the share of one task of the array in this folder (what the array's script calls).
    submission
        which array of the folder the task is of.
    status
        print how the sweep in this folder goes, from any machine that sees it.
    """
    from tarsus.base.errors import InputError
    from tarsus.cli import console
    from tarsus.files.runstore import SWEEP_FILES

    if status:
        from dataclasses import asdict

        from tarsus.cluster.status import status_lines, status_of

        try:
            found = status_of(Path(study))
        except ValueError as error:
            raise InputError(str(error)) from None
        console.print_json(asdict(found)) if pages.json else print("\n".join(status_lines(found)))
        return 0
    if task is not None:
        from tarsus.cli.task import task as do_task

        return do_task(Path(study), task, submission, work.threads, json=pages.json)
    if slurm is not None and work.on is not None:
        raise InputError(
            "--slurm submits an array and --on dask:ADDRESS uses a cluster of Dask: give one of them"
        )
    chosen, folder, resume = _chosen(study, output, law, resume, pages.overwrite)
    if seed is not None:
        chosen = _drawn_anew(chosen, seed, resume)
    target = pages.target(folder, "sweep", SWEEP_FILES, resume=resume)
    if slurm is not None or tasks is not None:
        with target.writing(resume=resume):
            return _array(chosen, folder, slurm, tasks if tasks is not None else 1, resume, pages.json)
    with target.writing(resume=resume), work.workers() as workers:
        return _run(chosen, folder, resume, workers, pages)


def _chosen(
    study: str, output: Path | None, law: list[Path] | None, resume: bool, overwrite: bool
) -> tuple[Sweep, Path, bool]:
    """The sweep, its folder, and whether that is continued."""
    from tarsus.cli import requests
    from tarsus.files.runstore import PLAN_FILE
    from tarsus.study.studyfile import frozen_sweep, load_sweep

    if (Path(study) / PLAN_FILE).exists() and output is None and not overwrite:
        return frozen_sweep(Path(study)), Path(study), True
    folder = output if output is not None else Path(f"{Path(study).stem}.sweep")
    return load_sweep(study, requests.laws_of(law or ())), folder, resume


def _drawn_anew(chosen: Sweep, seed: int, resume: bool) -> Sweep:
    """The sweep with another seed; its design must have one, and must not be that of a folder already."""
    from tarsus.base.errors import InputError
    from tarsus.base.spec import with_values

    if resume:
        raise InputError("--seed: a sweep that is continued keeps the values it was begun with")
    if "seed" not in type(chosen.design).model_fields:
        raise InputError(f"--seed: a {chosen.design.kind} draws nothing at random")
    return with_values(chosen, {"design.seed": seed})


def _array(chosen: Sweep, folder: Path, slurm: str | None, tasks: int, resume: bool, json: bool) -> int:
    from tarsus.cli import console
    from tarsus.cluster.array import prepare
    from tarsus.cluster.slurm import submit

    if slurm is None:
        array = prepare(chosen, folder, tasks, resume=resume)
        job = None
    else:
        submitted = submit(chosen, folder, slurm, tasks, resume=resume)
        array, job = (submitted.array, submitted.job) if submitted else (None, None)
    if json:
        units, count, script = (array.units, array.tasks, str(array.script)) if array else (0, 0, None)
        console.print_json(
            {"folder": str(folder), "units": units, "tasks": count, "script": script, "job": job}
        )
        return 0
    if array is None:
        print(f"nothing is missing in '{folder}'; `tarsus sweep {folder}` collects it")
        return 0
    print(f"{f'job {job}: ' if job else ''}{array.units} units in {array.tasks} tasks, {array.script}")
    print(f"how it goes: tarsus sweep {folder} --status")
    return 0


def _run(
    chosen: Sweep,
    folder: Path,
    resume: bool,
    threads: Workers,
    pages: Pages,
) -> int:
    import time
    from collections.abc import Mapping

    from tarsus.cli import console
    from tarsus.files.store import REPORT_FILE
    from tarsus.study.sweeping import run_sweep
    from tarsus.study.workunit import OUTCOMES

    start = time.perf_counter()
    with console.resumable(), console.progress_bar("runs", time_left=True) as progress:

        def tell(done: int, total: int, who: Mapping[str, int]) -> None:
            shown = "  ".join(f"{name} {count}" for name, count in sorted(who.items())[:SHOWN])
            progress(done, total, "" if len(who) < 2 else f"{len(who)} workers: {shown}")

        result = run_sweep(chosen, folder, resume=resume, threads=threads, progress=tell)
    written = [result.file]
    if pages.report:
        from tarsus.report.sweep_page import write_sweep_report

        written.append(write_sweep_report(chosen, result.file, folder / REPORT_FILE))
    seconds = time.perf_counter() - start
    failed = result.runs - result.outcomes.get("DONE", 0)
    if pages.json:
        table = {"runs": result.runs, "units": result.units, "failed": failed, "seconds": seconds}
        console.print_json(table | {"workers": result.workers, "kept": result.kept, "file": str(result.file)})
        return 0 if failed < result.runs else 1
    earlier = f", {result.kept} of them done before" if result.kept else ""
    print(f"{chosen.name}: {result.runs} runs of {chosen.seconds:g} s in {seconds:.1f} s{earlier}")
    for name, count in result.outcomes.items():
        print(f"  {count:>8}  {OUTCOMES[name]}")
    console.wrote(written)
    return 0 if failed < result.runs else 1


SHOWN = 6
"""Workers named beside the progress bar: as many as a line takes."""
