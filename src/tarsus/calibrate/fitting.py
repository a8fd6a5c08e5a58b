"""A problem searched to a mixture: what every search ends with, that of the whole table and each without a row."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.calibrate.archive import Archive
from tarsus.calibrate.degrees import Freedom
from tarsus.calibrate.description import Search
from tarsus.calibrate.ensemble import Ensemble, branch_weights, ensemble_of
from tarsus.calibrate.prediction import Discrepancy, Prediction, discrepancy_of, predict_row
from tarsus.calibrate.problem import Problem
from tarsus.calibrate.search import Found, search_branches

__all__ = ["Fit", "fitted"]

Floats = NDArray[np.float64]
Readings = NDArray[np.floating]


@dataclass(frozen=True)
class Fit:
    """A mixture of the branches that are kept: ensembles with weights (nb,), their numbers, degrees of freedom and
    discrepancy of the best set; what was found in every branch; and how many sets were visited."""

    ensembles: tuple[Ensemble, ...]
    weights: Floats
    kept: tuple[int, ...]
    freedom: Freedom
    discrepancy: Discrepancy
    found: Mapping[int, Found]
    sets: int

    @property
    def best(self) -> Ensemble:
        """Of the branch with the lowest cost."""
        return min(self.ensembles, key=lambda one: one.best)

    def predictions(
        self, problem: Problem, row: int, readings: Sequence[Readings], discrepancy: Discrepancy | None = None
    ) -> list[Prediction]:
        """Predictions of a row of ``problem``, fitted or left out, from the readings (nm, channels, samples) of each
        ensemble's members there; with the fit's own discrepancy unless another is given."""
        cells = problem.objective.cells
        return predict_row(
            self.ensembles, self.weights, readings, cells, cells.absolute[row], discrepancy or self.discrepancy,
            problem.peak, problem.resolution,
        )  # fmt: skip


def fitted(problem: Problem, archive: Archive, search: Search, part: int = 0) -> Fit:
    """Search a problem and make the ensembles of the branches that are near the best.

    archive: an empty one of this problem; part: see `search_branches`.
    """
    found, freedom = search_branches(problem, archive, search, part)
    costs = {b: one.cost for b, one in found.items() if not one.dropped}
    kept = [b for b in costs if costs[b] <= min(costs.values()) + search.within * freedom.scale]
    ensembles = [
        ensemble_of(problem, archive, b, freedom.scale, search.members, found[b].chain) for b in kept
    ]
    archive.ahead = 0
    best = min(ensembles, key=lambda one: one.best)
    own = problem.costs(best.readings[:1], best.branch)
    missed = discrepancy_of(problem.objective.cells, own.missed[0], own.wrong[0], freedom.unknowns)
    weights = branch_weights(ensembles, freedom.scale)
    return Fit(tuple(ensembles), weights, tuple(kept), freedom, missed, found, archive.visited)
