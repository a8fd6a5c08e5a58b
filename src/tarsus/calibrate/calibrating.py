"""Calibrates: search, ensembles, excluded rows, predictions, all into a folder that survives being killed."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tarsus.base.progress import Progress
from tarsus.calibrate.ensemble import ExcludedRow, SearchedEnsembles, exclude, missed_by, searched_ensembles
from tarsus.calibrate.lowering import Lowered, lower_study
from tarsus.calibrate.prediction import Discrepancy, Prediction
from tarsus.calibrate.problem import Archive, CalibrationProblem
from tarsus.calibrate.search import most_sets
from tarsus.calibrate.studyfile import Described, frozen_texts, load_study
from tarsus.calibrate.weighted_ensemble import WeightedEnsemble
from tarsus.files.runstore import RunStore
from tarsus.model.laws.userfile import laws_of
from tarsus.tables.table import Table, Tabled

if TYPE_CHECKING:
    from tarsus.base.workers import Workers
    from tarsus.calibrate.description import Search


@dataclass(frozen=True)
class Solution:
    """A problem solved: the weighted ensembles of the hypotheses that are kept, and the search without each row, None
    where no row was excluded."""

    problem: CalibrationProblem
    fit: SearchedEnsembles
    refits: tuple[ExcludedRow, ...] | None

    @property
    def _enough(self) -> list[ExcludedRow]:
        """Excluded rows whose misses are the discrepancy of others."""
        return list(self.refits or ()) if self.problem.trained >= ENOUGH_ROWS else []

    @cached_property
    def excluded(self) -> tuple[tuple[Prediction, ...], ...] | None:
        """Predictions of each row by the search without it."""
        if self.refits is None:
            return None
        missed = [missed_by(self.problem, self._enough, one.row) if self._enough else None for one in self.refits]
        return tuple(one.predictions(self.problem, by) for one, by in zip(self.refits, missed, strict=True))

    @cached_property
    def discrepancy(self) -> Discrepancy:
        """That of new rows."""
        return missed_by(self.problem, self._enough) if self._enough else self.fit.discrepancy

    @property
    def sets(self) -> int:
        """How many sets were visited, with those of the excluded rows."""
        return self.fit.sets + sum(one.fit.sets for one in self.refits or ())

    def option_weights(self) -> dict[str, dict[str, float]]:
        """Weight of every option of every choice."""
        out: dict[str, dict[str, float]] = {}
        for one in self.problem.hypotheses:
            for choice, option in one.options.items():
                out.setdefault(choice, {}).setdefault(option, 0.0)
        for weight, one in zip(self.fit.weights, self.fit.ensembles, strict=True):
            for choice, option in one.hypothesis.options.items():
                out[choice][option] += float(weight)
        return out


@dataclass(frozen=True, repr=False)
class Calibration(Tabled):
    """A finished calibration: its solution, the ensemble that predicts any row, and what is predicted of the table's
    rows, those that were fitted first."""

    solution: Solution
    ensemble: WeightedEnsemble
    predicted: tuple[tuple[Prediction, ...], ...]
    folder: Path | None = None

    @property
    def lowered(self) -> Lowered:
        """The study as it was searched."""
        return self.ensemble.lowered

    @property
    def problems(self) -> list[str]:
        """What the user must not miss: a fitted row of which no run reached its end."""
        lost = any(one.failed >= 1.0 for row in self.predicted[: len(self.lowered.trained)] for one in row)
        return ["no run of some fitted rows reached its end; the calibration means nothing there"] * lost

    def to_dict(self) -> dict[str, Any]:
        """All its numbers: what `calibration.json` holds."""
        from tarsus.calibrate.results import calibration_json

        return calibration_json(self)

    def table(self) -> Table:
        """Hypotheses, unknowns of the best one, and errors."""
        from tarsus.calibrate.results import calibration_table

        return calibration_table(self.to_dict())

    def write(self, folder: str | os.PathLike[str]) -> Path:
        """Write `calibration.json`, `mixture.json` and a device file for every hypothesis that is kept into a folder,
        which is returned."""
        from tarsus.calibrate.writing import write_outputs

        write_outputs(self, Path(folder))
        return Path(folder)


ENOUGH_ROWS = 4
"""Rows from which the misses of excluded rows are the discrepancy of new ones. Excluding one of fewer takes a third of
the table or more away: its miss then shows that the unknowns are no longer determined, which the ensemble of the whole
table does not share."""


def solve(
    problem: CalibrationProblem, search: Search, store: RunStore | None = None, progress: Progress | None = None
) -> Solution:
    """Search a problem, make its ensembles, and exclude each row once.

    Parameters
    ----------
    problem
        What is searched.
    search
        How long.
    store
        Where visited sets are kept, so that a killed search goes on from there; every search has memos of its own.
    progress
        Called as ``progress(sets done, most sets, what)``.
    """
    excludes, kept = search.leave_out and problem.trained > 1, store or RunStore()
    sets = [0] * (1 + problem.trained if excludes else 1)
    most = most_sets(search, len({one.run for one in problem.hypotheses}), len(problem.hypotheses))

    def archive(of: CalibrationProblem, number: int) -> Archive:
        def report(count: int) -> None:
            sets[number] = count
            if progress is not None:
                progress(sum(sets), sum(max(one, most) for one in sets), "each row excluded" if number else "search")

        return Archive(of, kept, number, report)

    fit = searched_ensembles(archive(problem, 0), search)
    if not excludes:
        return Solution(problem, fit, None)
    most = fit.sets  # every other search is about as long
    return Solution(problem, fit, tuple(exclude(problem, search, row, archive) for row in range(problem.trained)))


CalibrationStudy = str | os.PathLike[str] | Described


def calibrate(
    study: CalibrationStudy,
    output: str | os.PathLike[str] | None = None,
    *,
    seed: int | None = None,
    threads: Workers = None,
    resume: bool = False,
    law: Sequence[str | os.PathLike[str]] = (),
    progress: Progress | None = None,
) -> Calibration:
    """Fit a device to a table of measures.

    Parameters
    ----------
    study
        A packaged study by name, or a study file by path; in Python also a study with its table.
    output
        Folder for the result: visited sets, `calibration.json`, `mixture.json`, a device file for every hypothesis;
        `report.html` is added by the command. New or empty unless `resume`. By default the study's name with
        `.calibration`; in Python nothing is written then.
    seed
        Seed of the search instead of the study's own.
    threads
        Worker threads; by default one for each processor that this process may use. The result does not depend on them.
    resume
        Continue what the folder holds.
    law
        Python files with laws of your own, where the scene has them.
    progress
        Called as ``progress(sets done, most sets, what)``.

    Returns
    -------
    Calibration
        Hypotheses that fit with their ensembles, choices, and predictions of fitted and of excluded rows;
        `load_ensemble` reads them again from the folder.

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
    >>> ensemble = ts.load_ensemble("fit")  # doctest: +SKIP
    """
    described = study if isinstance(study, Described) else load_study(study, laws_of(law))
    if seed is not None:
        search = described.study.search.model_copy(update={"seed": seed})
        described = replace(described, study=described.study.model_copy(update={"search": search}))
    lowered = lower_study(described, threads)
    store = RunStore.open(output, frozen_texts(described), resume=resume, what="calibration")
    solution = solve(lowered.problem, described.study.search, store, progress)
    ensemble = WeightedEnsemble(lowered, solution.fit.ensembles, solution.fit.weights, solution.discrepancy)
    rows = described.table.rows
    fitted = replace(ensemble, discrepancy=solution.fit.discrepancy)  # what is missed of rows that it knows
    parts = (fitted, lowered.trained), (ensemble, lowered.others)
    predicted = tuple(tuple(one.values()) for by, own in parts for one in by.predict([rows[n] for n in own]))
    result = Calibration(solution, ensemble, predicted, None if output is None else Path(output))
    if output is not None:
        result.write(output)
    return result
