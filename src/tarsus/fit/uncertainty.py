"""How sure a fit is of its numbers: standard errors and correlations from the Jacobian of the residuals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats

if TYPE_CHECKING:
    from tarsus.fit.unknowns import Unknowns


@dataclass(frozen=True)
class Uncertainty:
    """Standard errors of the nu unknowns of a fit, by the curvature of its cost.

    errors: standard error [SI] by name, infinite where the residuals do not determine it; correlations (nu, nu), in
    the order of the names, NaN in the rows of such numbers; notes: sentences on what they do not hold for.
    """

    errors: dict[str, float]
    correlations: Floats
    notes: tuple[str, ...] = ()


def uncertainty_of(jacobian: Floats, unknowns: Unknowns, x: Floats) -> Uncertainty:
    """Standard errors and correlations at a point x (nu,) of the cube, from derivatives (nr, nu) of the residuals.

    With residuals in units of their errors, the cost is -log likelihood and the covariance of the unknowns
    ``(J^T J)^-1`` (the Cramer-Rao bound of the problem made linear at x); standard errors [SI] are the roots of its
    diagonal times the slopes of the SI values over the cube. Errors that were stated too small make them too small.
    """
    _, sizes, directions = np.linalg.svd(jacobian, full_matrices=True)
    sizes = np.concatenate([sizes, np.zeros(len(directions) - len(sizes))])
    # rounding of the decomposition, as numpy's matrix_rank has it
    seen = sizes > max(jacobian.shape) * np.finfo(float).eps * float(sizes.max(initial=0.0))
    shares = directions[seen] / sizes[seen, None]
    covariance = shares.T @ shares
    undetermined = (directions[~seen] ** 2).sum(axis=0) > np.finfo(
        float
    ).eps ** 0.5  # of a unit vector: more than rounding
    size = np.sqrt(np.diag(covariance))
    errors = np.where(undetermined, np.inf, size * np.abs(unknowns.slopes(x)))
    known = ~undetermined & (size > 0.0)
    scale = np.where(known, size, 1.0)
    correlations = np.where(known[:, None] & known[None], covariance / np.outer(scale, scale), np.nan)
    return Uncertainty(
        dict(zip(unknowns.names, errors.tolist(), strict=True)), correlations, _notes(unknowns, x, undetermined)
    )


def _notes(unknowns: Unknowns, x: Floats, undetermined: NDArray[np.bool_]) -> tuple[str, ...]:
    """Sentences on numbers that the residuals do not determine, or that ended at a bound."""
    names = np.array(unknowns.names)
    notes = []
    if undetermined.any():
        notes.append(f"the residuals do not determine {', '.join(names[undetermined])}: the Jacobian is singular there")
    ends = (x <= 0.0) | (x >= 1.0)
    if ends.any():
        notes.append(f"{', '.join(names[ends])} ended at a bound, where a standard error is no interval")
    return tuple(notes)
