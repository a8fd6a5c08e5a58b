"""The last descent of a design by exact slopes: a cost that is the largest of many smooth pieces has a kink at its
lowest point as a rule, which each piece alone does not see but all of them together do.

Linear programs in regions of trust (Madsen and Schjaer-Jacobsen, Linearly constrained minimax optimization, Math.
Program. 14, 1978); means and tails of grounds as Rockafellar and Uryasev have them (J. Risk 2, 2000).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats

RADII = np.array([2.0, 0.5, 0.1])
"""Regions that are tried at once, in units of the last one: a batch of three runs costs hardly more than one."""
FIRST, LEAST = 0.03, 1e-5
"""Half width of the first region, less than half of a valley (`tarsus.fit.valleys.NEAR`); the descent ends below the
least one, 15 ns of a plateau of 0.4 ms."""
ENOUGH = 1e-4
"""It ends, too, where two rounds have won less than this share: no touchdown is known to that."""


@dataclass(frozen=True)
class CostPieces:
    """Smooth pieces of a cost at a point: values (m,), their slopes (m, nu) along the unknowns, and the ground (m,)
    that each belongs to; on every ground the largest piece counts. complete: whether all have slopes."""

    values: Floats
    slopes: Floats
    ground: NDArray[np.int64]
    complete: bool = True


def descend_pieces(
    cost: Callable[[Floats], Floats],
    pieces: Callable[[Floats], CostPieces],
    point: Floats,
    rounds: int,
    tail: float = 0.0,
    weights: Floats | None = None,
) -> tuple[Floats, float, int]:
    """The lowest point that was found from one on, its cost, and how often slopes were asked for; never worse than the
    start, whatever the slopes are.

    Parameters
    ----------
    cost
        Costs (n,) of points (n, nu) of the unit cube.
    pieces
        Those of a point (nu,).
    tail, weights
        Share of the worst grounds whose mean the cost is, and the weights (ng,) of all: 0 is the worst ground alone, 1
        the mean.
    """
    best = float(cost(point[None])[0])
    radius, asked, poor = FIRST, 0, 0
    while asked < rounds and radius >= LEAST and poor < 2:
        found = pieces(point)
        asked += 1
        if not len(found.values):
            break
        tried = np.array([_step(found, point, radius * one, tail, weights) for one in RADII])
        costs = cost(np.clip(point + tried, 0.0, 1.0))
        at = int(np.argmin(costs))
        if costs[at] < best:
            poor = poor + 1 if costs[at] > (1.0 - ENOUGH) * best else 0
            point, best = np.clip(point + tried[at], 0.0, 1.0), float(costs[at])
            radius = min(radius * float(RADII[at]), 0.3)
        else:
            radius *= 0.5 * float(RADII[-1])
    return point, best, asked


def _step(found: CostPieces, point: Floats, radius: float, tail: float, weights: Floats | None) -> Floats:
    """The step (nu,) within a region that is best by the slopes: least a + sum(w u) / tail over d, a and u >= 0 with
    value + slope d <= a + u of its ground for every piece; without a tail u is 0."""
    nu = len(point)
    numbers, column = np.unique(found.ground, return_inverse=True)
    ng = len(numbers) if tail > 0.0 else 0
    rows = np.zeros((len(found.values), nu + 1 + ng))
    rows[:, :nu], rows[:, nu] = found.slopes, -1.0
    price = np.zeros(nu + 1 + ng)
    price[nu] = 1.0
    if ng:
        rows[np.arange(len(rows)), nu + 1 + column] = -1.0
        own = np.full(ng, 1.0 / ng) if weights is None else weights[numbers]
        price[nu + 1 :] = own / tail
    scale = max(float(np.abs(found.values).max()), 1e-300)  # the solver's tolerances are absolute
    rows[:, :nu] *= radius / scale
    bounds = [(max(-1.0, -x / radius), min(1.0, (1.0 - x) / radius)) for x in point.tolist()]
    least = float(found.values.min()) / scale - 2.0 * np.abs(rows[:, :nu]).sum(axis=1).max() - 1.0
    from scipy.optimize import linprog  # takes longer to load than all searches

    solved = linprog(
        price,
        rows,
        -found.values / scale,
        bounds=[*bounds, (least, None), *[(0.0, None)] * ng],
        method="highs",
    )
    return np.zeros(nu) if solved.x is None else radius * np.asarray(solved.x[:nu])
