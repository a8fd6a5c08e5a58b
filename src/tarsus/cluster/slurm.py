"""Arrays on SLURM, by its own commands."""

from __future__ import annotations

import contextlib
import json
import shlex
import subprocess
from dataclasses import replace
from pathlib import Path

from tarsus.base.errors import InputError, InputProblem
from tarsus.cluster.array import ARRAY_FOLDER, Submission, prepare
from tarsus.files.whole import write_text
from tarsus.study.sweep import Sweep

PATIENCE = 60.0
"""Seconds that SLURM's commands are given: a busy controller answers late."""


def submit(sweep: Sweep, folder: Path, options: str, tasks: int, *, resume: bool) -> Submission | None:
    """Write a sweep's plan and submit an array over what is missing of it: the array with SLURM's name of its job, or
    None if nothing is missing.

    Parameters
    ----------
    sweep
        What to run.
    folder
        On a disk that all nodes have.
    options
        Words for sbatch, such as ``--partition=main --time=1:00:00 --cpus-per-task=8``.
    tasks
        Tasks of the array at most.
    resume
        Whether the folder's sweep is continued.

    Raises
    ------
    InputError
        When SLURM is not there or refuses, and when an array of this folder is still in its queue.
    """
    try:
        words = shlex.split(options)
    except ValueError as error:
        raise InputError(InputProblem.at("sbatch", f"'{options}' cannot be read: {error}")) from None
    waiting = [(job, count) for job in _jobs(folder) if (count := _queued(job))]
    if waiting:
        job, count = waiting[0]
        raise InputError(
            f"job {job} works on '{folder}' and has {count} tasks in the queue: wait for it, or `scancel {job}` and "
            "submit what is missing then"
        )
    array = prepare(sweep, folder, tasks, resume=resume)
    if array is None:
        return None
    place = array.script.parent
    own = [
        f"--array=0-{array.tasks - 1}",
        "--job-name=tarsus",
        "--requeue",
        "--open-mode=append",
        f"--output={place}/{array.number}-%a.out",
    ]
    job = _command("sbatch", "--parsable", *own, *words, str(array.script)).split(";")[0].strip()
    write_text(place / f"{array.number}.json", json.dumps({"job": job}) + "\n")
    return replace(array, job=job)


def _jobs(folder: Path) -> list[str]:
    """Jobs of earlier submissions; where a file does not say which, nothing worse happens than double work."""
    found = []
    for file in sorted((folder / ARRAY_FOLDER).glob("[0-9]*.json")):
        with contextlib.suppress(OSError, ValueError, KeyError, TypeError):
            found.append(str(json.loads(file.read_text(encoding="utf-8"))["job"]))
    return found


def _queued(job: str) -> int:
    """Tasks of a job that wait or run; none of a job that SLURM has forgotten."""
    try:
        return len(_command("squeue", "--noheader", "--array", "--format=%i", f"--jobs={job}").split())
    except InputError as error:
        if "nvalid job id" in str(error):
            return 0
        raise


def _command(*words: str) -> str:
    """What a command of SLURM prints."""
    try:
        done = subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE, check=False)
    except FileNotFoundError:
        raise InputError(
            f"sbatch: there is no `{words[0]}` here: submit from a node that has SLURM's commands; without sbatch "
            "the array is written for any scheduler"
        ) from None
    except subprocess.TimeoutExpired:
        raise InputError(f"sbatch: `{words[0]}` gave no answer within {PATIENCE:.0f} s") from None
    if done.returncode:
        raise InputError(f"sbatch: `{words[0]}` refused: {' '.join(done.stderr.split())}")
    return done.stdout
