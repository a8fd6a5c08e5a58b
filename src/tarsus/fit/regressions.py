"""Least squares without derivatives: Gauss-Newton steps by regressions over the points that were visited.

Where a cost is rugged, because events come and go, its derivative at a point says little of where it falls; a
regression over the visited points about it sees through the jumps, costs no run, and knows more with every step. After
the derivative-free Gauss-Newton methods (Ralston and Jennrich, Technometrics 20, 1978; Cartis and Roberts, Math.
Program. Comput. 11, 2019), from several valleys side by side. Packages of these take one start and ask for one point
after the other; here a batch of points is asked for, and all that were ever visited are used.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.fit.normal_equations import NormalEquations, held_step

APART = 0.1
"""Steps begin at points so far apart (root mean square over the unit cube): a tenth of the bounds, nearer ones have
their neighbours in common. Within half of it of a point from which no step gains any more none begins."""
STEPS = ((0.01, 1.5), (0.1, 1.5), (1.0, 1.5), (0.1, 4.0))
"""Of every point: damping in parts of the mean square of the slopes, and neighbours for each coefficient of the
regression, few for what is near and many for what jumps. Both are drawn about these values, so that a point that is
asked again is not asked the same."""
POOR, PATIENCE = 0.003, 4
"""A point from which steps have gained less than this share of its cost so many times is left alone: after two, four
searches of the cantilever, 300 sets each, ended 3 higher on average."""
RIDGE = 1e-3
"""Ridge of the regression, in parts of the mean square of the distances: directions that no neighbour shows have no
slope."""
FAR = 0.75
"""Longest step in parts of the radius of the neighbours, by the root of the number of unknowns: beyond them the
regression says nothing."""
FEWEST = 2
"""Visited points for each unknown and one more from which regressions are made: with fewer a slope is chance."""


@dataclass
class Valleys:
    """What a search knows of where steps have gained; empty at first."""

    poor: list[tuple[Floats, int]] = field(default_factory=list)

    def bases(self, points: Floats, costs: Floats, count: int) -> list[int]:
        """Rows of up to ``count`` of the visited points (n, nu), the lowest costs (n,) first, none near another one or
        one that is left alone; none where too few were visited."""
        left = np.argsort(costs, kind="stable") if len(points) > FEWEST * (points.shape[1] + 1) else np.zeros(0, int)
        for point, times in self.poor:
            if times >= PATIENCE:
                left = left[_distances(points[left], point) > 0.5 * APART]
        chosen: list[int] = []
        while len(left) and len(chosen) < count:
            chosen.append(int(left[0]))
            left = left[_distances(points[left], points[left[0]]) > APART]
        return chosen

    def report(self, point: Floats, before: float, after: float) -> None:
        """The lowest cost after steps from a point (nu,) of a cost before."""
        if after > (1.0 - POOR) * before:
            times = [n for one, n in self.poor if np.array_equal(one, point)]
            self.poor = [(one, n) for one, n in self.poor if not np.array_equal(one, point)]
            self.poor.append((point, sum(times) + 1))


def steps(points: Floats, residuals: Floats, base: int, rng: np.random.Generator) -> Floats:
    """Points (4, nu) of the unit cube that are best by regressions about one of the visited points (n, nu), of whose
    residuals (n, nr) the squares are to be least."""
    out = []
    nu = points.shape[1]
    for damping, share in STEPS:
        damp, wide = damping * np.exp(rng.normal(0.0, 0.7)), share * np.exp(rng.normal(0.0, 0.2))
        slopes, radius = _regressed(points, residuals, base, int(max(wide, 1.2) * (nu + 1)))
        point = points[base]
        system = NormalEquations.of([residuals[base]], [slopes.T], nu)
        level = damp * (np.trace(system.own[0]) / nu + 1e-300) * np.eye(nu)
        step = held_step(system.ridged(level), point[None], 0.0, 1.0)[0]
        longest, limit = float(np.abs(step).max()), FAR * np.sqrt(nu) * radius
        out.append(np.clip(point + step * min(1.0, limit / max(longest, 1e-300)), 0.0, 1.0))
    return np.array(out)


def _distances(points: Floats, point: Floats) -> Floats:
    return np.sqrt(((points - point) ** 2).mean(axis=1))


def _regressed(points: Floats, residuals: Floats, base: int, count: int) -> tuple[Floats, float]:
    """Slopes (nu, nr) of residuals from the nearest so many visited points, the nearer the heavier, and the distance of
    the farthest."""
    distance = _distances(points, points[base])
    others = np.flatnonzero(distance > 0.0)  # a point that was visited twice, as corners are, gives no slope
    near = others[np.argsort(distance[others], kind="stable")[:count]]
    radius = float(distance[near[-1]])
    weight = np.maximum(1.0 - (distance[near] / (1.0001 * radius)) ** 3, 1e-3) ** 1.5
    moved, changed = points[near] - points[base], residuals[near] - residuals[base]
    square = (moved * weight[:, None]).T @ moved
    square += RIDGE * np.trace(square) / len(square) * np.eye(len(square))
    return np.linalg.solve(square, (moved * weight[:, None]).T @ changed), radius
