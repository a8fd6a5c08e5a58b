"""CMA-ES of the package cma (the extra ``optimise``) on a fit."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tarsus.base.errors import InputError
from tarsus.fit.residuals import Found, Residuals

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
        cma: Any = import_module("cma")
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
