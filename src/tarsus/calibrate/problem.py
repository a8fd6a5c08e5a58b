"""A calibration as numbers: unknowns, branches, a forward model and a cost; the search knows nothing else."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.calibrate.objective import Branch, Costs, Objective
from tarsus.fit import Unknowns

__all__ = ["Problem", "Simulate", "Slopes"]

Floats = NDArray[np.float64]
Simulate = Callable[[int, Floats, Sequence[int]], NDArray[np.floating]]
"""Readings (ns, rows, channels, samples) of sets (ns, nu) in SI in a run branch, for the rows of these numbers."""
Slopes = Callable[[int, Floats, Sequence[int]], Floats]
"""Derivatives (rows, channels, samples, nu) of the readings of one set (nu,) in a run branch by its SI values; zero
where there is none."""


@dataclass(frozen=True)
class Problem:
    """What is searched: a forward model and the cost of its readings.

    simulate: the forward model; objective: cost of its readings; rows: numbers of the rows that are simulated in the
    search, those of the table that are fitted first; labels: what they are called; resolution [m] of the instrument;
    peak: channel of the highest gap, or None; starts (n, nu): points of the unit cube to be visited first; slopes:
    derivatives of the forward model, or None.
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
    slopes: Slopes | None = None

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
