"""A sweep as an array of tasks, which any scheduler of a cluster can run: each takes its share of the missing units."""

from __future__ import annotations

import json
import os
import random
import shlex
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tarsus.base.errors import InputError
from tarsus.base.workers import workers
from tarsus.files.runstore import COLLECTED_FILE
from tarsus.files.whole import write_text
from tarsus.study.layout import open_store
from tarsus.study.progress import Progress
from tarsus.study.studyfile import frozen_sweep, stored_texts
from tarsus.study.sweep import Sweep
from tarsus.study.sweeping import do_units, finish
from tarsus.tables.table import Table, Tabled

ARRAY_FOLDER = "array"

HELP = 10
"""A task that is done helps the others with this part of its own share, a tenth: enough to make up for one lost task
in ten, and so little that no task takes much longer than was asked for it."""

SCRIPT = """#!/bin/sh
# One task of an array over the sweep in {folder}: tasks 0 to {last}, or 1 to {tasks}.
#   SLURM     sbatch --array=0-{last} {script}
#   PBS       qsub -J 0-{last} {script}
#   Grid Eng. qsub -t 1-{tasks} {script}
#   LSF       bsub -J "tarsus[1-{tasks}]" {script}
#   a shell   for i in $(seq 0 {last}); do sh {script} $i & done; wait
# The number of the task is an argument, or in the scheduler's variable. Tasks may be repeated.
number=$1
for one in "$SLURM_ARRAY_TASK_ID" "$PBS_ARRAY_INDEX" "$PBS_ARRAYID" "$LSB_JOBINDEX" "$SGE_TASK_ID"; do
  case $one in '' | undefined) ;; *) number=${{number:-$one}} ;; esac
done
{environment}exec {python} -P -m tarsus.cli.task {folder} "$number" {submission}
"""


@dataclass(frozen=True, repr=False)
class Submission(Tabled):
    """An array of tasks: its number in the folder, its script, tasks, the units that they share, and the name of its
    job where it was submitted."""

    number: int
    script: Path
    tasks: int
    units: int
    job: str | None = None

    @property
    def folder(self) -> Path:
        """The folder of the sweep."""
        return self.script.parents[1]

    def table(self) -> Table:
        """The script, and how to see how it goes."""
        job = f"job {self.job}: " if self.job else ""
        title = f"{job}{self.units} units in {self.tasks} tasks, {self.script}"
        return Table(f"{title}\nhow it goes: tarsus show {shlex.quote(str(self.folder))}", (), ())

    def to_dict(self) -> dict[str, Any]:
        """Plain data."""
        data = {"folder": str(self.folder), "units": self.units, "tasks": self.tasks, "script": str(self.script)}
        return data | {"job": self.job}


@dataclass(frozen=True)
class TaskDone:
    """What a task did: runs and units it made, whether the whole sweep is finished."""

    runs: int
    units: int
    finished: bool


def prepare(sweep: Sweep, folder: Path, tasks: int, *, resume: bool) -> Submission | None:
    """Write the plan of a sweep, the missing units and a script that does a task's share of them; None if none miss.

    Task K of N does the units number K, K + N, K + 2 N, ... of the missing ones: neighbours in the plan, which often
    cost alike, come to different tasks.

    Raises
    ------
    InputError
        As `tarsus.study.layout.open_store`.
    """
    if tasks < 1:
        raise InputError(f"tasks: expected a number of tasks of at least 1, got {tasks}")
    store = open_store(sweep, folder, resume=resume)
    pending = store.pending()
    if not pending:
        return None
    tasks = min(tasks, len(pending))
    place = folder.resolve() / ARRAY_FOLDER
    number = 1 + max((int(file.stem) for file in place.glob("[0-9]*.units")), default=0)
    script = place / f"{number}.sh"
    write_text(place / f"{number}.units", json.dumps({"tasks": tasks, "units": _ranges(pending)}) + "\n")
    path = os.environ.get("PYTHONPATH")
    words = {
        "folder": shlex.quote(str(folder.resolve())),
        "last": tasks - 1,
        "tasks": tasks,
        "script": shlex.quote(str(script)),
        "environment": f"export PYTHONPATH={shlex.quote(path)}\n" if path else "",
        "python": shlex.quote(sys.executable),
        "submission": number,
    }
    write_text(script, SCRIPT.format(**words))
    return Submission(number, script, tasks, len(pending))


def run_task(folder: Path, task: int, submission: int, threads: int | None = None) -> TaskDone:
    """Do the share of one task, then help others; the one that finds nothing missing at its end writes the collected
    file.

    Raises
    ------
    InputError
        For a folder or submission that is none, another version of Tarsus, a disk that is full or gone.
    KeyboardInterrupt
        When interrupted, after the units under way are kept.
    """
    file = folder / ARRAY_FOLDER / f"{submission}.units"
    try:
        said = json.loads(file.read_text(encoding="utf-8"))
        tasks, units = max(int(said["tasks"]), 1), _units(said["units"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"'{file}' cannot be read: {error}") from None
    sweep = frozen_sweep(folder)
    store = open_store(sweep, folder, resume=True, texts=stored_texts(folder))
    own = [unit for unit in units[task % tasks :: tasks] if not store.has(unit)]
    with Progress(folder, task) as progress:

        def do(chosen: Sequence[int]) -> None:
            do_units(sweep, store, chosen, workers(threads), progress)

        do(own)
        missing = store.pending() if len(own) >= HELP else []
        do(random.Random(task).sample(missing, min(len(own) // HELP, len(missing))))
        finished = not store.pending()
        if finished and not (folder / COLLECTED_FILE).exists():
            finish(sweep, store, do)
    return TaskDone(sum(progress.runs.values()), progress.units, finished)


def _ranges(numbers: Sequence[int]) -> str:
    """Ascending numbers as `0-4,7,9-12`."""
    ranges: list[list[int]] = []
    for number in numbers:
        if ranges and number == ranges[-1][1] + 1:
            ranges[-1][1] = number
        else:
            ranges.append([number, number])
    return ",".join(f"{first}-{last}" if last > first else f"{first}" for first, last in ranges)


def _units(text: str) -> list[int]:
    """The numbers of `_ranges`."""
    ends = [(first, last or first) for first, _, last in (one.partition("-") for one in text.split(",") if one)]
    return [number for first, last in ends for number in range(int(first), int(last) + 1)]
