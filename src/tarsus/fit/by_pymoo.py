"""A fit as a problem of pymoo (the extra ``optimise``): several goals at once, under constraints."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from tarsus.base.errors import InputError
from tarsus.fit.residuals import Residuals

if TYPE_CHECKING:
    from pymoo.core.problem import Problem  # pyright: ignore[reportMissingImports]


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
