"""`tarsus sweep`: many runs of one scene, scored, into a store that survives being killed, here or on a cluster."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from tarsus.cli.options import HERE, PAGES, LawFiles, MaybeFolder, MaybeSeed, Pages, Resume, Work

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
    pages: Pages = PAGES,
) -> int:
    """Run a study: a scene over many values of its floats, every run scored.

    Parameters
    ----------
    study
        a packaged study, a study file (TOML), or the folder of a sweep, which is continued.
    output
        folder for the study, its finished parts and sweep.nc; by default the study's name with .sweep.
    """
    from tarsus.cli import requests
    from tarsus.cluster.verb import redrawn
    from tarsus.files.runstore import SWEEP_FILES

    kind, words = ("", "") if work.on is None else requests.place_of(work.on)
    chosen, folder, resume = _chosen(study, output, law, resume, pages.overwrite)
    if seed is not None:
        chosen = redrawn(chosen, seed, resume)
    target = pages.target(folder, "sweep", SWEEP_FILES, resume=resume)
    if kind in ("slurm", "array"):
        options, tasks = array_words(words, kind)
        with target.writing(resume=resume):
            return _array(chosen, folder, options, tasks, resume, pages.json)
    with target.writing(resume=resume), work.workers() as workers:
        return _run(chosen, folder, resume, workers, pages)


def array_words(words: str, kind: str) -> tuple[str | None, int]:
    """Options of sbatch, None of an array that is only written, and the number of tasks: of
    ``partition=main,time=1:00:00,tasks=100``, or of options as sbatch itself takes them."""
    from tarsus.base.errors import InputError

    apart = words.split() if words.startswith("-") else words.split(",")
    given = [one.strip() for one in apart if one.strip()]
    tasks = [one.lstrip("-").removeprefix("tasks=") for one in given if re.match(r"-*tasks=", one)]
    options = [one for one in given if not re.match(r"-*tasks=", one)]
    if len(tasks) > 1 or not all(one.isdecimal() and int(one) > 0 for one in tasks):
        raise InputError(f"--on {kind}: expected tasks=N with a number of tasks of at least 1, got '{words}'")
    if kind == "array" and options:
        raise InputError(f"--on array takes tasks=N alone, got '{words}'")
    count = int(tasks[0]) if tasks else 1
    if kind == "array":
        return None, count
    named = [one if one.startswith("-") else _option(*one.partition("=")) for one in options]
    return " ".join(named), count


def _option(name: str, equals: str, value: str) -> str:
    """An option as commands take it, by its long name or its letter."""
    return f"--{name}{equals}{value}" if len(name) > 1 else f"-{name} {value}".strip()


def _chosen(
    study: str, output: Path | None, law: list[Path] | None, resume: bool, overwrite: bool
) -> tuple[Sweep, Path, bool]:
    """The sweep, its folder, and whether that is continued."""
    from tarsus.files.runstore import PLAN_FILE
    from tarsus.model.laws.userfile import laws_of
    from tarsus.study.studyfile import frozen_sweep, load_sweep

    if (Path(study) / PLAN_FILE).exists() and output is None and not overwrite:
        return frozen_sweep(Path(study)), Path(study), True
    folder = output if output is not None else Path(f"{Path(study).stem}.sweep")
    return load_sweep(study, laws_of(law or ())), folder, resume


def _array(chosen: Sweep, folder: Path, slurm: str | None, tasks: int, resume: bool, json: bool) -> int:
    from tarsus.cli import console
    from tarsus.cluster.array import prepare
    from tarsus.cluster.slurm import submit

    job = None
    if slurm is None:
        array = prepare(chosen, folder, tasks, resume=resume)
    else:
        array, job = submit(chosen, folder, slurm, tasks, resume=resume)
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
    print(f"how it goes: tarsus show {folder}")
    return 0


def _run(chosen: Sweep, folder: Path, resume: bool, threads: Workers, pages: Pages) -> int:
    import time
    from collections.abc import Mapping

    from tarsus.cli import console
    from tarsus.files.store import REPORT_FILE
    from tarsus.study.sweeping import run_sweep

    start = time.perf_counter()
    with console.resumable(), console.progress_bar("runs", time_left=True) as progress:

        def report(done: int, total: int, who: Mapping[str, int]) -> None:
            shown = "  ".join(f"{name} {count}" for name, count in sorted(who.items())[:SHOWN])
            progress(done, total, "" if len(who) < 2 else f"{len(who)} workers: {shown}")

        result = run_sweep(chosen, folder, resume=resume, threads=threads, progress=report)
    written = [result.file]
    if pages.report:
        from tarsus.report.pages import write_page
        from tarsus.report.sweep_page import sweep_html

        written.append(write_page(sweep_html(chosen, result.file), folder / REPORT_FILE))
    seconds = time.perf_counter() - start
    code = 1 if result.failed == result.runs else 0
    if pages.json:
        table = {"runs": result.runs, "motion": result.motion, "units": result.units, "failed": result.failed}
        table |= {
            "seconds": seconds,
            "workers": result.workers,
            "kept": result.kept,
            "file": str(result.file),
        }
        console.print_json(table)
        return code
    console.table(result.table())
    console.wrote(written)
    return code


SHOWN = 6
"""Workers named beside the progress bar: as many as a line takes."""
