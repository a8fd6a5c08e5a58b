"""Offsets of the displacements of records, determined by the impacts in them.

Where the ground is as seen from a record is known from the rest before it, some ten nanometres uncertain, and from the
common level of all records. At an impact the structure's modes accelerate the foot by thousands of m/s^2, so that its
velocity at the ground hangs on that. The flights before and after an impact meet at the ground, which tells it as well.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.fit.normal_equations import NormalEquations
from tarsus.identify.bounce import Bounces
from tarsus.identify.draws import DRAWS
from tarsus.identify.foot import FootModel

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class RecordOffsets:
    """What is to be added to the displacements of each record's points.

    by_offset (ni, 2, nr np): change of departure and approach velocity of each impact with it [1/s]; values (nr, np)
    [m]; samples (draws, nr, np); record (ni,): number of each impact's record."""

    by_offset: Floats
    values: Floats
    samples: Floats
    record: NDArray[np.intp]

    def moved(self, speeds: Floats, values: Floats) -> Floats:
        """Departure and approach velocities (ni, 2) for offsets (nr, np)."""
        return speeds + self.by_offset @ values.ravel()


def known_offsets(model: FootModel, bounces: Bounces, level_error: float) -> Floats:
    """Information (nr np, nr np) [1/m^2] about the zeros of the records with impacts, in the order of their numbers,
    from the rest of each and the common level [m]."""
    names = np.unique([one.trace for one in bounces.items])
    shift = (model.rest(bounces.level + 1e-6) - model.rest(bounces.level)) / 1e-6
    own = np.concatenate([bounces.traces[int(name)].zero ** 2 for name in names])
    common = np.tile(shift, len(names)) * level_error
    return np.asarray(np.linalg.inv(np.diag(own) + np.outer(common, common)), dtype=np.float64)


def offsets_of_records(
    model: FootModel, bounces: Bounces, equations: NormalEquations, level_error: float, seed: int
) -> RecordOffsets:
    """Least squares of all records together: each record's offsets are known to the error of its rest, the ground to
    that of the level, and the impacts tell the rest.

    equations: of the impacts about the film and the offsets (`Bounces.about`); the film is known.
    """
    record = np.unique([one.trace for one in bounces.items], return_inverse=True)[1]
    information, score = equations.reduced()
    covariance = np.linalg.inv(
        information[:, 2:, 2:].sum(axis=0) + known_offsets(model, bounces, level_error)
    )
    values = covariance @ score[:, 2:].sum(axis=0)
    random = np.random.default_rng([seed, 19])
    drawn = random.multivariate_normal(values, 0.5 * (covariance + covariance.T), DRAWS, method="cholesky")
    shape = -1, len(model.points)
    by_offset = np.asarray(
        -np.linalg.solve(equations.own, equations.across)[:, [-1, -2], 2:], dtype=np.float64
    )
    return RecordOffsets(
        by_offset, values.reshape(shape), drawn.reshape(DRAWS, *values.reshape(shape).shape), record
    )
