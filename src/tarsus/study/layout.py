"""What a sweep is on disk: its store, and how many runs make a unit of work."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.units import parse_quantity
from tarsus.files.runstore import MOST_UNITS, PLAN_FILE, RunStore
from tarsus.study.studyfile import frozen_texts
from tarsus.study.workunit import work_unit

if TYPE_CHECKING:
    from tarsus.study.axes import Floats
    from tarsus.study.sweep import Sweep

ENDS = 64
"""Runs at either end of a plan whose values are part of its digest: any other points differ there."""

TRIED = 0.25
"""Seconds of work after which the cost of a run is taken as known: long against what a first run loads."""

MOST_TRIED = 4096
"""Runs tried at most: enough of even the cheapest ones."""


def values_of(sweep: Sweep) -> list[Floats]:
    """Values of the sweep's first and last runs: a library that draws other points changes them."""
    ends = (slice(0, min(ENDS, sweep.runs)), slice(max(sweep.runs - ENDS, 0), sweep.runs))
    return [values for part in ends for values in sweep.points(part).values()]


def runs_per_unit(sweep: Sweep) -> int:
    """Runs in a unit: as many as the sweep says, or as take the time that it says, tried here on one thread.

    Runs are tried from all over the plan, in growing numbers, until `TRIED` seconds have gone into one trial.

    Raises
    ------
    InputError
        When the plan would have more units than a store takes.
    """
    least = -(-sweep.runs // MOST_UNITS)
    if isinstance(sweep.chunk, int):
        if sweep.chunk < least:
            raise InputError(
                f"chunk: {sweep.runs} runs in units of {sweep.chunk} are more than {MOST_UNITS} units; give at least "
                f"{least}"
            )
        return sweep.chunk
    wanted, count, cost = parse_quantity(sweep.chunk, "s"), 1, 0.0
    while True:
        step = max(sweep.runs // count, 1)
        rows = [sweep.points(slice(i, i + 1)) for i in range(0, sweep.runs, step)[:count]]
        points = {axis: np.concatenate([row[axis] for row in rows]) for axis in sweep.vary}
        begin = time.perf_counter()
        work_unit(sweep, points)
        taken = time.perf_counter() - begin
        cost = taken / len(rows)
        if taken >= TRIED or count >= min(MOST_TRIED, sweep.runs):
            break
        count *= 4
    return max(_rounded(min(wanted / max(cost, 1e-9), sweep.runs)), least, 1)


def _rounded(value: float) -> int:
    """A count to one digit below it: 1, 2, ... 10, 20, ...: what a second trial gives is often the same."""
    whole = max(int(value), 1)
    power = 10 ** (len(str(whole)) - 1)
    return whole // power * power


def open_store(sweep: Sweep, folder: Path, *, resume: bool, texts: Mapping[str, str] | None = None) -> RunStore:
    """The store of a sweep; where others have begun it, their units count.

    `texts` are the sweep's frozen ones, from whoever has them already.

    Raises
    ------
    InputError
        As `RunStore.open` and `runs_per_unit`.
    """
    begun = resume and (folder / PLAN_FILE).exists()
    return RunStore.open(
        folder,
        texts if texts is not None else frozen_texts(sweep),
        resume=resume,
        values=values_of(sweep),
        runs=sweep.runs,
        chunk=sweep.runs if begun else runs_per_unit(sweep),
    )
