"""Gauss-Newton steps whose slopes are regressed from the sets that a search has visited anyway: they cost no run of
their own, and see a cost that jumps where counts do as what it is over the distance between the sets.

After the derivative-free Gauss-Newton methods (Ralston and Jennrich, Technometrics 20, 1978; Cartis and Roberts, Math.
Program. Comput. 11, 2019), from several valleys side by side and beside a population that evolves.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

__all__ = ["STEPS", "Valleys", "steps"]

Floats = NDArray[np.float64]

APART = 0.1
"""Steps begin at sets so far apart (root mean square over the unit cube): a tenth of the bounds, nearer ones have their
neighbours in common. Within half of it of a set from which no step gains any more none begins."""
STEPS = ((0.01, 1.5), (0.1, 1.5), (1.0, 1.5), (0.1, 4.0))
"""Of every set: damping in parts of the mean square of the slopes, and neighbours for each coefficient of the
regression, few for what is near and many for what jumps. Both are drawn about these values, so that a set that is
asked again is not asked the same."""
POOR, PATIENCE = 0.003, 2
"""A set from which steps have gained less than this share of its cost so many times is left alone."""
RIDGE = 1e-3
"""Ridge of the regression, in parts of the mean square of the distances: directions that no neighbour shows have no
slope."""
FAR = 0.75
"""Longest step in parts of the radius of the neighbours, by the root of the number of unknowns: beyond them the
regression says nothing."""


@dataclass
class Valleys:
    """What a search knows of where steps have gained; empty at first."""

    poor: list[tuple[Floats, int]] = field(default_factory=list)

    def bases(self, points: Floats, costs: Floats, count: int) -> list[int]:
        """Rows of up to ``count`` of the visited points (n, nu), the lowest costs (n,) first, none near another one or
        one that is left alone."""
        left = np.argsort(costs, kind="stable")
        for point, times in self.poor:
            if times >= PATIENCE:
                left = left[_distances(points[left], point) > 0.5 * APART]
        chosen: list[int] = []
        while len(left) and len(chosen) < count:
            chosen.append(int(left[0]))
            left = left[_distances(points[left], points[left[0]]) > APART]
        return chosen

    def tell(self, point: Floats, before: float, after: float) -> None:
        """The lowest cost after steps from a point (nu,) of a cost before."""
        if after > (1.0 - POOR) * before:
            times = [n for one, n in self.poor if np.array_equal(one, point)]
            self.poor = [(one, n) for one, n in self.poor if not np.array_equal(one, point)]
            self.poor.append((point, sum(times) + 1))


def steps(points: Floats, residuals: Floats, base: int, rng: np.random.Generator) -> Floats:
    """Points (4, nu) of the unit cube that are best by regressions about one of the visited points (n, nu), of whose
    residuals (n, nr) the squares are to be least."""
    out = []
    for damping, share in STEPS:
        damp, wide = damping * np.exp(rng.normal(0.0, 0.7)), share * np.exp(rng.normal(0.0, 0.2))
        slopes, radius = _regressed(points, residuals, base, int(max(wide, 1.2) * (points.shape[1] + 1)))
        out.append(_step(points[base], residuals[base], slopes, damp, radius))
    return np.array(out)


def _distances(points: Floats, point: Floats) -> Floats:
    return np.sqrt(((points - point) ** 2).mean(axis=1))


def _regressed(points: Floats, residuals: Floats, base: int, count: int) -> tuple[Floats, float]:
    """Slopes (nu, nr) of residuals from the nearest so many visited points, the nearer the heavier, and the distance of
    the farthest."""
    distance = _distances(points, points[base])
    distance[base] = np.inf
    near = np.argsort(distance, kind="stable")[: min(count, len(points) - 1)]
    radius = float(distance[near[-1]])
    weight = np.maximum(1.0 - (distance[near] / (1.0001 * radius)) ** 3, 1e-3) ** 1.5
    moved, changed = points[near] - points[base], residuals[near] - residuals[base]
    square = (moved * weight[:, None]).T @ moved
    square += RIDGE * np.trace(square) / len(square) * np.eye(len(square))
    return np.linalg.solve(square, (moved * weight[:, None]).T @ changed), radius


def _step(point: Floats, residuals: Floats, slopes: Floats, damp: float, radius: float) -> Floats:
    """A damped step within the unit cube; unknowns that it would push out of their bounds are held."""
    nu = len(point)
    square, pull = slopes @ slopes.T, slopes @ residuals
    square = square + damp * (np.trace(square) / nu + 1e-300) * np.eye(nu)
    free, step = np.ones(nu, dtype=bool), np.zeros(nu)
    for _ in range(nu):
        step = np.zeros(nu)
        step[free] = -np.linalg.solve(square[np.ix_(free, free)], pull[free])
        out = free & (((point <= 0.0) & (step < 0.0)) | ((point >= 1.0) & (step > 0.0)))
        if not out.any() or np.array_equal(out, free):
            break
        free &= ~out
    longest = float(np.abs(step).max())
    limit = FAR * np.sqrt(nu) * radius
    return np.clip(point + step * min(1.0, limit / max(longest, 1e-300)), 0.0, 1.0)
