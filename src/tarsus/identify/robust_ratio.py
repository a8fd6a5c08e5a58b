"""The ratio that noisy pairs have in common, by Student's weights: a few pairs that are something else pull it little.

Pairs are of events, which repeats of a record show several times over: an event counts once, however often it is seen,
and its repeats only make it less noisy.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import ndtr, stdtrit

from tarsus.base.arrays import Floats
from tarsus.impacts.estimates import supported

_FREEDOM = 4.0
"""Degrees of freedom of Student's distribution, as is usual (Lange, Little and Taylor 1989): of normal events the
estimate is a tenth wider than the mean, and one that is far off pulls by the inverse of how far."""
_ROUNDS = 100
"""Rounds at most; they end before, at rounding."""
_WIDER = 1.04
"""Standard error of a slope with Student's weights over that of least squares, of normal events."""
STEEP = 3.0
"""Standard errors of a slope over speed that chance has once in four hundred campaigns."""
_CLIPPED = 3.0
"""Deviations that an event pulls by at most where it is asked along what it goes: one that is far off is one event."""


def _weight(off: Floats) -> Floats:
    """Student's weights of deviations."""
    return (_FREEDOM + 1.0) / (_FREEDOM + off**2)


_GRID = np.linspace(-8.0, 8.0, 4001)
_NORMAL = float(np.sum(np.exp(-0.5 * _GRID**2) * _weight(_GRID) * _GRID**2) / np.sum(np.exp(-0.5 * _GRID**2)))
"""Mean square of normal deviations with these weights: that of events at the scatter that is found."""


@dataclass(frozen=True)
class RobustRatio:
    """value; scatter: standard deviation of the ratio from event to event, beyond noise; of pairs (n,): left: ratio of
    its event less the value; off: the same, in its standard deviations; information, score: of the value, each pair as
    it has part in its event; clipped: score in which no event pulls by more than `_CLIPPED` deviations; weight: by
    how much a score changes with y less the ratio times x; support: x of a pair, free of the noise that its residual
    has."""

    value: float
    scatter: float
    left: Floats
    off: Floats
    information: Floats
    score: Floats
    clipped: Floats
    weight: Floats
    support: Floats

    @property
    def clipped_information(self) -> Floats:
        """Information (n,) of the clipped scores: what they change by with the value."""
        return self.weight * self.support


def robust_ratio(y: Floats, x: Floats, covariance: Floats, events: NDArray[np.intp]) -> RobustRatio:
    """The ratio y / x of pairs (n,) with known noise in both, of numbered events.

    Parameters
    ----------
    y, x
        Of pairs (n,); x is seen beyond its noise.
    covariance
        Of each pair (y, x), (n, 2, 2).
    events
        Number (n,) of the event that a pair shows.
    """
    of = np.unique(events, return_inverse=True)[1]
    value, scatter, change = float(np.median(np.bincount(of, x * y) / np.bincount(of, x * x))), 0.0, np.inf
    for _ in range(_ROUNDS):
        residual, support, weight, known, left = _by_event(y, x, covariance, of, value)
        scatter = _scatter(left, 1.0 / known)
        variance = 1.0 / known + scatter
        student = _weight(left / np.sqrt(variance))
        change = float(np.sum(student * left / variance) / np.sum(student / variance))
        value += change
        if abs(change) < 1e-12 * (1.0 + abs(value)):
            break
    off = left / np.sqrt(variance)
    # slope of the score by the value, as the events have it: of far ones it is negative
    bent = (_FREEDOM + 1.0) * (_FREEDOM - off**2) / (_FREEDOM + off**2) ** 2
    slope = max(float(np.sum(bent / variance) * np.sum(1.0 / variance) ** -1), 0.5 * _FREEDOM / (_FREEDOM + 3.0))
    part = (weight * support**2 / known[of]) / variance[of]
    own = part * residual / support
    clip = np.minimum(_CLIPPED / np.maximum(np.abs(off), 1e-300), 1.0)
    return RobustRatio(
        value,
        float(np.sqrt(scatter)),
        left[of],
        off[of],
        slope * part,
        student[of] * own,
        clip[of] * own,
        part / support,
        support,
    )


def slope_over(y: Floats, x: Floats, covariance: Floats, events: NDArray[np.intp], value: float) -> tuple[float, float]:
    """By how much the ratio of events rises with the logarithm of x, and its standard error, with scatter from event to
    event beyond that slope; infinite where all x are one. A scatter of few events is itself uncertain: the error is so
    wide that `STEEP` of it are as rare as of a known one. Arguments as of `robust_ratio`; value: the ratio found."""
    of = np.unique(events, return_inverse=True)[1]
    _, support, _, known, left = _by_event(y, x, covariance, of, value)
    over = np.bincount(of, np.log(support)) / np.bincount(of)
    columns = np.stack([np.ones_like(over), over - over.mean()], axis=1)
    free = len(over) - 2
    if free < 1 or np.linalg.matrix_rank(columns) < 2:
        return 0.0, np.inf
    line, variance = np.zeros(2), 1.0 / known
    for _ in range(_ROUNDS):
        beyond = left - columns @ line
        variance = 1.0 / known + _scatter(beyond, 1.0 / known, 2)
        weighted = columns * (_weight(beyond / np.sqrt(variance)) / variance)[:, None]
        before, line = line, np.linalg.solve(weighted.T @ columns, weighted.T @ left)
        if np.abs(line - before).max() < 1e-12 * (1.0 + abs(value)):
            break
    information = columns.T @ (columns / variance[:, None])
    scattered = float(np.mean(1.0 - 1.0 / (known * variance)))  # share of the variance that is of the scatter
    known_to = free / max(scattered, 1e-3) ** 2  # degrees of freedom, after Welch and Satterthwaite
    wide = _WIDER * stdtrit(known_to, ndtr(STEEP)) / STEEP
    return float(line[1]), float(wide * np.sqrt(np.linalg.inv(information)[1, 1]))


def _by_event(
    y: Floats, x: Floats, covariance: Floats, of: NDArray[np.intp], value: float
) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Residual, x and weight (n,) of pairs about a ratio; of events (ne,), which ``of`` numbers (n,): information of
    the ratio, and the ratio less that value."""
    residual, support, weight = supported(y, x, covariance, value)
    known = np.asarray(np.bincount(of, weight * support**2), dtype=np.float64)
    return residual, support, weight, known, np.bincount(of, weight * support * residual) / known


def _scatter(left: Floats, noise: Floats, fitted: int = 0) -> float:
    """Variance that gives deviations (ne,), with that of noise (ne,), the weighted mean square of normal ones; fitted:
    numbers that were fitted to them."""

    def beyond(variance: float) -> float:
        off = left / np.sqrt(noise + variance)
        return float(np.sum(_weight(off) * off**2)) / (len(left) - fitted) - _NORMAL

    if not beyond(0.0) > 0.0:
        return 0.0
    most = float(np.max(left**2)) / _NORMAL * (_FREEDOM + 1.0) / _FREEDOM
    found: Any = brentq(beyond, 0.0, most * len(left) / (len(left) - fitted))
    return float(found)
