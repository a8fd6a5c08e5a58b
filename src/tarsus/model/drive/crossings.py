"""Where a function crosses zero; where a polynomial on [-1, 1] does, or turns."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from tarsus.base.arrays import Floats

_NEARLY_REAL = 1e-5
"""Imaginary part up to which a root is a candidate: rounding splits a double root by its square root."""


def value(row: Floats, xi: float) -> float:
    """Polynomial `row` (K,), ascending, at one `xi`."""
    total = 0.0
    for c in reversed(row.tolist()):
        total = total * xi + c
    return total


def _real_roots(row: Floats, after: float) -> list[float]:
    """Candidates for real roots in (after, 1), ascending; real parts of pairs that are nearly real among them."""
    big = np.flatnonzero(np.abs(row) > 1e-17 * np.abs(row).max())
    if not len(big) or big[-1] == 0:
        return []
    roots = np.polynomial.polynomial.polyroots(row[: big[-1] + 1])
    near = np.real(roots[np.abs(np.imag(roots)) <= _NEARLY_REAL])
    return sorted(set(near[(near > after) & (near < 1.0)].tolist()))


def crossing(row: Floats, tolerance: float, after: float = -1.0) -> float | None:
    """Where polynomial `row` (K,) leaves the values up to 0 in [after, 1]; None if it does not.

    Excursions that stay below `tolerance` are rounding and do not count.
    """
    swing = float(np.abs(row[1:]).sum())
    if row[0] + swing <= tolerance:
        return None
    knots = [after, *_real_roots(row, after), 1.0]
    before = after
    for low, high in pairwise(knots):
        middle = 0.5 * (low + high)
        if value(row, middle) > tolerance:
            return _between(row, before, middle, low)
        before = middle
    return None


def _between(row: Floats, low: float, high: float, guess: float) -> float:
    """Root between `low`, where the polynomial should not be positive, and `high`, where it is."""
    if not value(row, low) < 0.0 < value(row, high):
        return guess
    return bracketed_root(lambda xi: value(row, xi), low, high, value(row, low), value(row, high))


def bracketed_root(miss: Callable[[float], float], a: float, b: float, fa: float, fb: float) -> float:
    """Root of a monotone function between a and b, to rounding: Illinois steps and bisections."""
    width = abs(b - a)
    for i in range(200):
        x = b - fb * (b - a) / (fb - fa)
        if i % 4 == 3 or not min(a, b) < x < max(a, b):
            x = 0.5 * (a + b)
        if x in (a, b) or width <= 2e-16 * (1e-3 + abs(x)):
            break
        fx = miss(x)
        if fx == 0.0:
            return x
        if (fx < 0.0) == (fb < 0.0):
            b, fb, fa = x, fx, 0.5 * fa
        else:
            a, fa, b, fb = b, fb, x, fx
        width = abs(b - a)
    return a if abs(miss(a)) < abs(miss(b)) else b


def turns(row: Floats, tolerance: float) -> list[float]:
    """Where polynomial `row` (K,) turns in (-1, 1), ascending; swings up to `tolerance` are omitted."""
    slope = row[1:] * np.arange(1, len(row))
    if abs(slope[0]) >= np.abs(slope[1:]).sum():
        return []
    kept: list[float] = []
    level = value(row, -1.0)
    for xi in _real_roots(slope, -1.0):
        here = value(row, xi)
        if abs(here - level) > tolerance:
            kept.append(xi)
            level = here
    while kept and abs(value(row, 1.0) - value(row, kept[-1])) <= tolerance:
        kept.pop()
    return kept
