"""One task of an array, ``python -m tarsus.cli.task DIR NUMBER SUBMISSION``: what the array's script calls.

It is no verb of the command line: a task of a minute notices what the reading of one loads.
"""

from __future__ import annotations

import signal
import sys
from pathlib import Path

from tarsus.base.errors import InputError
from tarsus.cli import console
from tarsus.cli.app import exit_code
from tarsus.cli.entry import alone
from tarsus.cli.interrupts import INTERRUPTED


def task(folder: Path, number: int, submission: int) -> int:
    """Do the share of one task and return the exit code."""
    from tarsus.cluster.array import run_task

    signal.signal(signal.SIGTERM, signal.default_int_handler)  # how a scheduler ends a task
    try:
        done = run_task(folder, number, submission)
    except KeyboardInterrupt:
        console.complain(["the task was ended; finished parts are kept, and it can be repeated"])
        return INTERRUPTED
    print(
        f"task {number}: {done.runs} runs in {done.units} units" + ("; the sweep is finished" if done.finished else "")
    )
    return 0


def _from_words(words: list[str]) -> int:
    if len(words) != 3 or not all(word.isdecimal() for word in words[1:]):
        raise InputError(
            "a task is called with the folder of a sweep, the number of the task and that of the array: "
            f"got {' '.join(words) or 'nothing'}; without a scheduler the script takes the task's number"
        )
    return task(Path(words[0]), int(words[1]), int(words[2]))


if __name__ == "__main__":
    sys.exit(alone(lambda words: exit_code(lambda: _from_words(words))))
