"""What a landing is wanted to be while it is learned: its touchdown's speed, and what it may not give up for it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from tarsus.design.trials import Landings

Floats = NDArray[np.float64]

KEPT = 0.8
"""Least share of the plain step's contact and mean height that is kept: a foot that never lifts would land softest."""
TINY = 1e-30
"""What a measure of the plain step is at least, that others are compared with: beyond any motion, so that none is 0."""
LOST = 100.0
"""Score, in the plain step's speed, of a run that did not reach its end: worse than any that did."""


@dataclass(frozen=True)
class Target:
    """plain: what the plain step does on the nominal ground."""

    plain: Landings

    def scores(self, found: Landings) -> Floats:
        """Scores [m/s], always finite: the hardest touchdown, and once the plain step's and its excess for each thing
        given up: missing shares of contact and of height in the air."""
        contact, lift = (
            np.maximum(KEPT - getattr(found, name) / max(float(getattr(self.plain, name).flat[0]), TINY), 0.0)
            for name in ("contact", "lifted")
        )
        unit, excess = max(float(self.plain.speed.flat[0]), TINY), contact + lift
        score = found.speed + np.where(excess > 0.0, unit * (1.0 + excess), 0.0)
        return np.where(np.isfinite(score), score, LOST * unit)
