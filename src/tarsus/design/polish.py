"""The last descent of one design: by gradients where somebody gives them, else by an evolution strategy."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from tarsus.design.search import Archive, Budget, Cost, descend

__all__ = ["Slopes", "polish"]

Floats = NDArray[np.float64]
Slopes = Callable[[int, Floats], Floats]
"""Slopes (nu,) of the cost along the unknowns, at a point (nu,) of the unit cube in the family of a number."""

FINE = 0.01
"""First step of the evolution strategy: an eighth of a valley's size, for the search has been there."""


def polish(
    cost: Cost,
    number: int,
    point: Floats,
    rng: np.random.Generator,
    slopes: Slopes | None = None,
    generations: int = 40,
) -> tuple[Floats, float]:
    """The best point found from one on, and its cost; never worse than the start.

    The hardest of several touchdowns has kinks where two are equal, which a gradient does not see: with slopes the
    descent (L-BFGS-B) is followed by the strategy all the same, from where it came to.
    """
    family = np.array([number])
    if slopes is not None:
        found = minimize(
            lambda x: float(cost(family, x[None])[0]), point, jac=lambda x: slopes(number, x), method="L-BFGS-B",
            bounds=[(0.0, 1.0)] * len(point), options={"maxiter": generations},
        )  # fmt: skip
        point = np.asarray(found.x)
    archive = Archive.empty(len(point))
    archive.add(family, point[None], cost(family, point[None]))
    budget = Budget(islands=1, generations=generations, offspring=12)
    descend(cost, archive, family, point[None], budget, rng, step=FINE)
    best = int(np.argmin(archive.costs))
    return archive.points[best], float(archive.costs[best])
