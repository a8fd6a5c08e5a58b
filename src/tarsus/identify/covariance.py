"""What scatters between groups of data, as draws of an estimate: the widest of all levels of groups.

Events of one file may have an error in common, and files of one set: a scatter between events that are taken for
independent then is too small. The finest level counts always, a coarser one where it scatters more than that leaves to
chance: few groups have few degrees of freedom, whose Student's factor would widen intervals where nothing is wrong.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri, fdtri

from tarsus.base.arrays import Floats
from tarsus.identify.draws import sandwich_draws, sandwich_root
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
    levels = [next(iter(influence.levels)), *_coarser(influence, prior)]
    return sandwich_draws([influence.at(one) for one in levels], seed, prior)


def scatter_over_noise(influence: Influence, prior: Floats | None = None) -> Floats:
    """Covariance (p, p) of an estimate [units of its numbers] from data whose noise is known: what noise leaves, and
    more where groups scatter more than noise, or a coarser level more than a finer one, has it by chance."""
    whole = influence.information.sum(axis=0)[None], influence.score.sum(axis=0)[None]
    finest, beyond = next(iter(influence.levels)), _coarser(influence, prior)
    levels = [finest, *beyond] if beyond or np.any(beyond_noise(influence, finest, prior)) else []
    root = sandwich_root([whole, *(influence.at(one) for one in levels)], prior)
    return root @ root.T


def _coarser(influence: Influence, prior: Floats | None) -> list[str]:
    """Levels that scatter more than the finest one leaves to chance, of all together."""
    finest, *coarser = influence.levels
    chance = CHANCE / max(len(coarser) * len(influence.paths), 1)
    return [one for one in coarser if np.any(beyond_chance(influence, finest, one, chance, prior))]


def _spread(influence: Influence, level: str, prior: Floats | None) -> tuple[Floats, Floats] | None:
    """Of each number (p,) how far groups of a level pull it apart over what noise leaves, and with how many degrees of
    freedom; None of too few groups."""
    share, pulls, variance = influence.pulls(level, prior)
    if len(share) < FEWEST:
        return None
    # groups alike have n - 1 degrees of freedom; where few have most of what is known there are as many as those
    freedom = np.maximum(share.sum(axis=0) ** 2 / np.sum(share**2, axis=0) - 1.0, 1.0)
    spread = np.sum((pulls - share * pulls.sum(axis=0)) ** 2, axis=0) / variance
    return spread * (1.0 + 1.0 / freedom), freedom


def beyond_chance(
    influence: Influence, finer: str, coarser: str, chance: float = CHANCE, prior: Floats | None = None
) -> NDArray[np.bool_]:
    """Of which numbers (p,) the groups of a level scatter more than those of a finer one have it by chance, with this
    probability."""
    fine, coarse = (_spread(influence, level, prior) for level in (finer, coarser))
    if fine is None or coarse is None:
        return np.zeros(len(influence.paths), dtype=bool)
    limit = fdtri(coarse[1], fine[1], 1.0 - chance)
    return np.asarray(coarse[0] > limit * fine[0], dtype=np.bool_)


def beyond_noise(influence: Influence, level: str, prior: Floats | None = None) -> NDArray[np.bool_]:
    """Of which numbers (p,) the groups of a level scatter more than their noise has it by chance, of all together."""
    found = _spread(influence, level, prior)
    if found is None:
        return np.zeros(len(influence.paths), dtype=bool)
    limit = chdtri(found[1], CHANCE / len(influence.paths)) / found[1]
    return np.asarray(found[0] > limit, dtype=np.bool_)
