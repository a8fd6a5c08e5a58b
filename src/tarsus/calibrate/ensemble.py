"""What every search ends with, that of the whole table and each without a row: ensembles of the hypotheses that fit as
well as the best, thinned and weighted; and what the search without a row says of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import ceil
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from tarsus.base.arrays import Floats
from tarsus.calibrate.prediction import Discrepancy, Prediction, discrepancy_of, predict_row
from tarsus.calibrate.problem import Archive, CalibrationProblem, HypothesisFit
from tarsus.calibrate.search import LEVEL, WITHIN, SearchResult, search_hypotheses
from tarsus.fit.chain import MIXED
from tarsus.fit.ensemble import Ensemble, drawn_evenly
from tarsus.fit.ranges import FEWEST

if TYPE_CHECKING:
    from tarsus.calibrate.degrees import Freedom
    from tarsus.calibrate.description import Search
    from tarsus.calibrate.objective import Hypothesis


@dataclass(frozen=True)
class HypothesisEnsemble(Ensemble):
    """Members of a hypothesis, with their readings (nm, rows, channels, samples); doubt: why the search that found them
    was too short to say what is determined, empty where it was not."""

    hypothesis: Hypothesis
    readings: NDArray[np.floating]
    doubt: str = ""


def _doubt(found: SearchResult, scale: float, inside: int, spread: int) -> str:
    """Why a search was too short, and what it needs more of, by what it found, the visited sets inside the likelihood
    region and the generations of its chains; a residual scale is a likelihood ratio of 1.6, about what a chain sees of
    the hollow around a best set. Between chains variances fall as 1 over their generations: it needs so many times as
    many, and half of that again, for the mixing of one search scatters by a tenth or two."""
    if found.gained > scale:
        below = f"the generations of the ensemble came {found.gained / scale:.3g} residual scales below it"
        return f"{below}. Give it more generations"
    if inside < FEWEST:
        return f"{inside} of its sets lie in the likelihood region, {FEWEST} make an interval. Give it more generations"
    if found.mixing > MIXED:
        seen = f"the chains of the ensemble have not mixed (R-hat {found.mixing:.2f}, {MIXED} at most)"
        longer = 1.5 * spread * min((found.mixing**2 - 1.0) / (MIXED**2 - 1.0), 10.0)
        return f"{seen}. Give it a spread of about {ceil(longer / 10.0) * 10} (it had {spread})"
    return ""


def ensemble_of(fit: HypothesisFit, scale: float, search: Search, found: SearchResult) -> HypothesisEnsemble:
    """Up to as many members of a hypothesis as the search has.

    The best point, which weighs as one draw, and a sample of the states of its chain that lie inside the likelihood
    region, even in cost; one that is drawn several times weighs as often. Without a chain all visited points of the
    region are states, weighted by their likelihood.
    """
    points, costs = fit.costs_visited()
    best = int(np.argmin(costs))
    most = costs[best] + scale * chdtri(points.shape[1], 1.0 - LEVEL)
    inside = costs <= most
    cloud, share, order = points[inside], np.exp((costs[best] - costs[inside]) / (2.0 * scale)), costs[inside]
    if found.states is not None:
        cost = fit.cost_at(found.states)
        taken = cost <= most
        if taken.any():
            cloud, share, order = found.states[taken], np.ones(int(taken.sum())), cost[taken]
    places, times = np.unique(drawn_evenly(share, order, search.members - 1), return_counts=True)
    members = np.concatenate([points[best][None], cloud[places]])
    weights = np.concatenate([[1.0], times])
    readings = fit.archive.evaluate(fit.hypothesis.run, members)
    weights, doubt = weights / weights.sum(), _doubt(found, scale, int(inside.sum()), search.spread)
    return HypothesisEnsemble(members, weights, fit.cost_at(members), fit.hypothesis, readings, doubt)


def hypothesis_weights(ensembles: list[HypothesisEnsemble], scale: float) -> Floats:
    """Weights (nb,) of hypotheses by the likelihood of their best sets."""
    costs = np.array([one.best for one in ensembles])
    weights = np.exp((costs.min() - costs) / (2.0 * scale))
    return weights / weights.sum()


@dataclass(frozen=True)
class SearchedEnsembles:
    """Ensembles of the hypotheses that are kept, with weights (nb,), their numbers, degrees of freedom and discrepancy
    of the best set; what was found of every hypothesis; and how many sets were visited."""

    ensembles: tuple[HypothesisEnsemble, ...]
    weights: Floats
    kept: tuple[int, ...]
    freedom: Freedom
    discrepancy: Discrepancy
    found: Mapping[int, SearchResult]
    sets: int

    @property
    def best(self) -> HypothesisEnsemble:
        """Of the hypothesis with the lowest cost."""
        return min(self.ensembles, key=lambda one: one.best)


def searched_ensembles(archive: Archive, search: Search) -> SearchedEnsembles:
    """Search the problem of an empty archive, and make the ensembles of the hypotheses that are near the best."""
    problem = archive.problem
    found, freedom = search_hypotheses(archive, search)
    costs = {b: one.cost for b, one in found.items() if not one.rejected}
    kept = [b for b in costs if costs[b] <= min(costs.values()) + WITHIN * freedom.scale]
    fits = [HypothesisFit(archive, b) for b in kept]
    ensembles = [ensemble_of(one, freedom.scale, search, found[one.number]) for one in fits]
    best = int(np.argmin([one.best for one in ensembles]))
    own = fits[best].pieces(ensembles[best].readings[:1])
    missed = discrepancy_of(problem.objective.cells, own.missed[0], own.wrong[0], freedom.unknowns)
    weights = hypothesis_weights(ensembles, freedom.scale)
    return SearchedEnsembles(tuple(ensembles), weights, tuple(kept), freedom, missed, found, archive.sets)


@dataclass(frozen=True)
class ExcludedRow:
    """A row predicted without it.

    row: its place in the table's fitted rows; fit: what the search without it found; readings (nm, channels, samples)
    of each ensemble's members in the row; missed (nk,): weighted residuals there; wrong (nk,): probability of the
    wrong existence.
    """

    row: int
    fit: SearchedEnsembles
    readings: tuple[NDArray[np.floating], ...]
    missed: Floats
    wrong: Floats

    def predictions(
        self, problem: CalibrationProblem, discrepancy: Discrepancy | None = None
    ) -> tuple[Prediction, ...]:
        """Predictions of the row, ``problem`` being that of the whole table; with the fit's own discrepancy unless
        another is given."""
        cells, fit = problem.objective.cells, self.fit
        own = discrepancy or fit.discrepancy
        return predict_row(fit.ensembles, fit.weights, self.readings, cells, cells.absolute[self.row], own)


def exclude(
    problem: CalibrationProblem, search: Search, row: int, archive: Callable[[CalibrationProblem, int], Archive]
) -> ExcludedRow:
    """Search without a row of the table, and simulate it with what was found.

    Nothing of a row gets into its own prediction: the problem that is searched lacks its cells and its run, the archive
    is empty, the random numbers are its own, and the search is the whole one of the study.

    archive: makes an empty one of a problem, for the search of this number (`row` + 1; 0 is that of the whole table).
    """
    own = archive(problem.without(row), row + 1)
    fit = searched_ensembles(own, search)
    alone = problem.objective.only(row)
    readings, missed, wrong = [], np.zeros(alone.cells.observed.shape[1]), 0.0
    for weight, one in zip(fit.weights, fit.ensembles, strict=True):
        read = own.elsewhere(one.hypothesis.run, one.points, problem.rows[row])
        costs = alone.pieces(read[:, None], one.hypothesis)
        missed = missed + weight * (one.weights @ costs.missed[:, 0])
        wrong = wrong + weight * (one.weights @ costs.wrong[:, 0])
        readings.append(read)
    return ExcludedRow(row, fit, tuple(readings), missed, np.asarray(wrong))


def missed_by(problem: CalibrationProblem, found: list[ExcludedRow], row: int | None = None) -> Discrepancy:
    """Discrepancy from what each excluded row was missed by; those of a row itself stay out of its own prediction,
    which is so a test of what is said of new rows."""
    others = [one for one in found if one.row != row]
    missed, wrong = (np.array([getattr(one, name) for one in others]) for name in ("missed", "wrong"))
    return discrepancy_of(problem.objective.cells, missed, wrong, 0.0, fitted=False)
