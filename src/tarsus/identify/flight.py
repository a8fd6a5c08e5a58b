"""Free flights of a foot's model near the ground; see `tarsus.solve.flights`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.identify.foot import FootModel
from tarsus.solve.flights import SUBSTEPS, Flow, Launches, Varied

__all__ = ["SUBSTEPS", "FilmConstants", "Flow", "Launches", "Varied", "from_rest", "observed", "of_model"]

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class FilmConstants:
    """Film coefficient C [N m^2 s] and thickness g0 [m]."""

    coefficient: float
    thickness: float

    def column(self, count: int, *, by_log: tuple[Floats, Floats] | None = None) -> Varied:
        """As so many flights (N, 4) feel it, without an attraction; by_log (q,): derivatives of the logarithms of C and
        g0 by q unknowns."""
        own = np.array([self.coefficient, self.thickness, 0.0, 1.0])
        slopes = None
        if by_log is not None:
            rates = np.concatenate([own[:2, None] * np.array(by_log), np.zeros((2, len(by_log[0])))])
            slopes = np.tile(rates, (count, 1, 1))
        return Varied(np.tile(own, (count, 1)), slopes)


def of_model(model: FootModel, step: float) -> Flow:
    """Steps of a model's free flights, of so many seconds."""
    return Flow(model.flow, model.inputs, model.row, step)


def observed(model: FootModel) -> Floats:
    """Displacements and velocities of the points (2 np, 2n) from states."""
    points, n = model.rows.shape
    out = np.zeros((2 * points, 2 * n))
    out[:points, :n] = out[points:, n:] = model.rows
    return out


def from_rest(state: Floats, film: Varied, neutral: Floats) -> Launches:
    """N flights that begin at their first samples in states (N, 2n), at gaps where x = 0 (N,) [m]."""
    count = len(state)
    none, two = np.zeros(count), np.zeros((count, 2))
    return Launches(Varied(state), Varied(none), Varied(two), film, neutral, two, 1.0)
