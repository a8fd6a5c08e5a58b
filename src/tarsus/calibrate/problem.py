"""A calibration as numbers: unknowns, branches, a forward model and a cost; the search knows nothing else."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from tarsus.calibrate.objective import Branch, Costs, Objective
from tarsus.fit import Unknowns

__all__ = ["Problem", "Simulate", "Slopes"]

Floats = NDArray[np.float64]
T = TypeVar("T")
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
    peak: channel of the highest gap, or None; slopes: derivatives of the forward model, or None.
    """

    unknowns: Unknowns
    branches: tuple[Branch, ...]
    simulate: Simulate
    objective: Objective
    rows: tuple[int, ...]
    labels: tuple[str, ...]
    resolution: float = 0.0
    peak: int | None = None
    slopes: Slopes | None = None

    @property
    def trained(self) -> int:
        """Number of rows that are fitted."""
        return len(self.objective.cells.observed)

    def costs(self, readings: NDArray[np.floating], branch: Branch) -> Costs:
        """Costs of readings in a branch."""
        return self.objective(readings, branch)

    def total(self, costs: Costs, cube: Floats) -> Floats:
        """Whole cost (ns,) of sets."""
        return costs.rows.sum(axis=1) + costs.limits.sum(axis=1) + self.unknowns.prior_cost(cube)

    def without(self, row: int) -> Problem:
        """The problem of somebody who does not have this row of the table: its run is not simulated either."""
        return replace(
            self,
            objective=self.objective.without(row),
            rows=_but(self.rows, row),
            labels=_but(self.labels, row),
        )


def _but(items: tuple[T, ...], place: int) -> tuple[T, ...]:
    return items[:place] + items[place + 1 :]
