"""Each row excluded once: the search of somebody who does not have it, and what that one says of it.

Nothing of a row gets into its own prediction. The problem that is searched lacks its cells and its run, the archive is
empty, the random numbers are its own, and the search is the whole one of the study: prescreening, every hypothesis, all
generations. The row is simulated for the members of the finished ensembles alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats
from tarsus.calibrate.ensemble import SearchedEnsembles, searched_ensembles
from tarsus.calibrate.prediction import Discrepancy, Prediction, discrepancy_of

if TYPE_CHECKING:
    from tarsus.calibrate.description import Search
    from tarsus.calibrate.problem import Archive, CalibrationProblem


@dataclass(frozen=True)
class ExcludedRow:
    """A row predicted without it.

    row: its place in the table's fitted rows; fit: what the search without it found; readings (nm, channels, samples)
    of each ensemble's members in the row; missed (nk,): weighted residuals there; wrong (nk,): probability of the
    wrong existence.
    """

    row: int
    fit: SearchedEnsembles
    readings: tuple[NDArray[np.floating], ...]
    missed: Floats
    wrong: Floats

    def predictions(
        self, problem: CalibrationProblem, discrepancy: Discrepancy | None = None
    ) -> tuple[Prediction, ...]:
        """Predictions of the row, ``problem`` being that of the whole table; with the fit's own discrepancy unless
        another is given."""
        return self.fit.predictions(problem, self.row, self.readings, discrepancy)


def exclude(
    problem: CalibrationProblem, search: Search, row: int, archive: Callable[[CalibrationProblem, int], Archive]
) -> ExcludedRow:
    """Search without a row of the table, and simulate it with what was found.

    archive: makes an empty one of a problem, for the search of this number (`row` + 1; 0 is that of the whole table).
    """
    own = archive(problem.without(row), row + 1)
    fit = searched_ensembles(own, search)
    alone = problem.objective.only(row)
    readings, missed, wrong = [], np.zeros(alone.cells.observed.shape[1]), 0.0
    for weight, one in zip(fit.weights, fit.ensembles, strict=True):
        read = own.elsewhere(one.hypothesis.run, one.points, problem.rows[row])
        costs = alone.pieces(read[:, None], one.hypothesis).costs
        missed = missed + weight * (one.weights @ costs.missed[:, 0])
        wrong = wrong + weight * (one.weights @ costs.wrong[:, 0])
        readings.append(read)
    return ExcludedRow(row, fit, tuple(readings), missed, np.asarray(wrong))


def missed_by(problem: CalibrationProblem, found: list[ExcludedRow], row: int | None = None) -> Discrepancy:
    """Discrepancy from what each excluded row was missed by; those of a row itself stay out of its own prediction,
    which is so a test of what is said of new rows."""
    others = [one for one in found if one.row != row]
    missed, wrong = (np.array([getattr(one, name) for one in others]) for name in ("missed", "wrong"))
    return discrepancy_of(problem.objective.cells, missed, wrong, 0.0, fitted=False)
