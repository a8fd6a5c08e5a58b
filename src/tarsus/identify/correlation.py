"""How parameters are correlated, and the product of two, one to a power, that draws hold fixed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.fit.ranges import Range
from tarsus.fit.verdict import LEVEL, WIDTH

_STEEPEST = 20.0
"""Largest ratio of the two exponents: beyond, one number is so much better known that it ties nothing."""
_GAIN = 3.0
"""Times by which a product must be narrower than the parameter in question, and at least as narrow as a determined
number (`tarsus.fit.verdict.WIDTH`)."""


@dataclass(frozen=True)
class Combination:
    """A product of two parameters, the second to a power: names, power, and where it lies (magnitudes, SI)."""

    names: tuple[str, str]
    power: float
    interval: Range

    def __str__(self) -> str:
        return f"{self.names[0]} * {self.names[1]}^{self.power:.3g}"


def correlation(u: Floats) -> Floats:
    """Pearson's correlations (np, np) of draws (ns, np); NaN for a parameter that does not vary."""
    spread = u.std(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.cov(u, rowvar=False, ddof=0).reshape(len(spread), -1) / np.outer(spread, spread)


def find_product(u: Floats, j: int, others: Sequence[int]) -> tuple[int, int, float] | None:
    """The narrowest product of parameter j and another one that a cloud of points holds within `WIDTH`.

    Parameters
    ----------
    u
        Logarithms of the parameters (ns, np).
    j
        Number of the parameter in question.
    others
        Numbers of those it may be tied to.

    Returns
    -------
    tuple
        Numbers of both in their order, and the power of the second, along which the cloud is narrowest; None where
        there is no such product.
    """
    found: list[tuple[float, tuple[int, int, float]]] = []
    for k in others:
        first, second = sorted((j, k))
        cloud = u[:, [first, second]]
        across = np.linalg.svd(cloud - cloud.mean(axis=0), full_matrices=False)[2][-1]
        size = np.abs(across)
        if size.max() <= _STEEPEST * size.min():
            left = half_width(cloud @ across) / abs(float(across[0 if j == first else 1]))
            found.append((left, (first, second, float(across[1] / across[0]))))
    left, best = min(found, default=(np.inf, None))
    return best if left <= min(WIDTH, half_width(u[:, j]) / _GAIN) else None


def half_width(values: Floats) -> float:
    """Half of the interval between equal tails of values (ns,)."""
    low, high = np.quantile(values, [0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL])
    return float(0.5 * (high - low))
