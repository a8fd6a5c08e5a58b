"""A calibration as numbers: unknowns, hypotheses, a forward model and a cost; the search knows nothing else."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.base.arrays import Floats
from tarsus.files.runstore import RunStore
from tarsus.fit.residuals import Residuals

if TYPE_CHECKING:
    from tarsus.calibrate.objective import Hypothesis, Objective, ReadingCosts
    from tarsus.fit.unknowns import Unknowns

Readings = NDArray[np.floating]
Simulate = Callable[[int, Floats, Sequence[int]], Readings]
"""Readings (ns, rows, channels, samples) of sets (ns, nu) in SI in a variant of the runs, for the rows of these
numbers."""
DIGITS = 9
"""Digits to which points of the unit cube are rounded: a point that comes back from an optimiser is the same point."""
STEP = 1e-3
"""Step of differences in the cube: what a search's accuracy leaves of 1e-5 is a hundredth of that."""
BENT = 0.5
"""Part of the difference to both sides from which on that to one side is another: of a jump it is all of it."""


@dataclass(frozen=True)
class CalibrationProblem:
    """What is searched: a forward model and the cost of its readings.

    simulate: the forward model; objective: cost of its readings; rows: numbers of the rows that are simulated in the
    search, those of the table that are fitted first.
    """

    unknowns: Unknowns
    hypotheses: tuple[Hypothesis, ...]
    simulate: Simulate
    objective: Objective
    rows: tuple[int, ...]

    @property
    def trained(self) -> int:
        """Number of rows that are fitted."""
        return len(self.objective.cells.observed)

    def residuals(self, pieces: ReadingCosts, cube: Floats) -> Floats:
        """Residuals (ns, nr) of sets at points (ns, nu), those of the priors last: the sum of their squares is the
        cost."""
        return np.concatenate([pieces.roots, self.unknowns.prior_residuals(cube)], axis=1)

    def without(self, row: int) -> CalibrationProblem:
        """The problem of somebody who does not have this row of the table: its run is not simulated either."""
        return replace(self, objective=self.objective.without(row), rows=self.rows[:row] + self.rows[row + 1 :])


@dataclass
class Archive:
    """Every set that a search has visited, and what was read there.

    A search is a fixed sequence of questions, so a killed one is resumed by asking them again: the store reads back
    what was answered. Every search, that of the whole table and each without one of its rows, has a number of its own,
    under which nothing of another is kept.

    problem: what is asked; store: where answers are kept; part: number of the search; on_sets: called after every
    question with the sets visited so far.
    """

    problem: CalibrationProblem
    store: RunStore = field(default_factory=RunStore)
    part: int = 0
    on_sets: Callable[[int], None] | None = None

    def evaluate(self, run: int, cube: Floats) -> Readings:
        """Readings (ns, rows, channels, samples) at points (ns, nu); those visited before are not simulated again."""
        read = self._asked(f"{self.part}/{run}", run, cube, self.problem.rows)
        if self.on_sets is not None:
            self.on_sets(self.sets)
        return read

    def visited(self, run: int) -> tuple[Floats, Readings]:
        """All visited points (n, nu) of a variant of the runs and their readings."""
        memo = self.store.memo(f"{self.part}/{run}")
        return memo.points, memo.values["readings"]

    @property
    def sets(self) -> int:
        """Number of sets that were visited."""
        return sum(len(self.store.memo(f"{self.part}/{run}")) for run in {one.run for one in self.problem.hypotheses})

    def for_slopes(self, run: int, points: Floats) -> Readings:
        """Readings (ns, rows, channels, samples) at points (ns, nu) that are no sets of the search."""
        return self._asked(f"{self.part}/{run}/beside", run, points, self.problem.rows)

    def elsewhere(self, run: int, points: Floats, row: int) -> Readings:
        """Readings (ns, channels, samples) at points (ns, nu) in a row that the search does not know, for its
        prediction."""
        return self._asked(f"{self.part}/{run}/row {row}", run, points, (row,))[:, 0]

    def _asked(self, name: str, run: int, points: Floats, rows: tuple[int, ...]) -> Readings:
        def simulated(fresh: Floats) -> dict[str, Readings]:
            return {"readings": self.problem.simulate(run, self.problem.unknowns.values(fresh), rows)}

        rounded = np.round(points, DIGITS) + 0.0  # no negative zeros
        return self.store.evaluate(rounded, simulated, name=name)["readings"]


@dataclass
class HypothesisFit(Residuals):
    """A hypothesis of a calibration as residuals; what is asked of it is kept in the archive."""

    archive: Archive
    number: int

    def __post_init__(self) -> None:
        self.problem = self.archive.problem
        self.unknowns = self.problem.unknowns
        self.hypothesis = self.problem.hypotheses[self.number]

    def pieces(self, readings: Readings) -> ReadingCosts:
        """Pieces of the cost of readings."""
        return self.problem.objective.pieces(readings, self.hypothesis)

    def residuals_at(self, points: Floats) -> Floats:
        return self.problem.residuals(self.pieces(self.archive.evaluate(self.hypothesis.run, points)), points)

    def jacobian(self, x: ArrayLike) -> Floats:
        """Differences to both sides. A reading that jumps or bends between them, as counts do, or that is not on all
        sides is held: its slope is zero."""
        middle = np.clip(self.point(x), STEP, 1.0 - STEP)
        aside = STEP * np.eye(len(middle))
        points = np.concatenate([middle + aside, middle - aside, middle[None]])
        read = self.archive.for_slopes(self.hypothesis.run, points).astype(float)
        ahead, behind, here = read[: len(middle)], read[len(middle) : -1], read[-1]
        with np.errstate(invalid="ignore"):
            smooth = np.abs(ahead + behind - 2.0 * here) <= BENT * np.abs(ahead - behind)
        moved = [np.where(smooth, one, here) for one in (ahead, behind)]
        ends = self.problem.residuals(self.pieces(np.concatenate(moved)), points[:-1])
        return (ends[: len(middle)] - ends[len(middle) :]).T / (2.0 * STEP)

    def visited(self) -> tuple[Floats, Floats]:
        """All visited points (n, nu) of its runs, and their residuals (n, nr)."""
        points, readings = self.archive.visited(self.hypothesis.run)
        return points, self.problem.residuals(self.pieces(readings), points)

    def costs_visited(self) -> tuple[Floats, Floats]:
        """All visited points (n, nu) of its runs, and their costs (n,)."""
        points, residuals = self.visited()
        return points, (residuals**2).sum(axis=1)

    def lowest(self) -> float:
        """Lowest cost of the visited points."""
        return float(self.costs_visited()[1].min())

    def cost_at(self, points: Floats) -> Floats:
        """Costs (n,) at points (n, nu), which are asked for where they were not visited."""
        return (self.residuals_at(points) ** 2).sum(axis=1)
