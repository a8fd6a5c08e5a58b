"""How many unknowns the cells of a table determine, and how large the residuals of the best set are for that.

An unknown that a prior or its own bounds hold is no degree of freedom of a fit: it does not bend to the cells. The
number of unknowns that do is the trace of the hat matrix of the fit linearised about the best set,

    p = tr((G + L)^-1 G),   G = J^T J,

J the slopes of the pulls (residuals over tolerance and scatter) along the unknowns, and L what is known of them
beforehand (MacKay 1992, "well-determined parameters"). J comes from a linear regression over the visited sets of lowest
cost; what noise alone would give to G, the residual variance of the regression times (X^T X)^-1, is subtracted, for a
chaotic motion gives every regression some slope.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tarsus.base.arrays import Floats

if TYPE_CHECKING:
    from tarsus.calibrate.problem import HypothesisFit


SETS = 12
"""Sets for each coefficient of the regression: slopes are then known within a third of the scatter of the pulls, and a
third of a usual population's visits is enough for them."""
FEWEST = 2
"""With fewer sets for each coefficient nothing is regressed, and every unknown counts."""


def effective_unknowns(points: Floats, pulls: Floats, costs: Floats, precision: Floats) -> float:
    """Number of unknowns that cells determine, from visited points (n, nu), pulls (n, nc) and costs (n,) there, and
    what is known of each unknown beforehand, as 1 over its variance (nu,)."""
    nu = points.shape[1]
    chosen = np.argsort(costs, kind="stable")[: SETS * (nu + 1)]
    if len(chosen) < FEWEST * (nu + 1):
        return float(nu)
    x = points[chosen] - points[chosen].mean(axis=0)
    y = pulls[chosen] - pulls[chosen].mean(axis=0)
    inverse = np.linalg.pinv(x.T @ x)
    slopes = inverse @ (x.T @ y)
    noise = ((y - x @ slopes) ** 2).sum() / (len(chosen) - nu - 1)
    gram = slopes @ slopes.T - noise * inverse
    own = np.sqrt(precision)
    determined = np.linalg.eigvalsh(gram / np.outer(own, own)).clip(min=0.0)
    return float((determined / (1.0 + determined)).sum())


@dataclass(frozen=True)
class Freedom:
    """Degrees of freedom of a fit: cells with a weight, unknowns that they determine, misfit at the best set."""

    cells: int
    unknowns: float
    misfit: float

    @property
    def scale(self) -> float:
        """Squared residual scale: misfit over the degrees of freedom, which are cells less unknowns that they
        determine, but at least a quarter of the cells; at least 1."""
        return max(1.0, self.misfit / max(self.cells - self.unknowns, 0.25 * self.cells, 1.0))


def freedom_of_best(fits: Sequence[HypothesisFit], best: Mapping[int, float]) -> Freedom:
    """Degrees of freedom of the hypothesis with the lowest cost, by number, at its best set."""
    fit = fits[min(best, key=lambda one: (best[one], one))]
    points, readings = fit.archive.visited(fit.hypothesis.run)
    pieces = fit.pieces(readings)
    total = (fit.problem.residuals(pieces, points) ** 2).sum(axis=1)
    i, cells = int(np.argmin(total)), fit.problem.objective.cells
    counted = cells.known & (cells.weight > 0.0)
    unknowns = effective_unknowns(points, pieces.pull[:, counted], total, fit.unknowns.precision(points[i]))
    return Freedom(int(counted.sum()), unknowns, float(pieces.misfit[i].sum()))
