"""Lowering the largest of many smooth costs at once: steps of linear programs within a reach that adapts.

Where a search by chance meets a kink, at which two costs are equally large, nearly every step makes one of them worse.
A linear program of their slopes goes along the kink, and settles where as many costs meet as there are unknowns.
After Madsen, An algorithm for minimax solution of overdetermined systems of non-linear equations (IMA J. Appl. Math.
16, 1975).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Costs = Callable[[Floats], Floats]
"""Costs (n, ng) of points (n, nu) of the unit cube."""

DIFFERENCE = 1e-4
"""Of coordinates, for slopes: a speed of 0.05 m/s that a batch knows to 1e-5 changes by a thousand times that."""
TRIED = (1.0, 0.4, 0.1)
"""Shares of a step that are tried at once."""
LEAST = 1e-5
"""Reach below which points stay: a tenth of the differences that slopes are of."""


def lower_worst(costs: Costs, points: Floats, reach: float, steps: int) -> tuple[Floats, Floats]:
    """Points (k, nu) moved, side by side, to where the largest of their costs is least, and those costs (k,).

    reach: by which a coordinate moves in the first step at most; steps: at most so many.
    """
    points, nu = points.copy(), points.shape[1]
    each = costs(points)
    reaches = np.full(len(points), reach)
    for _ in range(steps):
        going = np.flatnonzero((reaches > LEAST) & np.isfinite(each).all(axis=1))
        if not len(going):
            break
        here = points[going]
        signs = np.where(here > 0.5, -1.0, 1.0)  # differences stay within the cube
        beside = here[:, None] + DIFFERENCE * np.eye(nu) * signs[:, None]
        moved = costs(beside.reshape(-1, nu)).reshape(len(going), nu, -1)
        slopes = (moved - each[going][:, None]) / (DIFFERENCE * signs[:, :, None])
        down = np.array([_step(each[i], slopes[n], points[i], reaches[i]) for n, i in enumerate(going)])
        tried = np.clip(here[:, None] + np.array(TRIED)[:, None] * down[:, None], 0.0, 1.0)
        found = costs(tried.reshape(-1, nu)).reshape(len(going), len(TRIED), -1)
        best = found.max(axis=2).argmin(axis=1)
        for n, i in enumerate(going.tolist()):
            if found[n, best[n]].max() < each[i].max():
                points[i], each[i] = tried[n, best[n]], found[n, best[n]]
                reaches[i] *= 2.0 if best[n] == 0 else TRIED[best[n]]
            else:
                reaches[i] *= TRIED[-1]
    return points, each.max(axis=1)


def _step(costs: Floats, slopes: Floats, point: Floats, reach: float) -> Floats:
    """The step (nu,) within a reach and the cube after which the largest of costs (ng,) of slopes (nu, ng) is least."""
    from scipy.optimize import linprog  # takes longer to load than many designs

    nu = len(point)
    scale = float(np.abs(costs).max()) or 1.0
    rows = np.column_stack([slopes.T / scale, -np.ones(len(costs))])
    bounds = [(max(-reach, -x), min(reach, 1.0 - x)) for x in point.tolist()]
    usable = np.isfinite(rows).all(axis=1)
    found = linprog(
        np.append(np.zeros(nu), 1.0),
        A_ub=rows[usable],
        b_ub=-costs[usable] / scale,
        bounds=[*bounds, (None, None)],
    )
    return found.x[:nu] if found.success else np.zeros(nu)
