"""Draws of an estimate: over blocks of its own data, and along with what earlier steps do not know."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t

__all__ = ["DRAWS", "carried", "drawn_counts", "newton_draws", "student"]

Floats = NDArray[np.float64]

DRAWS = 400
"""Draws of every step."""

_FACTOR = 0.5
_KEPT = 0.999


def drawn_counts(groups: int, seed: int, draws: int = DRAWS) -> Floats:
    """How often each of ``groups`` is drawn, with replacement, in every draw: (draws, groups)."""
    random = np.random.default_rng([seed, 11])
    return random.multinomial(groups, np.full(groups, 1.0 / groups), size=draws).astype(float)


def student(groups: float) -> float:
    """Factor on deviations of draws over few groups: n / (n - 1) in the variance, and Student's 97.5 % quantile."""
    if groups <= 1.5:
        return np.inf
    return float(np.sqrt(groups / (groups - 1.0)) * t.ppf(0.975, groups - 1.0) / 1.959964)


def newton_draws(information: Floats, score: Floats, seed: int, prior: Floats | None = None) -> Floats:
    """Deviations (draws, p) of an estimate when groups of its data are drawn, by one Gauss-Newton step each.

    Parameters
    ----------
    information, score
        Of each group about the parameters at the estimate, (g, p, p) and (g, p).
    seed
        Of the draws.
    prior
        Information (p, p) that is not drawn.
    """
    counts = drawn_counts(len(score), seed)
    total = information.sum(axis=0) + (0.0 if prior is None else prior)
    matrices = np.einsum("dg,gab->dab", counts, information) + 1e-4 * np.diag(np.diag(total))
    if prior is not None:
        matrices = matrices + prior
    moved = np.linalg.solve(matrices, (counts @ score)[..., None])[..., 0]
    share = np.einsum("gaa,a->g", information, 1.0 / np.maximum(np.diag(total), 1e-300))
    effective = float(share.sum() ** 2 / np.sum(share**2)) if share.any() else 0.0
    return moved * min(student(effective), 20.0)


def carried(
    estimate: Callable[[Floats], Floats], values: Floats, samples: Floats, step: float = 1.0
) -> Floats:
    """What the uncertainty of earlier parameters does to an estimate: deviations (draws, p), one a draw of theirs.

    The estimate is taken as linear in them over their spread, or in their logarithms where they are known to a factor
    only: it is formed again with the earlier parameters moved by one standard deviation along each principal direction
    of their draws.

    Parameters
    ----------
    estimate
        Estimate (p,) for earlier parameters (q,).
    values
        Of the earlier parameters (q,).
    samples
        Their draws (draws, q).
    step
        Standard deviations to move by.
    """
    base = np.asarray(estimate(values), dtype=float)
    scaled = _by_factors(values, samples)

    def even(numbers: Floats) -> Floats:
        return np.where(scaled, np.log(np.where(scaled, np.abs(numbers), 1.0)), numbers)

    def back(numbers: Floats) -> Floats:
        return np.where(scaled, np.sign(values) * np.exp(np.where(scaled, numbers, 0.0)), numbers)

    off = even(samples) - even(values)
    size = np.sqrt(np.mean(off**2, axis=0))
    used = size > 0.0
    out = np.zeros((len(samples), len(base)))
    if not used.any():
        return out
    unit = off[:, used] / size[used]
    left, spread, right = np.linalg.svd(unit, full_matrices=False)
    share = np.cumsum(spread**2) / np.sum(spread**2)
    count = int(np.searchsorted(share, _KEPT)) + 1
    for k in range(min(count, len(spread))):
        one = spread[k] / np.sqrt(len(samples))
        direction = np.zeros(len(values))
        direction[used] = right[k] * one * size[used]
        moved = np.asarray(estimate(back(even(values) + step * direction)), dtype=float) - base
        out += np.outer(left[:, k] * np.sqrt(len(samples)), moved / step)
    return out


def _by_factors(values: Floats, samples: Floats) -> NDArray[np.bool_]:
    """Parameters (q,) that are known to a factor only: draws of one sign that spread by half the value or more. They
    move by factors, for one that is added would lead to where no draw lies."""
    wide = np.std(samples, axis=0) > _FACTOR * np.abs(values)
    return wide & np.all(samples * values > 0.0, axis=0)
