"""What an optimiser sees of a fit: residuals with their Jacobian, a cost with its gradient, bounds.

Points are those of the *cube*: every unknown runs from 0 at its lower bound to 1 at its upper one (`Unknowns`).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from tarsus.base.arrays import Floats
from tarsus.fit.uncertainty import Uncertainty, uncertainty_of
from tarsus.solve import ResultCode

if TYPE_CHECKING:
    from tarsus.fit.unknowns import Unknowns
    from tarsus.solve import Batch


FAILED = 1e3
"""Residual of what a run does not have, or did not reach its end for: beyond every other, and finite, so that a search
can go on."""


STEP = 1e-4
"""Step of differences of runs in the cube: central ones err by the square of it, and by the runs' accuracy over it,
which at that of single runs is 1e-6 of a residual."""


class RunsTried:
    """How the runs of a fit ended: how many there were, and by code how many did not reach their end."""

    def __init__(self) -> None:
        self.count, self.stopped = 0, Counter[ResultCode]()

    def note(self, batch: Batch) -> None:
        """Count the runs of a batch."""
        self.count += len(batch)
        self.stopped.update(code for code in batch.codes if code is not ResultCode.DONE)

    def sentence(self) -> str | None:
        """How many did not reach their end, and why; None where all did."""
        if not self.stopped:
            return None
        why = ", ".join(f"{count} {code.name}" for code, count in self.stopped.most_common())
        return f"{self.stopped.total()} of {self.count} runs did not reach their end ({why})"


class Residuals(ABC):
    """A cost ``sum(residuals^2) / 2`` of nu unknowns in the unit cube."""

    unknowns: Unknowns

    @abstractmethod
    def residuals_at(self, points: Floats) -> Floats:
        """Residuals (n, nr) at points (n, nu) of the cube, all in one batch."""

    def jacobian(self, x: ArrayLike) -> Floats:
        """Derivatives (nr, nu) of the residuals at a point (nu,) of the cube: central differences of runs in one batch,
        at a side of the cube to the inner one."""
        at = self.point(x)
        steps = STEP * np.eye(len(at))
        ahead, behind = np.minimum(at + steps, 1.0), np.maximum(at - steps, 0.0)
        rows = self.residuals_at(np.concatenate([ahead, behind]))
        return ((rows[: len(at)] - rows[len(at) :]) / (ahead - behind).sum(axis=1)[:, None]).T

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """Lower and upper bounds (nu,) of the points: those of the cube."""
        return np.zeros(len(self.unknowns)), np.ones(len(self.unknowns))

    def residuals(self, x: ArrayLike) -> Floats:
        """Residuals (nr,) at a point (nu,) of the cube."""
        return self.residuals_at(self.point(x)[None])[0]

    def costs(self, points: ArrayLike) -> Floats:
        """Costs (n,) at points (n, nu) of the cube, all in one batch."""
        many = np.asarray(points, dtype=float)
        return 0.5 * (self.residuals_at(many) ** 2).sum(axis=1)

    def cost(self, x: ArrayLike) -> float:
        """Cost at a point (nu,) of the cube."""
        return float(self.costs(self.point(x)[None])[0])

    def gradient(self, x: ArrayLike) -> Floats:
        """Gradient (nu,) of the cost at a point (nu,) of the cube."""
        at = self.point(x)
        return self.residuals(at) @ self.jacobian(at)

    def uncertainty(self, x: ArrayLike) -> Uncertainty:
        """Standard errors [SI] and correlations (nu, nu) at a point (nu,) of the cube, from the Jacobian there."""
        at = self.point(x)
        return uncertainty_of(self.jacobian(at), self.unknowns, at)

    def point(self, x: ArrayLike | None) -> Floats:
        """A point (nu,) as floats within the cube; its middle where none is given."""
        return np.clip(np.full(len(self.unknowns), 0.5) if x is None else np.asarray(x, dtype=float), 0.0, 1.0)

    def values(self, x: ArrayLike) -> dict[str, float]:
        """SI values by name at a point (nu,) of the cube."""
        return self.unknowns.by_name(self.point(x))


@dataclass(frozen=True)
class Found:
    """What an optimiser found.

    x (nu,): the point in the cube; values: its SI values by name; cost there; evaluations: points that it asked for;
    slopes: points at which it asked for derivatives; message: why it stopped, in its own words; uncertainty: standard
    errors and correlations there, of optimisers that have the Jacobian (`Residuals.uncertainty` gives them anywhere).
    """

    x: Floats
    values: dict[str, float]
    cost: float
    evaluations: int
    slopes: int
    message: str
    uncertainty: Uncertainty | None = None
