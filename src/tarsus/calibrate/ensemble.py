"""Ensembles: the sets of a branch that fit as well as its best, thinned, weighted, and what they determine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from tarsus.calibrate.archive import Archive
from tarsus.calibrate.objective import Branch
from tarsus.calibrate.problem import Problem, Unknowns
from tarsus.calibrate.search import LEVEL, Chain, costs_at, spread_over

__all__ = ["Ensemble", "Range", "branch_weights", "determined", "ensemble_of", "weighted_quantile"]

Floats = NDArray[np.float64]

HALF = 0.5
"""An unknown whose 90 % range is less than half of its bounds is determined: the data said more than the bounds did."""
AT_BOUND = 0.02
"""A range that comes so near a bound, in parts of the bounds' span, is at the bound."""
PRIOR_KEPT = 0.8
"""An ensemble that keeps so much of the prior's spread tells nothing beyond it."""


@dataclass(frozen=True)
class Ensemble:
    """Members of a branch, the best first: points (nm, nu) of the unit cube, weights (nm,) of sum 1, costs (nm,),
    readings (nm, rows, channels, samples)."""

    branch: Branch
    points: Floats
    weights: Floats
    costs: Floats
    readings: NDArray[np.floating]

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
    without: int | None = None,
) -> Ensemble:
    """Up to ``count`` members of a branch.

    The states of its chain that lie inside the likelihood region, thinned so that each member is as far as can be from
    the others; a member's weight is the share of the states nearest to it. Without a chain all visited points of the
    region are states, weighted by their likelihood. The best point is always the first member.
    """
    chosen = problem.branches[branch]
    points, costs = costs_at(problem, archive, branch, without)
    best = int(np.argmin(costs))
    inside = costs <= costs[best] + scale * chi2.ppf(LEVEL, points.shape[1])
    if states is None:
        cloud, share = points[inside], np.exp((costs[best] - costs[inside]) / (2.0 * scale))
    else:
        readings = archive.evaluate(chosen.run, states.states)
        cost = problem.total(problem.costs(readings, chosen), states.states, without)
        taken = cost <= costs[best] + scale * chi2.ppf(LEVEL, points.shape[1])
        cloud, share = states.states[taken], np.ones(int(taken.sum()))
    pool = np.concatenate([points[best][None], cloud])
    share = np.concatenate([[1e-9 if len(cloud) else 1.0], share])
    members = pool[medoids(pool, share, spread_over(pool, count))]
    nearest = _nearest(pool, members)
    weights = np.bincount(nearest, weights=share, minlength=len(members))
    readings = archive.evaluate(chosen.run, members)
    cost = problem.total(problem.costs(readings, chosen), members, without)
    return Ensemble(chosen, members, weights / weights.sum(), cost, readings)


def medoids(points: Floats, share: Floats, centres: list[int]) -> list[int]:
    """Places of one point for each of the centres: of the points (n, nu) nearest to a centre the one that is nearest to
    their mean, weighted with ``share`` (n,). The first stays.

    Points that are far apart lie on the edge of a cloud; those in the middle of what they stand for do not.
    """
    nearest = _nearest(points, points[centres])
    chosen = [centres[0]]
    for place in range(1, len(centres)):
        own = np.flatnonzero(nearest == place)
        middle = np.average(points[own], axis=0, weights=share[own])
        chosen.append(int(own[np.argmin(np.linalg.norm(points[own] - middle, axis=1))]))
    return chosen


def _nearest(points: Floats, centres: Floats) -> NDArray[np.intp]:
    """Place of the nearest centre of each point."""
    return np.argmin(np.linalg.norm(points[:, None] - centres[None], axis=-1), axis=1)


def branch_weights(ensembles: list[Ensemble], scale: float) -> Floats:
    """Weights (nb,) of branches by the likelihood of their best sets."""
    costs = np.array([one.best for one in ensembles])
    weights = np.exp((costs.min() - costs) / (2.0 * scale))
    return weights / weights.sum()


def determined(unknowns: Unknowns, ensemble: Ensemble) -> list[Range]:
    """How far each unknown is determined in a branch."""
    ranges = []
    for i, name in enumerate(unknowns.names):
        column = ensemble.points[:, i]

        def si(value: float, i: int = i) -> float:
            cube = np.zeros(len(unknowns))
            cube[i] = value
            return float(unknowns.values(cube)[i])

        q = {at: weighted_quantile(column, ensemble.weights, at) for at in (0.025, 0.05, 0.95, 0.975)}
        ranges.append(
            Range(
                name, si(column[0]), si(q[0.05]), si(q[0.95]), (si(min(q[0.025], column[0])), si(max(q[0.975],
                column[0]))), _word(unknowns, i, column, ensemble.weights, q[0.05], q[0.95]),
            )
        )  # fmt: skip
    return ranges


def _word(unknowns: Unknowns, i: int, column: Floats, weights: Floats, low: float, high: float) -> str:
    prior = unknowns.priors[i]
    if prior is not None:
        cube = np.zeros((len(column), len(unknowns)))
        cube[:, i] = column
        values = unknowns.values(cube)[:, i]
        x = np.log(values) if prior.factor else values
        spread = np.sqrt(np.average((x - np.average(x, weights=weights)) ** 2, weights=weights))
        if spread > PRIOR_KEPT * (np.log(prior.spread) if prior.factor else prior.spread):
            return "prior only"
    if high - low >= HALF:
        return "not determined"
    return "at bound" if low <= AT_BOUND or high >= 1.0 - AT_BOUND else "determined"


def correlations(ensemble: Ensemble) -> Floats:
    """Weighted correlations (nu, nu) of the unknowns on their scales; zero where one does not vary."""
    off = ensemble.points - np.average(ensemble.points, axis=0, weights=ensemble.weights)
    covariance = (off * ensemble.weights[:, None]).T @ off
    spread = np.sqrt(np.diag(covariance))
    scale = np.outer(spread, spread)
    return np.divide(covariance, scale, out=np.zeros_like(covariance), where=scale > 0.0)
