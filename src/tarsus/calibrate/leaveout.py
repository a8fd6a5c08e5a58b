"""Leave one row out: refit without it, predict it, compare."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.calibrate.archive import Archive
from tarsus.calibrate.degrees import Freedom, freedom_of_best
from tarsus.calibrate.description import Search
from tarsus.calibrate.ensemble import Ensemble, branch_weights, ensemble_of
from tarsus.calibrate.prediction import Discrepancy, Prediction, discrepancy_of, predict_row
from tarsus.calibrate.problem import Problem
from tarsus.calibrate.search import LEAVE_OUT, best_freedom, chain, costs_at, evolve, start_of

__all__ = ["Fit", "fit_of", "leave_out", "predictions_at"]

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Fit:
    """A mixture: ensembles with weights (nb,), degrees of freedom and discrepancy of its best set."""

    ensembles: tuple[Ensemble, ...]
    weights: Floats
    freedom: Freedom
    discrepancy: Discrepancy


def fit_of(problem: Problem, ensembles: list[Ensemble], freedom: Freedom, without: int | None = None) -> Fit:
    """A mixture of ensembles; residuals are those of the best set, without those of a row left out."""
    weights = branch_weights(ensembles, freedom.scale)
    best = ensembles[int(np.argmin([one.best for one in ensembles]))]
    costs = problem.costs(best.readings[:1], best.branch)
    residuals, wrong = costs.missed[0].copy(), costs.wrong[0].copy()
    if without is not None:
        residuals[without], wrong[without] = np.nan, np.nan
    found = discrepancy_of(problem.objective.cells, residuals, wrong, freedom.unknowns)
    return Fit(tuple(ensembles), weights, freedom, found)


def predictions_at(problem: Problem, fit: Fit, row: int) -> list[Prediction]:
    """Predictions of a simulated row of the table."""
    cells = problem.objective.cells
    readings = [one.readings[:, row] for one in fit.ensembles]
    return predict_row(
        fit.ensembles, fit.weights, readings, cells, cells.absolute[row], fit.discrepancy, problem.peak,
        problem.resolution,
    )  # fmt: skip


def leave_out(problem: Problem, archive: Archive, search: Search, branches: list[int], row: int) -> Fit:
    """The mixture refitted without a row of the table.

    In every branch: differential evolution on the cost without that row, from a population of which one half are the
    best of the first, even spread of sets (which no row has drawn anywhere) and the other half is spread over the
    visited sets that are likely without the row; then chains on the same cost.
    """
    size = search.leave_out_population
    for b in branches:
        rng = np.random.default_rng([search.seed, LEAVE_OUT, row, b])
        points, costs = costs_at(problem, archive, b, row)
        scale = freedom_of_best(problem, archive, b, row).scale
        first = slice(0, search.screening)
        even = points[first][np.argsort(costs[first], kind="stable")[: size // 2]]
        likely = start_of(points, costs, size - len(even), scale * 2.0 * points.shape[1])
        evolve(problem, archive, b, np.concatenate([even, likely]), search.leave_out, rng, row)
    best = {b: float(costs_at(problem, archive, b, row)[1].min()) for b in branches}
    freedom = best_freedom(problem, archive, best, row)
    scale = freedom.scale
    near = [b for b in branches if best[b] <= min(best.values()) + search.within * scale]
    ensembles = []
    for b in near:
        rng = np.random.default_rng([search.seed, LEAVE_OUT, row, b, 1])
        states = chain(problem, archive, b, search.leave_out, scale, size, rng, row)
        ensembles.append(ensemble_of(problem, archive, b, scale, search.members, states, row))
    return fit_of(problem, ensembles, freedom, row)
