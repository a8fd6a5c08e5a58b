"""The way down from a good set: least squares on a branch's cost, with exact derivatives of the readings.

The cost of a branch is a sum of pieces, none below zero: of a cell its soft misfit, its scatter over the windows and
its existence, of a constraint its excess, of a prior its distance. Their roots are the residuals, that of the misfit
with the sign of its pull. Existence and counts are constant between jumps: they have no slope, and a step that
raises them is not taken. So is a reading that has no derivative (an event on the edge of a window) held for a step.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.calibrate.archive import Archive
from tarsus.calibrate.objective import FAILED, Branch, Objective, existence
from tarsus.calibrate.problem import Problem
from tarsus.fit import Found, Residuals, least_squares

__all__ = ["BranchFit", "polish", "residuals_of"]

Floats = NDArray[np.float64]

SETTLED = 1e-3
"""A polish ends where a step gains less than this part of the cost, or moves less than this part of the bounds' span:
neither changes which sets are likely."""


@dataclass
class BranchFit(Residuals):
    """A branch of a calibration as residuals: the sum of their squares is its cost."""

    problem: Problem
    archive: Archive
    branch: Branch

    def __post_init__(self) -> None:
        self.unknowns = self.problem.unknowns

    def residuals_at(self, points: Floats) -> Floats:
        readings = np.asarray(self.archive.evaluate(self.branch.run, points, "polish"), dtype=float)
        return residuals_of(self.problem, self.branch, readings, points)

    def jacobian(self, x: ArrayLike) -> Floats:
        at = self.point(x)
        readings = np.asarray(self.archive.evaluate(self.branch.run, at[None], "polish"), dtype=float)
        slopes = self.archive.slopes(self.branch.run, at) * self.unknowns.slopes(at)
        roots = _Roots(self.problem.objective, self.branch, readings)
        return np.concatenate([roots.slopes(slopes), np.diag(self.unknowns.prior_slopes(at))])


def residuals_of(problem: Problem, branch: Branch, readings: Floats, points: Floats) -> Floats:
    """Residuals (ns, nr) of sets at points (ns, nu), from their readings (ns, rows, channels, samples): the sum of
    their squares is the cost."""
    roots = _Roots(problem.objective, branch, readings)
    return np.concatenate([roots.values, problem.unknowns.prior_residuals(points)], axis=1)


class _Roots:
    """Roots of the pieces of a cost, of readings (ns, rows, channels, samples), and their derivatives."""

    def __init__(self, objective: Objective, branch: Branch, readings: Floats) -> None:
        self.objective, self.branch, self.readings = objective, branch, readings
        cells = objective.cells
        table = readings[:, : len(cells.observed)][:, :, list(branch.columns)]
        ratio, scale, self.by_value = objective.scaled(table)
        self.failed = np.asarray(np.isinf(table).any(axis=-1))
        self.u = np.log(ratio) * scale[:, :, None]
        self.mean = np.where(self.failed, FAILED, self.u.mean(axis=-1))
        self.scatter = np.where(self.failed, 0.0, self.u.var(axis=-1))
        self.known = np.isfinite(cells.observed)
        self.weight = np.sqrt(np.broadcast_to(cells.weight, self.known.shape))
        self.pull = self.mean / np.sqrt(1.0 + self.scatter)
        self.there = np.zeros(self.u.shape[:-1])
        for k in np.flatnonzero(cells.exists):
            p = existence(table[:, :, k], 0.5)
            self.there[:, :, k] = np.sqrt(-2.0 * np.log(np.where(cells.observed[:, k] > 0.0, p, 1.0 - p)))

    @property
    def values(self) -> Floats:
        """Residuals (ns, n): misfits, scatters, existences, constraints."""
        misfit = np.sign(self.pull) * np.sqrt(self.objective.soft(self.pull**2))
        pieces = [misfit, np.sqrt(np.log1p(self.scatter)), self.there]
        cells = [(self.weight * one)[:, self.known] for one in pieces]
        limits = [
            np.sqrt(self.objective.soft(self._excess(n)[0] ** 2)) for n in range(len(self.objective.limits))
        ]
        return np.concatenate([*cells, *limits], axis=1)

    def slopes(self, slopes: Floats) -> Floats:
        """Derivatives (n, nu) of the first set's residuals, of those (rows, channels, samples, nu) of its readings."""
        nu = slopes.shape[-1]
        table = slopes[: len(self.known)][:, list(self.branch.columns)]
        moved = np.where(self.failed[0][..., None, None], 0.0, self.by_value[0][..., None] * table)
        of_mean = moved.mean(axis=2)
        off = (self.u[0] - self.u[0].mean(axis=-1, keepdims=True))[..., None]
        of_scatter = 2.0 * (off * moved).mean(axis=2)
        wide = 1.0 + self.scatter[0][..., None]
        of_pull = of_mean / np.sqrt(wide) - 0.5 * self.pull[0][..., None] * of_scatter / wide
        of_misfit = self._root_slope(self.pull[0])[..., None] * of_pull
        root = np.sqrt(np.log1p(self.scatter[0]))[..., None]
        of_root = np.divide(0.5 * of_scatter / wide, root, out=np.zeros_like(of_scatter), where=root > 0.0)
        cells = [
            (self.weight[..., None] * one)[self.known] for one in (of_misfit, of_root, np.zeros_like(of_root))
        ]
        limits = []
        for n, limit in enumerate(self.objective.limits):
            excess, place, sign = (one[0] for one in self._excess(n))
            part = slopes[list(limit.rows), limit.channel]
            own = (
                np.take_along_axis(part, place[:, None, None], axis=1)[:, 0] * sign[:, None] / limit.softness
            )
            limits.append(self._root_slope(excess)[:, None] * own * (excess > 0.0)[:, None])
        return np.concatenate([*cells, *limits]).reshape(-1, nu)

    def _root_slope(self, pull: Floats) -> Floats:
        """Derivative of the root of a soft cost by its pull."""
        square = (pull / self.objective.robust) ** 2
        root = np.sqrt(np.divide(np.log1p(square), square, out=np.ones_like(square), where=square > 0.0))
        return 1.0 / ((1.0 + square) * root)

    def _excess(self, number: int) -> tuple[Floats, NDArray[np.intp], Floats]:
        """Excess (ns, rows) over a constraint in its softness, the sample that decides, and its sign."""
        limit = self.objective.limits[number]
        part = self.readings[:, list(limit.rows), limit.channel]
        values = np.where(np.isfinite(part), part, 0.0)
        above, below = values.max(axis=-1) - limit.high, limit.low - values.min(axis=-1)
        over = above >= below
        excess = np.maximum(np.where(over, above, below), 0.0) / limit.softness
        excess = np.where(np.isinf(part).any(axis=-1), FAILED, excess)
        place = np.where(over, values.argmax(axis=-1), values.argmin(axis=-1))
        return excess, place, np.where(over, 1.0, -1.0)


def polish(problem: Problem, archive: Archive, branch: int, start: Floats, rounds: int) -> Found:
    """Go down from a point (nu,) of the cube in a branch, by at most so many steps; what is visited is kept in the
    archive."""
    fit = BranchFit(problem, archive, problem.branches[branch])
    return least_squares(fit, start, rounds, 0.03)
