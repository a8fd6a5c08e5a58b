"""A calibration as numbers: unknowns, branches, a forward model and a cost; the search knows nothing else."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.calibrate.objective import Branch, Costs, Objective

__all__ = ["Given", "Problem", "Simulate", "Unknowns"]

Floats = NDArray[np.float64]
Simulate = Callable[[int, Floats, Sequence[int]], NDArray[np.floating]]
"""Readings (ns, rows, channels, samples) of sets (ns, nu) in SI in a run branch, for the rows of these numbers."""


@dataclass(frozen=True)
class Given:
    """A prior: median [SI], one standard deviation [SI] or, where ``factor``, as a factor."""

    median: float
    spread: float
    factor: bool


@dataclass(frozen=True)
class Unknowns:
    """nu numbers that are searched: names, units, bounds (nu,) [SI], whether on a logarithmic scale, priors."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    low: Floats
    high: Floats
    log: NDArray[np.bool_]
    priors: tuple[Given | None, ...]

    def __len__(self) -> int:
        return len(self.names)

    def values(self, cube: Floats) -> Floats:
        """SI values of points (..., nu) of the unit cube."""
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(self.log, self.high / np.where(self.log, self.low, 1.0), 1.0)
        return np.where(
            self.log,
            np.where(self.log, self.low, 1.0) * ratio**cube,
            self.low + (self.high - self.low) * cube,
        )

    def cube(self, values: Floats) -> Floats:
        """Points (..., nu) of the unit cube of SI values."""
        with np.errstate(divide="ignore", invalid="ignore"):
            log = np.log(values / self.low) / np.log(self.high / self.low)
        return np.where(self.log, log, (values - self.low) / (self.high - self.low))

    def precision(self, cube: Floats) -> Floats:
        """What is known of each unknown (nu,) beforehand, at a point (nu,): one over the variance in the unit cube of
        its bounds, and of its prior by its curvature there."""
        h = 1e-3
        at = np.clip(cube, h, 1.0 - h)
        step = h * np.eye(len(at))
        curved = self.prior_cost(at + step) - 2.0 * self.prior_cost(at) + self.prior_cost(at - step)
        return 12.0 + np.maximum(0.5 * curved / h**2, 0.0)

    def prior_cost(self, cube: Floats) -> Floats:
        """Minus twice the log of the priors (...,), constants dropped."""
        values, total = self.values(cube), np.zeros(cube.shape[:-1])
        for i, prior in enumerate(self.priors):
            if prior is not None:
                x = values[..., i]
                off = (
                    np.log(x / prior.median) / np.log(prior.spread)
                    if prior.factor
                    else (x - prior.median) / prior.spread
                )
                total = total + off**2
        return total


@dataclass(frozen=True)
class Problem:
    """What is searched: a forward model and the cost of its readings.

    simulate: the forward model; objective: cost of its readings; rows: numbers of the rows that are simulated in the
    search, those of the table that are fitted first; labels: what they are called; resolution [m] of the instrument;
    peak: channel of the highest gap, or None; starts (n, nu): points of the unit cube to be visited first.
    """

    unknowns: Unknowns
    branches: tuple[Branch, ...]
    simulate: Simulate
    objective: Objective
    rows: tuple[int, ...]
    labels: tuple[str, ...]
    resolution: float = 0.0
    peak: int | None = None
    starts: Floats | None = None

    @property
    def trained(self) -> int:
        """Number of rows that are fitted."""
        return len(self.objective.cells.observed)

    def costs(self, readings: NDArray[np.floating], branch: Branch) -> Costs:
        """Costs of readings in a branch."""
        return self.objective(readings, branch)

    def total(self, costs: Costs, cube: Floats, without: int | None = None) -> Floats:
        """Whole cost (ns,) of sets, without one row of the table or with all."""
        kept = np.ones(costs.rows.shape[1], dtype=bool)
        if without is not None:
            kept[without] = False
        return costs.rows[:, kept].sum(axis=1) + costs.limits.sum(axis=1) + self.unknowns.prior_cost(cube)
