"""Ensembles: the sets of a branch that fit as well as its best, thinned, weighted, and what they determine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from tarsus.calibrate.archive import Archive
from tarsus.calibrate.objective import Branch
from tarsus.calibrate.problem import Problem
from tarsus.calibrate.search import LEVEL, Chain, costs_at
from tarsus.fit import Unknowns
from tarsus.fit.verdict import cut_ends, determined

__all__ = ["Ensemble", "Range", "branch_weights", "ensemble_of", "ranges_of", "weighted_quantile"]

Floats = NDArray[np.float64]

PRIOR_KEPT = 0.6
"""An ensemble that keeps so much of the prior's spread tells nothing beyond it: the likelihood region cuts off a tenth
to a fifth of the spread, and a short chain may miss as much again."""


@dataclass(frozen=True)
class Ensemble:
    """Members of a branch, the best first: points (nm, nu) of the unit cube, weights (nm,) of sum 1, costs (nm,),
    readings (nm, rows, channels, samples), and how each was found."""

    branch: Branch
    points: Floats
    weights: Floats
    costs: Floats
    readings: NDArray[np.floating]
    found: tuple[str, ...] = ()

    @property
    def best(self) -> float:
        """Lowest cost."""
        return float(self.costs[0])


@dataclass(frozen=True)
class Range:
    """How far an unknown is determined [SI]: best value, 90 % and 95 % ranges of the ensemble, and a word."""

    name: str
    best: float
    low: float
    high: float
    interval: tuple[float, float]
    word: str


def weighted_quantile(values: Floats, weights: Floats, at: float) -> float:
    """Quantile of weighted values (n,): interpolated between the middles of their shares; NaN without values."""
    if len(values) == 0:
        return float("nan")
    order = np.argsort(values, kind="stable")
    share = weights[order] / weights.sum()
    return float(np.interp(at, np.cumsum(share) - 0.5 * share, values[order]))


def ensemble_of(
    problem: Problem,
    archive: Archive,
    branch: int,
    scale: float,
    count: int,
    states: Chain | None,
) -> Ensemble:
    """Up to ``count`` members of a branch.

    The best point, which weighs as one draw, and a sample of the states of the branch's chain that lie inside
    the likelihood region, even in cost; one that is drawn several times weighs as often. Without a chain all visited
    points of the region are states, weighted by their likelihood.
    """
    chosen = problem.branches[branch]
    points, costs = costs_at(problem, archive, branch)
    best = int(np.argmin(costs))
    inside = costs <= costs[best] + scale * chi2.ppf(LEVEL, points.shape[1])
    cloud, share, order = points[inside], np.exp((costs[best] - costs[inside]) / (2.0 * scale)), costs[inside]
    if states is not None:
        readings = archive.evaluate(chosen.run, states.states)
        cost = problem.total(problem.costs(readings, chosen), states.states)
        taken = cost <= costs[best] + scale * chi2.ppf(LEVEL, points.shape[1])
        if taken.any():
            cloud, share, order = states.states[taken], np.ones(int(taken.sum())), cost[taken]
    places, times = np.unique(drawn(share, order, count - 1), return_counts=True)
    members = np.concatenate([points[best][None], cloud[places]])
    weights = np.concatenate([[1.0], times])
    readings = archive.evaluate(chosen.run, members)
    cost = problem.total(problem.costs(readings, chosen), members)
    found = archive.found(chosen.run, members)
    return Ensemble(chosen, members, weights / weights.sum(), cost, readings, found)


def drawn(share: Floats, order: Floats, count: int) -> NDArray[np.intp]:
    """Places (count,) of a sample of weighted points: evenly along the shares (n,) of the points put in this order
    (n,), so that every stretch of the order is there as often as its share says."""
    rank = np.argsort(order, kind="stable")
    reached = np.cumsum(share[rank])
    at = (np.arange(count) + 0.5) / count * reached[-1]
    return rank[np.searchsorted(reached, at).clip(max=len(rank) - 1)]


def branch_weights(ensembles: list[Ensemble], scale: float) -> Floats:
    """Weights (nb,) of branches by the likelihood of their best sets."""
    costs = np.array([one.best for one in ensembles])
    weights = np.exp((costs.min() - costs) / (2.0 * scale))
    return weights / weights.sum()


def ranges_of(unknowns: Unknowns, ensemble: Ensemble) -> list[Range]:
    """How far each unknown is determined in a branch."""
    ranges = []
    for i, name in enumerate(unknowns.names):
        column = ensemble.points[:, i]

        def si(value: float, i: int = i) -> float:
            cube = np.zeros(len(unknowns))
            cube[i] = value
            return float(unknowns.values(cube)[i])

        q = {at: weighted_quantile(column, ensemble.weights, at) for at in (0.025, 0.05, 0.95, 0.975)}
        ends = min(q[0.025], column[0]), max(q[0.975], column[0])
        interval = si(ends[0]), si(ends[1])
        word = _word(unknowns, i, column, ensemble.weights, ends, interval)
        ranges.append(Range(name, si(column[0]), si(q[0.05]), si(q[0.95]), interval, word))
    return ranges


def _word(
    unknowns: Unknowns,
    i: int,
    column: Floats,
    weights: Floats,
    ends: tuple[float, float],
    interval: tuple[float, float],
) -> str:
    """What the data say of an unknown, from its values (nm,) and its 95 % interval, both in the cube, the latter in SI
    too: "prior only" where the spread is the prior's own, "at bound" where a bound of the search sets one end, and
    "not determined" where bounds set both; else whether the interval is narrow (`tarsus.fit.verdict`)."""
    prior = unknowns.priors[i]
    if prior is not None:
        cube = np.zeros((len(column), len(unknowns)))
        cube[:, i] = column
        values = unknowns.values(cube)[:, i]
        x = prior.offsets(values)
        spread = np.sqrt(np.average((x - np.average(x, weights=weights)) ** 2, weights=weights))
        if spread > PRIOR_KEPT:
            return "prior only"
    cut = cut_ends(*ends, (0.0, 1.0))
    if any(cut):
        return "not determined" if all(cut) else "at bound"
    return "determined" if determined(*interval, unknowns.sizes[i]) else "not determined"


def correlations(ensemble: Ensemble) -> Floats:
    """Weighted correlations (nu, nu) of the unknowns on their scales; zero where one does not vary."""
    off = ensemble.points - np.average(ensemble.points, axis=0, weights=ensemble.weights)
    covariance = (off * ensemble.weights[:, None]).T @ off
    spread = np.sqrt(np.diag(covariance))
    scale = np.outer(spread, spread)
    return np.divide(covariance, scale, out=np.zeros_like(covariance), where=scale > 0.0)
