"""Ensembles: sets of unknowns that fit as well as the best one, with weights, and what they determine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats
from tarsus.fit.ranges import Range, weighted_quantile
from tarsus.fit.unknowns import Unknowns
from tarsus.fit.verdict import LEVEL, cut_ends, verdict_of


@dataclass(frozen=True)
class Ensemble:
    """Members, the best first: points (nm, nu) of the unit cube, weights (nm,) of sum 1, costs (nm,)."""

    points: Floats
    weights: Floats
    costs: Floats

    @property
    def best(self) -> float:
        """Lowest cost."""
        return float(self.costs[0])

    def ranges(self, unknowns: Unknowns, level: float = LEVEL, *, doubted: bool = False) -> tuple[Range, ...]:
        """How far each unknown is determined [SI]: the best value, the interval of the members between equal tails,
        which always holds the best, and the verdict; doubted: a check of what made the members has failed."""
        values = unknowns.values(self.points)
        out = []
        for i, name in enumerate(unknowns.names):
            column, own = self.points[:, i], values[:, i]
            tails = 0.5 - 0.5 * level, 0.5 + 0.5 * level
            low, high = (weighted_quantile(column, self.weights, at) for at in tails)
            ends = min(low, column[0]), max(high, column[0])
            both = np.repeat(self.points[:1], 2, axis=0)
            both[:, i] = ends
            interval = float(unknowns.values(both)[0, i]), float(unknowns.values(both)[1, i])
            prior, of_prior = unknowns.priors[i], 0.0
            if prior is not None:
                off = prior.offsets(own)
                of_prior = float(
                    np.sqrt(np.average((off - np.average(off, weights=self.weights)) ** 2, weights=self.weights))
                )
            cut, size = cut_ends(*ends, (0.0, 1.0)), unknowns.sizes[i]
            verdict = verdict_of(interval, cut, size=size, of_prior=of_prior, doubted=doubted)
            out.append(Range(float(own[0]), *interval, level, (), name, unknowns.units[i], verdict))
        return tuple(out)


def drawn_evenly(share: Floats, order: Floats, count: int) -> NDArray[np.intp]:
    """Places (count,) of a sample of weighted points: evenly along the shares (n,) of the points put in this order
    (n,), so that every stretch of the order is there as often as its share says."""
    rank = np.argsort(order, kind="stable")
    reached = np.cumsum(share[rank])
    at = (np.arange(count) + 0.5) / count * reached[-1]
    return rank[np.searchsorted(reached, at).clip(max=len(rank) - 1)]
