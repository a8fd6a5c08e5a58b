"""scipy's optimisers on a fit: quasi-Newton with its gradient, differential evolution without derivatives."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import optimize

from tarsus.fit.residuals import Found, Residuals


def minimize(problem: Residuals, start: ArrayLike | None = None, **options: Any) -> Found:
    """`scipy.optimize.minimize` of the cost with its gradient, within its bounds: L-BFGS-B unless the options name
    another method. start (nu,): point of the unit cube of the unknowns, its middle unless given.

    Returns
    -------
    Found
        The point, its values [SI] and its cost.
    """
    chosen = {"method": "L-BFGS-B", "bounds": _bounds(problem), **options}
    found = optimize.minimize(problem.cost, problem.point(start), jac=problem.gradient, **chosen)
    x = problem.point(found.x)
    slopes = int(found.get("njev", 0))
    return Found(x, problem.values(x), float(found.fun), int(found.nfev), slopes, str(found.message))


def differential_evolution(problem: Residuals, **options: Any) -> Found:
    """`scipy.optimize.differential_evolution` of the cost, a whole generation in one batch; no derivatives.

    Returns
    -------
    Found
        The point, its values [SI] and its cost.
    """
    chosen = {"polish": False, "updating": "deferred", **options}
    asked = 0

    def costs(columns: np.ndarray) -> np.ndarray:
        nonlocal asked
        points = np.atleast_2d(columns.T)
        asked += len(points)
        return problem.costs(points)

    found = optimize.differential_evolution(costs, _bounds(problem), vectorized=True, **chosen)
    x = problem.point(found.x)
    return Found(x, problem.values(x), float(found.fun), asked, 0, str(found.message))


def _bounds(problem: Residuals) -> list[tuple[float, float]]:
    return list(zip(*(one.tolist() for one in problem.bounds), strict=True))
