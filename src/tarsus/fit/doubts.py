"""What a fit has to doubt of its numbers: residuals that are correlated, and other valleys that are as deep."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from tarsus.base.arrays import Floats

CHANCE = 1e-3
"""Probability with which residuals of a right model and right errors raise a doubt: one fit of a thousand."""

CORRELATED = 3.3
"""Standard errors 1/sqrt(n) of a correlation of n white residuals beyond which they are correlated: the same chance."""

SHORTEST = 20
"""Samples of a record from which its residuals are asked: the correlation of fewer has a standard error above 0.22."""

LONGEST = 0.25
"""Lags that are added up at most, in parts of a record: of longer ones less than four stretches are independent."""

AS_DEEP = 1.92
"""Half of the 95 % point of chi squared of one number: what a cost may be above the least for a valley to count."""


@dataclass(frozen=True)
class Doubts:
    """What is left of the certainty of nu unknowns.

    errors (nu,): standard errors in the cube, never below those of the stated errors; failed (nu,): whether the model
    errs by more of the number than those say; notes: sentences.
    """

    errors: Floats
    failed: NDArray[np.bool_]
    notes: tuple[str, ...] = ()


def doubts_of(residuals: Floats, jacobian: Floats, records: Sequence[slice], errors: Floats) -> Doubts:
    """The doubts that residuals (nr,) leave, with their Jacobian (nr, nu) at the point that was found.

    Residuals are in units of their stated errors. Where their squares sum to more than chance allows, or where those of
    a record are correlated, what they say of the unknowns scatters by the sum of their products at all lags up to that
    at which they no longer are (the sandwich of White, and of Newey and West).

    Parameters
    ----------
    residuals, jacobian
        At the point; priors among them.
    records
        Rows that are samples of one record in order of time.
    errors
        Standard errors (nu,) in the cube by the stated errors; infinite where the data say nothing.
    """
    lags = {at.start: lag for at in records if (lag := _lag(residuals[at])) > 0}
    free = max(len(residuals) - jacobian.shape[1], 1)
    squares = float(residuals @ residuals)
    large = chdtrc(free, squares) < CHANCE
    if not (lags or large):
        return Doubts(errors, np.zeros(len(errors), dtype=bool))
    spread = _sandwich(residuals, jacobian, records, lags)
    wider = np.isfinite(errors) & (spread > errors)
    failed = wider & bool(lags)
    return Doubts(
        np.where(wider, spread, errors), failed, _notes(residuals, records, lags, squares / free, failed, wider)
    )


def _lag(record: Floats) -> int:
    """Samples over which the residuals of a record are correlated: the first lag at which they no longer are; 0 where
    none is with the next."""
    count = len(record)
    size = float(record @ record)
    if count < SHORTEST or size == 0.0:
        return 0
    limit = CORRELATED / np.sqrt(count)
    most = int(LONGEST * count)
    for lag in range(1, most + 1):
        if float(record[lag:] @ record[:-lag]) / size <= limit:
            return lag - 1
    return most


def _sandwich(residuals: Floats, jacobian: Floats, records: Sequence[slice], lags: dict[int, int]) -> Floats:
    """Standard errors (nu,) in the cube by what the residuals are, not by what was stated."""
    scores = jacobian * residuals[:, None]
    middle = scores.T @ scores
    for at in records:
        lag = lags.get(at.start, 0)
        own = scores[at]
        for k in range(1, lag + 1):
            product = own[k:].T @ own[:-k]
            middle += (1.0 - k / (lag + 1.0)) * (product + product.T)
    bread = np.linalg.pinv(jacobian.T @ jacobian, hermitian=True)
    return np.sqrt(np.maximum(np.diag(bread @ middle @ bread), 0.0))


def _notes(
    residuals: Floats,
    records: Sequence[slice],
    lags: dict[int, int],
    ratio: float,
    failed: NDArray[np.bool_],
    wider: NDArray[np.bool_],
) -> tuple[str, ...]:
    notes = []
    if failed.any():
        worst = max((at for at in records if at.start in lags), key=lambda at: lags[at.start])
        own = residuals[worst]
        notes.append(
            f"residuals are correlated over {lags[worst.start]} of {len(own)} samples and are "
            f"{np.sqrt(np.mean(own**2)):.3g} of their stated errors: the model deviates by more than noise, and "
            "intervals are widened by what it leaves"
        )
    elif wider.any():
        notes.append(
            f"residuals are {np.sqrt(ratio):.3g} of their stated errors: intervals are widened by what they are"
        )
    return tuple(notes)


def as_deep(costs: Sequence[float], least: float, scale: float) -> list[int]:
    """Which valleys (n) have a cost that a 95 % interval of one number does not tell from the least; scale: mean square
    of the residuals there, at least 1."""
    return [k for k, cost in enumerate(costs) if cost <= least + AS_DEEP * max(scale, 1.0)]
