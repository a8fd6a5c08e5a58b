"""The runs of an experiment: every row's scenes simulated, and what is read of them with what was measured."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping

from tarsus.base.errors import InputError
from tarsus.base.progress import Progress, silent
from tarsus.base.workers import spread
from tarsus.solve import ResultCode, Run, simulate
from tarsus.validation.experiment import PublishedExperiment
from tarsus.validation.studyfile import RowCase
from tarsus.validation.verdict import Compared


def compare_rows(one: PublishedExperiment, threads: int | None = None, progress: Progress = silent) -> list[Compared]:
    """Every measured number of an experiment with the computed one, in the order of its rows.

    Raises InputError where the study cannot make a case of a row, or read its runs.
    """
    rows = one.measured.rows
    cases = [one.study.case(row, one.device, line) for row, line in zip(rows, one.measured.lines, strict=True)]
    found: list[Compared] = []
    numbers = list(range(len(rows)))
    for number, read in zip(numbers, spread(_reader(one, cases), numbers, threads), strict=True):
        progress(number, len(rows), one.name)
        found += _compared(one, number, cases[number].formula, *read)
    progress(len(rows), len(rows), "")
    return found


Read = tuple[Mapping[str, float], str]


def _reader(one: PublishedExperiment, cases: list[RowCase]) -> Callable[[int], Read]:
    """What makes the runs of a row: the numbers that are read of them, and how the first run ended that stopped."""

    def read(number: int) -> Read:
        case, line = cases[number], one.measured.lines[number]
        with one.study.at_row(line):
            runs = [simulate(scene) for scene in case.scenes(one.device)]
            found = case.read(*runs)
        if unknown := [name for name in found if name not in one.claims.measured]:
            known = ", ".join(one.claims.measured)
            raise InputError(
                f"measured.csv, line {line}: the study reads '{unknown[0]}', which is no measured column ({known})"
            )
        return found, _ended(runs)

    return read


def _ended(runs: list[Run]) -> str:
    """The sentence of the first run that did not reach its end; "" where all did."""
    return next((run.ended.value for run in runs if run.ended is not ResultCode.DONE), "")


def _compared(
    one: PublishedExperiment, number: int, formula: Mapping[str, float], found: Mapping[str, float], ended: str
) -> Iterator[Compared]:
    """The measured numbers of a row, each with what was read for its column; columns that are empty have none."""
    row = one.measured.rows[number]
    for name, column in one.claims.measured.items():
        factor = 1.0 if column.formula else column.factor
        measured = formula.get(name) if column.formula else row.get(name)
        if measured is None:
            continue
        spread_ = row.get(column.spread) if column.spread is not None else None
        yield Compared(
            number,
            one.measured.lines[number],
            row,
            name,
            factor * float(measured),
            None if spread_ is None else column.factor * float(spread_),
            float(found.get(name, math.nan)),
            ended,
        )
