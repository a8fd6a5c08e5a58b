"""What a landing is wanted to be: its measure, and what it may not give up for it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from tarsus.design.trials import Landings

Floats = NDArray[np.float64]

TIE = 1e-4
"""Of designs that differ by less than this share of the plain step's measure for each touchdown, that with fewer
touchdowns is taken: it lies far below what any instrument tells."""
TINY = 1e-30
"""What a measure of the plain step is at least, that others are compared with: beyond any motion, so that none is 0."""
LOST = 100.0
"""Score, in the plain step's measure, of a run that did not reach its end: worse than any that did."""


class LandingObjective(Enum):
    """What is minimised. The value is a word for it."""

    SPEED = "speed"
    """Speed of the hardest touchdown of the period [m/s]."""
    IMPULSE = "impulse"
    """Largest impulse of a touchdown [N s]."""
    TOUCHDOWNS = "touchdowns"
    """Number of touchdowns a step, and among equal numbers the speed."""


@dataclass(frozen=True)
class Target:
    """objective; plain: what the plain step does on the nominal ground; contact: least share of its contact; lift:
    least share of its mean height in the air; ringing: greatest overshoot of the highest gap over the mean gap in the
    air, as a share of it (1: twice as high), or None for any."""

    objective: LandingObjective
    plain: Landings
    contact: float = 0.8
    lift: float = 0.8
    ringing: float | None = None

    @property
    def unit(self) -> float:
        """The plain step's measure, that scores are compared with."""
        return max(float(self.measure(self.plain).flat[0]), TINY)

    def measure(self, found: Landings) -> Floats:
        """What is minimised, of any shape."""
        if self.objective is LandingObjective.IMPULSE:
            return found.impulse
        if self.objective is LandingObjective.TOUCHDOWNS:
            fastest = max(float(self.plain.speed.flat[0]), TINY)
            return found.touchdowns + 0.5 * np.minimum(found.speed / fastest, 1.0)
        return found.speed

    def scores(self, found: Landings) -> Floats:
        """Scores of the measure's unit and shape, always finite: the measure, and once the plain step's measure and its
        excess for each thing given up."""
        excess = self.excess(found)
        score = self.measure(found) + TIE * self.unit * found.touchdowns
        score = score + np.where(excess > 0.0, self.unit * (1.0 + excess), 0.0)
        return np.where(np.isfinite(score), score, LOST * self.unit)

    def excess(self, found: Landings) -> Floats:
        """By how much the step is given up: missing shares of contact and lift, and overshoot beyond its limit."""
        contact = self.contact - found.contact / max(float(self.plain.contact.flat[0]), TINY)
        lift = self.lift - found.lifted / max(float(self.plain.lifted.flat[0]), TINY)
        total = np.maximum(contact, 0.0) + np.maximum(lift, 0.0)
        if self.ringing is not None:
            over = found.peak / np.maximum(found.lifted, TINY) - 1.0 - self.ringing
            total = total + np.maximum(over, 0.0)
        return total
