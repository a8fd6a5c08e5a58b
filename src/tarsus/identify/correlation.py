"""How parameters hang together: correlations, and the products of powers or sums that draws or a ridge hold fixed."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations, product
from math import gcd

import numpy as np
from numpy.typing import NDArray

from tarsus.fit.ranges import Range
from tarsus.fit.verdict import LEVEL, WIDTH

__all__ = ["Combination", "Sum", "Ties", "correlation", "find_exponents", "find_weight", "left_over"]

Floats = NDArray[np.float64]

_STEEPEST = 20.0
"""Largest ratio of two exponents in a product: beyond, one number is so much better known that it ties nothing."""


@dataclass(frozen=True)
class Combination:
    """A product of powers of parameters, and where it lies.

    exponents: by parameter, in the order of the parameters; interval: of the product (magnitudes, SI); whole: whether
    the exponents are small whole numbers chosen for being simple, or those fitted.
    """

    exponents: tuple[tuple[str, float], ...]
    interval: Range
    whole: bool

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters in the product."""
        return tuple(name for name, _ in self.exponents)

    def __str__(self) -> str:
        ordered = sorted(self.exponents, key=lambda one: one[1] < 0.0)
        return " * ".join(name if power == 1.0 else f"{name}^{power:.3g}" for name, power in ordered)


@dataclass(frozen=True)
class Sum:
    """A weighted sum of two parameters, such as a force that grows from a start at a rate, and where it lies.

    weights: by parameter, that of the first is 1, SI; interval: of the sum, SI.
    """

    weights: tuple[tuple[str, float], ...]
    interval: Range

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters in the sum."""
        return tuple(name for name, _ in self.weights)

    def __str__(self) -> str:
        return " + ".join(
            name if weight == 1.0 else f"{weight:.3g} * {name}" for name, weight in self.weights
        )


@dataclass(frozen=True)
class Ties:
    """What counts as parameters tied to each other.

    width: half-width (see `Range.half_width`) up to which a product of powers, or a sum, counts as known, with the
    exponent or weight of the parameter in question 1; gain: times by which it must be narrower than the parameter
    itself; partners: largest number of other parameters in a product; power: largest whole exponent that is tried;
    slack: times by which whole exponents may be wider than the fitted ones.
    """

    width: float = WIDTH
    gain: float = 3.0
    partners: int = 2
    power: int = 4
    slack: float = 1.5


def correlation(u: Floats) -> Floats:
    """Pearson's correlations (np, np) of draws (ns, np); NaN for a parameter that does not vary."""
    spread = u.std(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.cov(u, rowvar=False, ddof=0).reshape(len(spread), -1) / np.outer(spread, spread)


def find_exponents(
    u: Floats, j: int, others: list[int], ties: Ties, level: float = LEVEL
) -> list[tuple[Floats, bool]]:
    """Products of powers with parameter j that a cloud of points holds within ``ties.width``.

    Fewest partners first: for every set of them the exponents that leave least of ``u_j`` (least squares) are tried,
    and the narrowest set decides. Its exponents are then those of the smallest singular value of the cloud, and
    preferred to them are the smallest whole numbers that are as narrow, within ``ties.slack`` or a fifth of
    ``ties.width``.

    Parameters
    ----------
    u
        Logarithms of the parameters (ns, np).
    j
        Number of the parameter in question.
    others
        Numbers of those it may be tied to.
    level
        Share of the points that the width is taken of; 1 for all.

    Returns
    -------
    list
        Exponents (np,), scaled so that the smallest is 1, and whether they are whole: first the preferred ones. Empty
        where there is no such product.
    """
    v = u - np.median(u, axis=0)
    own = float(_half_width(v[:, [j]], level)[0])
    for size in range(1, ties.partners + 1):
        best: tuple[float, list[int], Floats] | None = None
        for chosen in combinations(others, size):
            columns = [j, *chosen]
            slopes = np.linalg.lstsq(v[:, list(chosen)], v[:, j], rcond=None)[0]
            powers = np.concatenate([[1.0], -slopes])
            steepness = np.abs(powers)
            if not steepness.max() <= _STEEPEST * steepness.min():
                continue
            width = float(_half_width(v[:, columns] @ powers[:, None], level)[0])
            if best is None or width < best[0]:
                best = (width, columns, powers)
        if best is not None and best[0] <= min(ties.width, own / ties.gain):
            return _preferred(v, best[1], best[2], own, ties, level)
    return []


def find_weight(
    x: Floats, j: int, others: list[int], ties: Ties, level: float = LEVEL
) -> tuple[int, float, float] | None:
    """The sum ``x_j + w x_k``, ``w x_k`` of the sign of x_j, that a cloud of points holds within ``ties.width``.

    Parameters
    ----------
    x
        Parameters (ns, np), each of one sign.
    j, others, ties, level
        As for `find_exponents`.

    Returns
    -------
    tuple
        k, w, and what the sum leaves of x_j (half-width, SI) when x_k is known; None where there is no such sum.
    """
    own = float(_half_width(x[:, [j]], level)[0])
    best: tuple[int, float, float] | None = None
    for k in others:
        apart = x[:, k] - x[:, k].mean()
        weight = -float(apart @ (x[:, j] - x[:, j].mean())) / float(apart @ apart)
        total = x[:, j] + weight * x[:, k]
        middle = float(np.median(total))
        if weight * np.sign(x[0, j] * x[0, k]) <= 0.0:
            continue
        left = float(_half_width(total[:, None], level)[0])
        if left <= min(ties.width * abs(middle), own / ties.gain) and (best is None or left < best[2]):
            best = (k, weight, left)
    return best


def left_over(u: Floats, j: int, powers: Floats, level: float = LEVEL) -> float:
    """Half-width of the logarithm of parameter j that a product of powers (np,) leaves when its partners are known."""
    return float(_half_width((u @ powers)[:, None], level)[0]) / abs(float(powers[j]))


def _preferred(
    v: Floats, columns: list[int], regressed: Floats, own: float, ties: Ties, level: float
) -> list[tuple[Floats, bool]]:
    """Exponents (np,) in order of preference, for the first of some columns."""
    cloud = v[:, columns]
    across = np.linalg.svd(cloud - cloud.mean(axis=0), full_matrices=False)[2][-1]
    fitted = regressed
    if abs(across[0]) > 1e-3 * np.abs(across).max():
        turned = across / across[0]
        if _half_width(cloud @ turned[:, None], level)[0] <= ties.slack * _half_width(
            cloud @ regressed[:, None], level
        ):
            fitted = turned
    if np.abs(fitted).min() < 0.5 / ties.power**2:  # a partner that hardly matters
        fitted = regressed
    narrowest = float(_half_width(cloud @ fitted[:, None], level)[0])
    allowed = min(max(ties.slack * narrowest, 0.2 * ties.width), ties.width, own / ties.gain)
    whole = _whole(np.sign(fitted), ties.power)
    widths = _half_width(cloud @ (whole / whole[:, :1]).T, level)
    fine = np.flatnonzero(widths <= allowed)
    out = []
    if len(fine):
        effort = np.abs(whole[fine]).sum(axis=1)
        first = fine[np.lexsort((widths[fine], effort))[0]]
        out.append((_spread_out(whole[first], columns, v.shape[1]), True))
    out.append((_spread_out(fitted / np.abs(fitted).min(), columns, v.shape[1]), False))
    return out


def _whole(signs: Floats, power: int) -> Floats:
    """Whole exponents (m, k) of given signs (k,) up to a power, the smallest 1 or 2, none a multiple of another."""
    rows = [
        row for row in product(range(1, power + 1), repeat=len(signs)) if gcd(*row) == 1 and min(row) <= 2
    ]
    return np.array(rows, dtype=float) * np.where(signs < 0.0, -1.0, 1.0)


def _spread_out(powers: Floats, columns: list[int], count: int) -> Floats:
    """Exponents (np,) of all parameters, the smallest positive."""
    out = np.zeros(count)
    out[columns] = powers
    used = np.flatnonzero(out)
    return out * np.sign(out[used[np.argmin(np.abs(out[used]))]])


def _half_width(columns: Floats, level: float) -> Floats:
    """Half of the interval between equal tails of columns (ns, m): (m,)."""
    low, high = np.quantile(columns, [0.5 - 0.5 * level, 0.5 + 0.5 * level], axis=0)
    return 0.5 * (high - low)
