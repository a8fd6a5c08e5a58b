"""Calibrates: search, ensembles, rows left out, predictions, all into a folder that survives being killed."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.workers import Workers
from tarsus.calibrate.archive import Archive
from tarsus.calibrate.description import Search
from tarsus.calibrate.ensemble import Ensemble, Range, correlations, ranges_of
from tarsus.calibrate.fitting import Fit, fitted
from tarsus.calibrate.leaveout import LeftOut, leave_each_out, missed_by
from tarsus.calibrate.lowering import Lowered, lower_study
from tarsus.calibrate.prediction import Discrepancy, Prediction, predict_row
from tarsus.calibrate.problem import Problem
from tarsus.calibrate.search import Found, questions
from tarsus.calibrate.shown import calibration_html
from tarsus.calibrate.studyfile import Described, frozen_texts, load_study
from tarsus.files.runstore import PER_FOLDER, RunStore
from tarsus.model.laws import Law

__all__ = ["Calibrated", "Solution", "calibrate", "solve"]

Floats = NDArray[np.float64]
Progress = Callable[[int, int, str], None]


@dataclass(frozen=True)
class Solution:
    """A problem solved.

    fit: the mixture of the branches that are kept; ranges and correlations of the unknowns in each; trained:
    predictions of the fitted rows by the mixture; refits: the search without each row, and left_out: predictions by
    them, None where no row was left out; discrepancy: for new rows.
    """

    problem: Problem
    fit: Fit
    ranges: tuple[tuple[Range, ...], ...]
    correlations: tuple[Floats, ...]
    trained: tuple[tuple[Prediction, ...], ...]
    refits: tuple[LeftOut, ...] | None
    left_out: tuple[tuple[Prediction, ...], ...] | None
    discrepancy: Discrepancy

    @property
    def found(self) -> Mapping[int, Found]:
        """What the search found, by branch."""
        return self.fit.found

    @property
    def kept(self) -> tuple[int, ...]:
        """Numbers of the branches that are kept."""
        return self.fit.kept

    @property
    def sets(self) -> int:
        """How many sets were visited, with those of the rows left out."""
        return self.fit.sets + sum(one.fit.sets for one in self.refits or ())

    @property
    def best(self) -> int:
        """Place of the best branch among those kept."""
        return int(np.argmin([one.best for one in self.fit.ensembles]))

    def option_weights(self) -> dict[str, dict[str, float]]:
        """Weight of every option of every choice."""
        out: dict[str, dict[str, float]] = {}
        for branch in self.problem.branches:
            for choice, option in branch.options.items():
                out.setdefault(choice, {}).setdefault(option, 0.0)
        for weight, one in zip(self.fit.weights, self.fit.ensembles, strict=True):
            for choice, option in one.branch.options.items():
                out[choice][option] += float(weight)
        return out


@dataclass(frozen=True)
class Calibrated:
    """A finished calibration: the study, its solution, and predictions of the rows that were not fitted."""

    described: Described
    lowered: Lowered
    solution: Solution
    others: tuple[tuple[Prediction, ...], ...]
    folder: Path | None = None
    simulated: int = 0

    def _repr_html_(self) -> str:
        return calibration_html(self)


ENOUGH_ROWS = 4
"""Rows from which the misses of rows left out are the discrepancy of new ones. Leaving one of fewer out takes a third
of the table or more away: its miss then tells that the unknowns are no longer determined, which the ensemble of the
whole table does not share."""


class Tally:
    """Sets that all searches have asked for, and the most that they will: a search that has not begun counts like that
    of the whole table, which it repeats."""

    def __init__(self, searches: int, progress: Progress | None, stop: threading.Event) -> None:
        self.progress, self.stop, self.stage = progress, stop, "search"
        self.asked, self.ahead, self.begun = [0] * searches, [0] * searches, [False] * searches
        self.lock = threading.Lock()

    def of(self, number: int) -> Callable[[int, int], None]:
        """What the archive of a search tells its questions to."""

        def told(count: int, ahead: int) -> None:
            with self.lock:
                if self.stop.is_set():
                    raise InputError("the search was stopped")
                self.asked[number] += count
                self.ahead[number], self.begun[number] = ahead, True
                whole = self.asked[0] + self.ahead[0]
                most = [
                    asked + ahead if begun else whole
                    for asked, ahead, begun in zip(self.asked, self.ahead, self.begun, strict=True)
                ]
                if self.progress is not None:
                    self.progress(sum(self.asked), sum(most), self.stage)

        return told


def solve(
    problem: Problem,
    search: Search,
    store: RunStore | None = None,
    progress: Progress | None = None,
    threads: Workers = None,
) -> Solution:
    """Search a problem, make its ensembles, and leave each row out once.

    Parameters
    ----------
    problem
        What is searched.
    search
        How long.
    store
        Where visited sets are kept, so that a killed search goes on from there; every search has parts of its own.
    progress
        Called as ``progress(sets done, most sets, what)``.
    threads
        Who searches without a row while others do.
    """
    leaves = search.leave_out and problem.trained > 1
    stop = threading.Event()
    tally = Tally(1 + problem.trained if leaves else 1, progress, stop)
    stride = PER_FOLDER * -(-questions(problem, search) // PER_FOLDER)

    def archive(of: Problem, number: int) -> Archive:
        return Archive(of, store, number * stride, tally.of(number))

    own = archive(problem, 0)
    fit = fitted(problem, own, search)
    trained = tuple(
        tuple(fit.predictions(problem, row, [one.readings[:, row] for one in fit.ensembles]))
        for row in range(problem.trained)
    )
    left, refits, discrepancy = None, None, fit.discrepancy
    if leaves:
        tally.stage = "each row left out"
        refits = leave_each_out(problem, search, archive, stop, threads)
        enough = problem.trained >= ENOUGH_ROWS
        if enough:
            discrepancy = missed_by(problem, refits)
        left = tuple(
            tuple(one.predictions(problem, missed_by(problem, refits, one.row) if enough else None))
            for one in refits
        )
    return Solution(
        problem, fit, tuple(tuple(ranges_of(problem.unknowns, one)) for one in fit.ensembles),
        tuple(correlations(one) for one in fit.ensembles), trained, None if refits is None else tuple(refits), left,
        discrepancy,
    )  # fmt: skip


def calibrate(
    study: str | os.PathLike[str] | Described,
    out: str | os.PathLike[str] | None = None,
    *,
    seed: int | None = None,
    threads: Workers = None,
    resume: bool = False,
    laws: Mapping[str, type[Law]] | None = None,
    progress: Progress | None = None,
) -> Calibrated:
    """Fit a device to a table of measures.

    Parameters
    ----------
    study
        A packaged study by name, a study file by path, or a study with its table.
    out
        Folder for the result: visited sets, `calibration.json`, `mixture.json`, a device file for every branch,
        `report.html` is added by the command. New or empty unless `resume`. Without a folder nothing is written.
    seed
        Seed of the search instead of the study's own.
    threads
        Worker threads; by default one for each processor that this process may use. The result does not depend on them.
    resume
        Continue what the folder holds.
    laws
        Classes of user laws by name, where the scene has them.
    progress
        Called as ``progress(sets done, most sets, what)``.

    Returns
    -------
    Calibrated
        Branches that fit with their ensembles, choices, and predictions of fitted and of left-out rows; `load_mixture`
        reads them again from the folder.

    Raises
    ------
    InputError
        With every problem of the study; when the folder holds anything and is not to be continued, or holds another
        calibration.

    Examples
    --------
    A search takes minutes:

    >>> import tarsus as ts
    >>> found = ts.calibrate("cantilever", "fit")  # doctest: +SKIP
    >>> mixture = ts.load_mixture("fit")  # doctest: +SKIP
    """
    described = study if isinstance(study, Described) else load_study(study, laws)
    if seed is not None:
        search = described.study.search.model_copy(update={"seed": seed})
        described = Described(described.study.model_copy(update={"search": search}), described.table)
    lowered = lower_study(described.study, described.table, threads)
    texts = frozen_texts(described)
    store = None if out is None else RunStore.open(out, texts, resume=resume, what="calibration")
    solution = solve(lowered.problem, described.study.search, store, progress, threads)
    result = Calibrated(
        described, lowered, solution, other_rows(lowered, solution), None if out is None else Path(out)
    )
    if out is not None:
        from tarsus.calibrate.outputs import write_outputs

        write_outputs(result, Path(out))
    return result


def other_rows(lowered: Lowered, solution: Solution) -> tuple[tuple[Prediction, ...], ...]:
    """Predictions of the rows that were not fitted."""
    first = len(lowered.trained)
    rows = tuple(range(first, first + len(lowered.others)))
    if not rows:
        return ()
    ensembles = solution.fit.ensembles
    readings = [_members(lowered, one, rows) for one in ensembles]
    return tuple(
        tuple(
            predict_row(
                ensembles, solution.fit.weights, [one[:, n] for one in readings], lowered.problem.objective.cells,
                lowered.other_absolute[n], solution.discrepancy, lowered.problem.peak, lowered.problem.resolution,
            )
        )
        for n in range(len(rows))
    )  # fmt: skip


def _members(lowered: Lowered, ensemble: Ensemble, rows: tuple[int, ...]) -> NDArray[np.floating]:
    return lowered.forward(ensemble.branch.run, lowered.problem.unknowns.values(ensemble.points), rows)
