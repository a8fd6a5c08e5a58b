"""What scatters between groups of data, as draws of an estimate: the widest of all levels of groups.

Events of one file may have an error in common, and files of one set: a scatter between events that are taken for
independent then is too small. The finest level counts always, a coarser one where it scatters more than that leaves to
chance: few groups have few degrees of freedom, whose Student's factor would widen intervals where nothing is wrong.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as f_distribution

from tarsus.base.arrays import Floats
from tarsus.identify.draws import newton_draws
from tarsus.identify.influence import Influence

FEWEST = 3
"""Groups of a level from which on their scatter is taken: two have one degree of freedom, and a 95 % quantile of
thirteen deviations."""
CHANCE = 0.05
"""Probability up to which any coarser level of an estimate scatters more than a finer one by chance, in any of its
numbers: of one in twenty sound estimates intervals are then wider than they need be."""


def scattered(influence: Influence, seed: int, prior: Floats | None = None) -> Floats:
    """Deviations (draws, p) of an estimate [units of its numbers], as groups of its data scatter.

    Parameters
    ----------
    influence
        Parts of the data about the estimate.
    seed
        Of the draws.
    prior
        Information (p, p) that was known beforehand.
    """
    finest, *coarser = influence.levels
    chance = CHANCE / max(len(coarser) * len(influence.paths), 1)
    levels = [
        finest,
        *(one for one in coarser if np.any(beyond_chance(influence, finest, one, chance, prior))),
    ]
    return newton_draws([influence.at(one) for one in levels], seed, prior)


def beyond_chance(
    influence: Influence, finer: str, coarser: str, chance: float = CHANCE, prior: Floats | None = None
) -> NDArray[np.bool_]:
    """Of which numbers (p,) the groups of a level scatter more than those of a finer one have it by chance, with this
    probability."""
    variances, freedoms = [], []
    for level in (finer, coarser):
        share, pulls, variance = influence.pulls(level, prior)
        if len(share) < FEWEST:
            return np.zeros(len(influence.paths), dtype=bool)
        # groups alike have n - 1 degrees of freedom; where few have most of what is known there are as many as those
        freedoms.append(np.maximum(share.sum(axis=0) ** 2 / np.sum(share**2, axis=0) - 1.0, 1.0))
        spread = np.sum((pulls - share * pulls.sum(axis=0)) ** 2, axis=0) / variance
        variances.append(spread * (1.0 + 1.0 / freedoms[-1]))
    return np.asarray(
        variances[1] > f_distribution.isf(chance, freedoms[1], freedoms[0]) * variances[0], dtype=np.bool_
    )
