"""Numbers with their spread: the mean of plain estimates, and a ratio that many noisy pairs have in common."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri, stdtrit

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError

_ROUNDS = 50
"""Rounds of the ratio at most: it ends before, at rounding."""


@dataclass(frozen=True)
class Spread:
    """A number estimated from n impacts.

    value; std: standard error of ``value``; low, high: its 95 % interval; scatter: standard deviation from impact to
    impact (the source's "0.51 +- 0.11"), for a common ratio without the part that noise explains; n impacts.
    """

    value: float
    std: float
    low: float
    high: float
    scatter: float
    n: int

    def __str__(self) -> str:
        return f"{self.value:.4g} [{self.low:.4g}, {self.high:.4g}], scatter {self.scatter:.2g}, n = {self.n}"


def spread(values: ArrayLike) -> Spread:
    """Mean of independent values (n,), in their unit, with Student's 95 % interval (NaN of a single one).

    Raises
    ------
    InputError
        If there is no value.
    """
    known = np.asarray(values, dtype=float)
    if not known.size:
        raise InputError("there is no value to take the mean of")
    mean = float(known.mean())
    if known.size == 1:
        return Spread(mean, np.nan, np.nan, np.nan, np.nan, 1)
    scatter = float(known.std(ddof=1))
    std = scatter / np.sqrt(known.size)
    half = float(stdtrit(known.size - 1, 0.975)) * std
    return Spread(mean, std, mean - half, mean + half, scatter, int(known.size))


def common_ratio(
    numerator: ArrayLike,
    denominator: ArrayLike,
    covariance: ArrayLike,
    shared: ArrayLike | None = None,
    following: ArrayLike | None = None,
) -> Spread:
    """The ratio y / x that n pairs have in common, with known noise in both.

    Errors-in-variables regression through the origin: the noise of ``y - ratio x`` weighs a pair, and the estimate of
    x that goes into the score is the one the pair as a whole supports, so that noise in x does not pull the ratio
    towards zero. A scatter of the ratio itself from pair to pair is estimated with the noise (DerSimonian and Laird
    1986) and widens the interval; the interval is that of Hartung and Knapp (2001), from the weighted residuals with
    n - 1 degrees of freedom. A single pair has the interval of its noise.

    Parameters
    ----------
    numerator, denominator
        y and x (n,).
    covariance
        Of each pair (y, x), shape (n, 2, 2).
    shared
        Errors that pairs have in common: shifts (m, n, 2) of every (y, x) by one standard deviation of each of m
        independent disturbances. They do not average out over pairs and widen the interval; the scatter between pairs
        knows nothing of them.
    following
        Covariance (n - 1, 2, 2) of each pair with the one after it, where both are made of the same samples.

    Raises
    ------
    InputError
        If there is no pair.
    """
    y, x = np.asarray(numerator, dtype=float), np.asarray(denominator, dtype=float)
    cov = np.asarray(covariance, dtype=float).reshape(-1, 2, 2)
    if not y.size:
        raise InputError("there is no impact to take a ratio of")
    ratio, scatter = _solve(y, x, cov, 0.0), 0.0
    if y.size > 1:
        scatter = _scatter(y, x, cov, ratio)
        ratio = _solve(y, x, cov, scatter)
    residual, support, weight = supported(y, x, cov, ratio, scatter)
    total = float(np.sum(weight * support**2))
    if y.size == 1:
        std, reach = total**-0.5, float(ndtri(0.975))
    else:
        std = float(np.sqrt(np.sum(weight * residual**2) / (y.size - 1) / total))
        reach = float(stdtrit(y.size - 1, 0.975))
    if following is not None:
        pull, turn = weight * support, np.array([1.0, -ratio])
        linked = pull[:-1] * pull[1:] * (turn @ np.asarray(following, dtype=float).reshape(-1, 2, 2) @ turn)
        std *= float(np.sqrt(max(1.0 + 2.0 * np.sum(linked) / total, 0.0)))
    if shared is not None:
        shifts = np.asarray(shared, dtype=float).reshape(-1, y.size, 2)
        pulled = (shifts[..., 0] - ratio * shifts[..., 1]) @ (weight * support) / total
        std = float(np.hypot(std, np.linalg.norm(pulled)))
    return Spread(ratio, std, ratio - reach * std, ratio + reach * std, float(np.sqrt(scatter)), int(y.size))


def supported(y: Floats, x: Floats, cov: Floats, ratio: float, scatter: float = 0.0) -> tuple[Floats, Floats, Floats]:
    """Residuals y - ratio x of pairs with covariances (n, 2, 2) of (y, x), the x that each pair as a whole supports
    (free of the noise that its residual has), and the weights of the residuals; each (n,). scatter: variance of the
    ratio from pair to pair."""
    residual = y - ratio * x
    noise = cov[:, 0, 0] - 2.0 * ratio * cov[:, 0, 1] + ratio**2 * cov[:, 1, 1]
    with_x = cov[:, 0, 1] - ratio * cov[:, 1, 1]
    support = x - with_x / noise * residual
    return residual, support, 1.0 / (noise + scatter * support**2)


def _solve(y: Floats, x: Floats, cov: Floats, scatter: float) -> float:
    """Root of the score. It is no least squares: weights and supports move with the ratio, and taking their slopes
    along would pull the ratio towards zero."""
    ratio = float(np.sum(x * y) / np.sum(x * x))
    for _ in range(_ROUNDS):
        residual, support, weight = supported(y, x, cov, ratio, scatter)
        change = float(np.sum(weight * residual * support) / np.sum(weight * support**2))
        ratio += change
        if abs(change) < 1e-12 * (1.0 + abs(ratio)):
            break
    return ratio


def _scatter(y: Floats, x: Floats, cov: Floats, ratio: float) -> float:
    """Variance of the ratio from pair to pair, by moments; never negative."""
    residual, support, weight = supported(y, x, cov, ratio, 0.0)
    precision = weight * support**2
    excess = float(np.sum(weight * residual**2)) - (y.size - 1)
    return max(0.0, excess / float(np.sum(precision) - np.sum(precision**2) / np.sum(precision)))
