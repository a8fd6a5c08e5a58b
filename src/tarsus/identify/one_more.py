"""One more unknown as a hypothesis, scored on groups of data that it was not fitted to.

About an estimate the data of every group have an information ``A_g`` and a score ``s_g`` over the unknowns of the model
and one more, last. With and without that one the unknowns are fitted to every second group, and judged by the
chi-squared ``-2 x's + x'A x`` of the others, both ways round. Half of the gain is the logarithm of the likelihood ratio
by which both are weighed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats
from tarsus.fit.verdict import LEVEL
from tarsus.identify.draws import newton_draws

_TOLD = 1e12
"""Condition of the scaled information beyond which it is rounding: data that do not feel an unknown say nothing."""
FEWEST = 4
"""Groups that are needed: two to fit and two to judge."""


@dataclass(frozen=True)
class OneMore:
    """value and standard error of the unknown, as groups scatter; gain: in chi-squared of groups left out, over what
    they scatter beyond noise; moves (p,): of the others with it."""

    value: float
    error: float
    gain: float
    moves: Floats

    @property
    def weight(self) -> float:
        """Share of the hypothesis."""
        return float(1.0 / (1.0 + np.exp(-0.5 * np.clip(self.gain, -700.0, 700.0))))

    @property
    def decided(self) -> bool:
        """Whether nearly all of the weight is on one side."""
        return max(self.weight, 1.0 - self.weight) >= LEVEL

    def picked(self, draws: int, seed: int) -> NDArray[np.bool_]:
        """Draws (draws,) that are made under the hypothesis: its share of them, none where that is next to nothing."""
        if self.weight <= 1.0 - LEVEL:
            return np.zeros(draws, dtype=bool)
        return np.random.default_rng([seed, 23]).random(draws) < self.weight


def one_more(information: Floats, score: Floats, seed: int, value: float | None = None) -> OneMore | None:
    """Judge the last unknown; None of fewer than four groups, or of data that do not feel it.

    Parameters
    ----------
    information, score
        Of each group about the estimate without it, (g, p + 1, p + 1) and (g, p + 1), over the noise.
    seed
        Of the draws that tell its error.
    value
        That it has under the hypothesis; None where the data set it.
    """
    if len(score) < FEWEST:
        return None
    total = information.sum(axis=0)
    size = np.sqrt(np.diag(total))
    if not size.all() or np.linalg.cond(total / np.outer(size, size)) > _TOLD:
        return None
    whole = np.linalg.solve(total, score.sum(axis=0))
    # about the fit with it: without, what it explains would count as scatter
    error = float(np.std(newton_draws([(information, score - information @ whole)], seed)[:, -1]))
    gain = 0.0
    for h in (0, 1):
        seen = np.arange(len(score)) % 2 == h
        (a, b), (s, t) = ((x[seen].sum(axis=0), x[~seen].sum(axis=0)) for x in (information, score))
        free = np.linalg.solve(a, s) if value is None else _beside(a, s, value)
        for sign, own in ((1.0, free), (-1.0, _beside(a, s, 0.0))):
            gain += sign * float(2.0 * own @ t - own @ b @ own)
    # groups whose data hang together count for less, as the scatter of their scores says
    scale = max(error**2 / float(np.linalg.inv(total)[-1, -1]), 1.0)
    moves = -np.linalg.solve(total[:-1, :-1], total[:-1, -1]) * (whole[-1] if value is None else value)
    return OneMore(float(whole[-1]), error, gain / scale, moves)


def _beside(information: Floats, score: Floats, value: float) -> Floats:
    """All unknowns with the last one held at a value."""
    own = np.linalg.solve(information[:-1, :-1], score[:-1] - information[:-1, -1] * value)
    return np.append(own, value)
