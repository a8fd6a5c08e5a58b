"""How parameters hang together: correlations, and the products of powers or sums that draws or a ridge hold fixed."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations, product
from math import gcd

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.fit.ranges import Range
from tarsus.fit.verdict import LEVEL, WIDTH

_STEEPEST = 20.0
"""Largest ratio of two exponents in a product: beyond, one number is so much better known that it ties nothing."""
GAIN = 3.0
"""Times by which a product or sum, with the exponent or weight of the parameter in question 1, must be narrower than
the parameter itself, beside being as narrow as a determined number (`tarsus.fit.verdict.WIDTH`)."""
_PARTNERS = 2
"""Largest number of other parameters in a product."""
_POWER = 4
"""Largest whole exponent that is tried."""
SLACK = 1.5
"""Times by which whole exponents may be wider than the fitted ones."""


@dataclass(frozen=True)
class Combination:
    """A product of powers of parameters, or a weighted sum of two, such as a force that grows from a start at a rate,
    and where it lies.

    terms: exponents, or weights (that of the first is 1, SI), by parameter; interval: of the product (magnitudes) or
    the sum, SI; whole: whether exponents are small whole numbers chosen for being simple, or those fitted.
    """

    terms: tuple[tuple[str, float], ...]
    interval: Range
    whole: bool = False
    product: bool = True

    @property
    def names(self) -> tuple[str, ...]:
        """Its parameters."""
        return tuple(name for name, _ in self.terms)

    def __str__(self) -> str:
        if not self.product:
            return " + ".join(
                name if weight == 1.0 else f"{weight:.3g} * {name}" for name, weight in self.terms
            )
        ordered = sorted(self.terms, key=lambda one: one[1] < 0.0)
        return " * ".join(name if power == 1.0 else f"{name}^{power:.3g}" for name, power in ordered)


def correlation(u: Floats) -> Floats:
    """Pearson's correlations (np, np) of draws (ns, np); NaN for a parameter that does not vary."""
    spread = u.std(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.cov(u, rowvar=False, ddof=0).reshape(len(spread), -1) / np.outer(spread, spread)


def find_exponents(u: Floats, j: int, others: list[int]) -> list[tuple[Floats, bool]]:
    """Products of powers with parameter j that a cloud of points holds within `WIDTH`.

    Fewest partners first: for every set of them the exponents that leave least of ``u_j`` (least squares) are tried,
    and the narrowest set decides. Its exponents are then those of the smallest singular value of the cloud, and
    preferred to them are the smallest whole numbers that are as narrow, within ``SLACK`` or a fifth of
    `WIDTH`.

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
    list
        Exponents (np,), scaled so that the smallest is 1, and whether they are whole: first the preferred ones. Empty
        where there is no such product.
    """
    v = u - np.median(u, axis=0)
    own = float(_half_width(v[:, [j]])[0])
    for size in range(1, _PARTNERS + 1):
        best: tuple[float, list[int], Floats] | None = None
        for chosen in combinations(others, size):
            columns = [j, *chosen]
            slopes = np.linalg.lstsq(v[:, list(chosen)], v[:, j], rcond=None)[0]
            powers = np.concatenate([[1.0], -slopes])
            steepness = np.abs(powers)
            if not steepness.max() <= _STEEPEST * steepness.min():
                continue
            width = float(_half_width(v[:, columns] @ powers[:, None])[0])
            if best is None or width < best[0]:
                best = (width, columns, powers)
        if best is not None and best[0] <= min(WIDTH, own / GAIN):
            return _preferred(v, best[1], best[2], own)
    return []


def find_weight(x: Floats, j: int, others: list[int]) -> tuple[int, float, float] | None:
    """The sum ``x_j + w x_k``, ``w x_k`` of the sign of x_j, that a cloud of points holds within `WIDTH`.

    Parameters
    ----------
    x
        Parameters (ns, np), each of one sign.
    j, others
        As for `find_exponents`.

    Returns
    -------
    tuple
        k, w, and what the sum leaves of x_j (half-width, SI) when x_k is known; None where there is no such sum.
    """
    own = float(_half_width(x[:, [j]])[0])
    best: tuple[int, float, float] | None = None
    for k in others:
        apart = x[:, k] - x[:, k].mean()
        weight = -float(apart @ (x[:, j] - x[:, j].mean())) / float(apart @ apart)
        total = x[:, j] + weight * x[:, k]
        middle = float(np.median(total))
        if weight * np.sign(x[0, j] * x[0, k]) <= 0.0:
            continue
        left = float(_half_width(total[:, None])[0])
        if left <= min(WIDTH * abs(middle), own / GAIN) and (best is None or left < best[2]):
            best = (k, weight, left)
    return best


def left_over(u: Floats, j: int, powers: Floats) -> float:
    """Half-width of the logarithm of parameter j that a product of powers (np,) leaves when its partners are known."""
    return float(_half_width((u @ powers)[:, None])[0]) / abs(float(powers[j]))


def _preferred(v: Floats, columns: list[int], regressed: Floats, own: float) -> list[tuple[Floats, bool]]:
    """Exponents (np,) in order of preference, for the first of some columns."""
    cloud = v[:, columns]
    across = np.linalg.svd(cloud - cloud.mean(axis=0), full_matrices=False)[2][-1]
    fitted = regressed
    if abs(across[0]) > 1e-3 * np.abs(across).max():
        turned = across / across[0]
        if _half_width(cloud @ turned[:, None])[0] <= SLACK * _half_width(cloud @ regressed[:, None]):
            fitted = turned
    if np.abs(fitted).min() < 0.5 / _POWER**2:  # a partner that hardly matters
        fitted = regressed
    narrowest = float(_half_width(cloud @ fitted[:, None])[0])
    allowed = min(max(SLACK * narrowest, 0.2 * WIDTH), WIDTH, own / GAIN)
    whole = _whole(np.sign(fitted), _POWER)
    widths = _half_width(cloud @ (whole / whole[:, :1]).T)
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


def _half_width(columns: Floats) -> Floats:
    """Half of the interval between equal tails of columns (ns, m): (m,)."""
    low, high = np.quantile(columns, [0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL], axis=0)
    return 0.5 * (high - low)
