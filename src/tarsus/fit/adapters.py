"""Optimisers of other packages on a fit: scipy's quasi-Newton methods, and those of cma and pymoo (the extra
``optimise``)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import optimize

from tarsus.base.errors import InputError
from tarsus.fit.residuals import Found, Residuals

if TYPE_CHECKING:
    from pymoo.core.problem import Problem  # pyright: ignore[reportMissingImports]

FIRST_STEP = 0.2
"""First standard deviation in the cube: a fifth of the bounds, so that both are within three of the middle."""


def cma_es(
    problem: Residuals,
    start: ArrayLike | None = None,
    step: float = FIRST_STEP,
    seed: int = 1,
    most: int | None = None,
    **options: Any,
) -> Found:
    """Covariance matrix adaptation within the problem's bounds, a generation in one batch; no derivatives.

    Parameters
    ----------
    problem
        What is searched.
    start
        First mean (nu,) in the unit cube of the unknowns, its middle unless given.
    step
        First standard deviation in the cube.
    seed
        Of all that is random.
    most
        Points that may be asked for.
    options
        Of the package, by its names (``popsize``, ``tolfun``, ...).

    Raises
    ------
    InputError
        Where the package is not installed.
    """
    try:
        import cma  # pyright: ignore[reportMissingImports]
    except ImportError:
        raise InputError("CMA-ES needs the package cma: pip install cma") from None
    chosen = {"bounds": [0.0, 1.0], "seed": seed, "verbose": -9, **options}
    if most is not None:
        chosen["maxfevals"] = most
    strategy = cma.CMAEvolutionStrategy(problem.point(start), step, chosen)
    while not strategy.stop():
        points = strategy.ask()
        strategy.tell(points, problem.costs(np.array(points)).tolist())
    x = problem.point(np.asarray(strategy.result.xbest))
    why = ", ".join(f"{name} {value}" for name, value in dict(strategy.stop() or {}).items())
    return Found(x, problem.values(x), float(strategy.result.fbest), int(strategy.result.evaluations), 0, why)


def pymoo_problem(problem: Residuals) -> Problem:
    """A `pymoo.core.problem.Problem` over the unit cube, asked for whole generations in one batch.

    Its objectives are the goals, and before them half the sum of squared residuals where there are residuals; its
    constraints are the problem's.

    Raises
    ------
    InputError
        Where the package is not installed.
    """
    try:
        from pymoo.core.problem import Problem  # pyright: ignore[reportMissingImports]
    except ImportError:
        raise InputError("fronts by pymoo need the package: pip install pymoo") from None
    nothing = np.zeros((0, len(problem.unknowns)))
    squares = int(problem.residuals_at(nothing).shape[1] > 0)
    goals, limits = problem.goals_at(nothing).shape[1], problem.constraints_at(nothing).shape[1]

    class Fit(Problem):
        def __init__(self) -> None:
            low, high = problem.bounds
            super().__init__(n_var=len(low), n_obj=squares + goals, n_ieq_constr=limits, xl=low, xu=high)

        def _evaluate(self, x: Any, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
            cost = 0.5 * (problem.residuals_at(x) ** 2).sum(axis=1, keepdims=True)
            out["F"] = np.concatenate([cost[:, :squares], problem.goals_at(x)], axis=1)
            if limits:
                out["G"] = problem.constraints_at(x)

    return Fit()


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
