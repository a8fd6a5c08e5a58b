"""scipy's optimisers on a fit: least squares and quasi-Newton with its derivatives, differential evolution without."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import optimize

from tarsus.base.errors import InputError
from tarsus.fit.residuals import Found, Residuals
from tarsus.fit.uncertainty import uncertainty_of

__all__ = ["differential_evolution", "least_squares", "minimize"]


def least_squares(problem: Residuals, start: ArrayLike | None = None, **options: Any) -> Found:
    """`scipy.optimize.least_squares` (trust region reflective) with the problem's Jacobian, within its bounds.

    start (nu,): point of the unit cube of the unknowns, its middle unless given; options: as scipy takes them.
    Raises InputError where the problem has goals, which are no residuals.

    Returns
    -------
    Found
        The point, its values [SI], its cost, and standard errors with correlations.

    Examples
    --------
    >>> import tarsus as ts
    >>> scene = ts.with_values(ts.load_scene("cantilever"), {"robot.feet.tip.gap": "71 um"})
    >>> times = [2e-4, 5e-4, 8e-4]
    >>> record = ts.simulate(scene, 4e-3).states(times).gap[0]
    >>> problem = ts.fit.Problem(scene, {"robot.feet.tip.gap": ts.fit.Unknown("60 um", "80 um")},
    ...                          [ts.fit.Samples("tip", times, record, error="0.1 um")], duration=4e-3)
    >>> found = ts.fit.least_squares(problem)
    >>> bool(abs(found.values["robot.feet.tip.gap"] - 71e-6) < 1e-9)
    True
    >>> found.uncertainty.errors["robot.feet.tip.gap"] < 1e-7
    True
    """
    if problem.goals_at(np.zeros((0, len(problem.unknowns)))).shape[1]:
        raise InputError("least_squares: goals are no residuals; use minimize")
    found = optimize.least_squares(
        problem.residuals, _start(problem, start), problem.jacobian, problem.bounds, **options  # pyright: ignore[reportArgumentType]
    )  # fmt: skip
    x = problem.point(found.x)
    sure = uncertainty_of(np.asarray(found.jac), problem.unknowns, x)
    return Found(x, problem.values(x), float(found.cost), int(found.nfev), int(found.njev), found.message, sure)


def minimize(problem: Residuals, start: ArrayLike | None = None, **options: Any) -> Found:
    """`scipy.optimize.minimize` of the cost with its gradient, within its bounds: L-BFGS-B unless the options name
    another method. start (nu,): point of the unit cube of the unknowns, its middle unless given.

    Returns
    -------
    Found
        The point, its values [SI] and its cost.
    """
    chosen = {"method": "L-BFGS-B", "bounds": _bounds(problem), **options}
    found = optimize.minimize(problem.cost, _start(problem, start), jac=problem.gradient, **chosen)
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


def _start(problem: Residuals, start: ArrayLike | None) -> np.ndarray:
    return problem.point(np.full(len(problem.unknowns), 0.5) if start is None else start)
