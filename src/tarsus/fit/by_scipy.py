"""scipy's quasi-Newton methods on a fit, with its gradient."""

from __future__ import annotations

from typing import Any

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
    chosen = {"method": "L-BFGS-B", "bounds": list(zip(*problem.bounds, strict=True)), **options}
    found = optimize.minimize(problem.cost, problem.point(start), jac=problem.gradient, **chosen)
    x = problem.point(found.x)
    slopes = int(found.get("njev", 0))
    return Found(x, problem.values(x), float(found.fun), int(found.nfev), slopes, str(found.message))
