"""Calibrates: search, ensembles, rows left out, predictions, all into a folder that survives being killed."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tarsus.base.workers import Workers
from tarsus.calibrate.archive import Archive
from tarsus.calibrate.description import Search
from tarsus.calibrate.ensemble import Ensemble, Range, correlations, determined, ensemble_of
from tarsus.calibrate.leaveout import Fit, fit_of, leave_out, predictions_at
from tarsus.calibrate.lowering import Lowered, lower_study
from tarsus.calibrate.prediction import Discrepancy, Prediction, discrepancy_of, predict_row
from tarsus.calibrate.problem import Problem
from tarsus.calibrate.search import Found, budget, search_branches
from tarsus.calibrate.shown import calibration_html
from tarsus.calibrate.studyfile import Described, frozen_texts, load_study
from tarsus.files.store import package_version
from tarsus.files.sweepstore import SweepStore
from tarsus.model.laws import Law
from tarsus.plan.lowering import source_hash

__all__ = ["Calibrated", "Solution", "calibrate", "solve"]

Floats = NDArray[np.float64]
Progress = Callable[[int, int, str], None]


@dataclass(frozen=True)
class Solution:
    """A problem solved.

    found: what the search found, by branch; fit: the mixture of the branches that are kept; kept: their numbers; ranges
    and correlations of the unknowns in each; trained: predictions of the fitted rows by the mixture; left_out: those by
    refits that lacked the row, None where none were made; discrepancy: for new rows; sets: how many were visited.
    """

    problem: Problem
    found: Mapping[int, Found]
    fit: Fit
    kept: tuple[int, ...]
    ranges: tuple[tuple[Range, ...], ...]
    correlations: tuple[Floats, ...]
    trained: tuple[tuple[Prediction, ...], ...]
    left_out: tuple[tuple[Prediction, ...], ...] | None
    discrepancy: Discrepancy
    sets: int

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


def solve(
    problem: Problem, search: Search, store: SweepStore | None = None, progress: Progress | None = None
) -> Solution:
    """Search a problem, make its ensembles, and leave each row out once.

    Parameters
    ----------
    problem
        What is searched.
    search
        How long.
    store
        Where visited sets are kept, so that a killed search goes on from there.
    progress
        Called as ``progress(sets done, most sets, what)``.
    """
    done, total = 0, budget(problem, search)
    stage = "search"

    def on_sets(count: int) -> None:
        nonlocal done
        done += count
        if progress is not None:
            progress(min(done, total), total, stage)

    archive = Archive(problem, store, on_sets)
    found, freedom = search_branches(problem, archive, search)
    scale = freedom.scale
    costs = {b: one.cost for b, one in found.items() if not one.dropped}
    near = [b for b in costs if costs[b] <= min(costs.values()) + search.within * scale]
    ensembles = [ensemble_of(problem, archive, b, scale, search.members, found[b].chain) for b in near]
    fit = fit_of(problem, ensembles, freedom)
    rows = range(problem.trained)
    trained = tuple(tuple(predictions_at(problem, fit, row)) for row in rows)
    left = None
    discrepancy = fit.discrepancy
    if search.leave_out and problem.trained > 1:
        fits = []
        for row in rows:
            stage = f"without {problem.labels[row]}"
            fits.append(leave_out(problem, archive, search, near, row))
        residuals, wrong = _left_out_residuals(problem, fits)
        if problem.trained >= ENOUGH_ROWS:
            discrepancy = _left_out_discrepancy(problem, residuals, wrong)
            others = [_left_out_discrepancy(problem, residuals, wrong, row) for row in rows]
            fits = [replace(one, discrepancy=found) for one, found in zip(fits, others, strict=True)]
        left = tuple(tuple(predictions_at(problem, one, row)) for row, one in zip(rows, fits, strict=True))
    return Solution(
        problem, found, fit, tuple(near),
        tuple(tuple(determined(problem.unknowns, one)) for one in ensembles),
        tuple(correlations(one) for one in ensembles), trained, left, discrepancy, _visited(problem, archive),
    )  # fmt: skip


def _visited(problem: Problem, archive: Archive) -> int:
    return sum(len(archive.points(run)[0]) for run in {branch.run for branch in problem.branches})


def _left_out_residuals(problem: Problem, fits: list[Fit]) -> tuple[Floats, Floats]:
    """Residuals (nr, nk) of each row under the mixture refitted without it; probabilities of the wrong existence."""
    shape = problem.objective.cells.observed.shape
    residuals, wrong = np.full(shape, np.nan), np.full(shape, np.nan)
    for row, fit in enumerate(fits):
        z, w = np.zeros(shape[1]), np.zeros(shape[1])
        for weight, one in zip(fit.weights, fit.ensembles, strict=True):
            costs = problem.costs(one.readings, one.branch)
            z = z + weight * (one.weights @ costs.missed[:, row])
            w = w + weight * (one.weights @ costs.wrong[:, row])
        residuals[row], wrong[row] = z, w
    return residuals, wrong


def _left_out_discrepancy(
    problem: Problem, residuals: Floats, wrong: Floats, without: int | None = None
) -> Discrepancy:
    """Discrepancy from left-out residuals; those of a row itself stay out of its own prediction, which is so a test of
    what is said of new rows."""
    others = np.arange(len(residuals)) != (-1 if without is None else without)
    return discrepancy_of(problem.objective.cells, residuals[others], wrong[others], 0.0, fitted=False)


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
    store = (
        None
        if out is None
        else SweepStore.open(Path(out), _digest(texts), 0, texts, resume=resume, what="calibration")
    )
    solution = solve(lowered.problem, described.study.search, store, progress)
    result = Calibrated(
        described, lowered, solution, other_rows(lowered, solution), None if out is None else Path(out)
    )
    if out is not None:
        from tarsus.calibrate.outputs import write_outputs

        write_outputs(result, Path(out))
    return result


def _digest(texts: Mapping[str, str]) -> str:
    """Digest of all that a result depends on: study, scene, table, version and engine."""
    digest = hashlib.sha256()
    for text in (*texts.values(), package_version(), source_hash()):
        digest.update(text.encode() + b"\0")
    return digest.hexdigest()


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
    return lowered.forward(ensemble.branch.run, lowered.problem.unknowns.at(ensemble.points), rows)
