"""Newton's method for what returns: a matrix of derivatives is kept as long as it serves, for it costs twenty returns.

J (u' - u) = -F(u),   J <- J + (F' - F - J d) d^T / (d^T d),   d = u' - u   (Broyden)
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
What = TypeVar("What")

CLOSED = 1e-10
"""Mismatch, of the size of the motion, at which an orbit has closed: ten times what windows' steps leave."""
CORRECTIONS = 12
"""Steps of the method: with derivatives made anew it doubles its digits every time, or does not converge at all."""
SLOW = 0.1
"""Part of a mismatch that a step may leave, or the derivatives are made anew."""
LOST = 1e3
"""A mismatch so much larger than the least one is of a motion that is nowhere near."""


class Zero(NamedTuple, Generic[What]):
    """Where a mismatch is zero: place (r,), what is there, the mismatch left, and steps taken."""

    place: Floats
    what: What
    size: float
    count: int


def zero_near(
    mismatch: Callable[[Floats], tuple[What, Floats] | None],
    derivatives: Callable[[Floats, What], Floats],
    first: Floats,
    matrix: Floats | None = None,
) -> Zero[What] | None:
    """The zero of a mismatch (q,) near a place (r,), by its value there with what is there; None where there is none.

    derivatives: (q, r) at a place; matrix: such as were made near by.
    """
    best, last, anew = np.inf, np.inf, False
    place: Floats = first
    step: Floats = np.zeros(0)
    miss: Floats = step
    for count in range(CORRECTIONS):
        found = mismatch(place)
        if found is None:
            return None
        what, before, miss = found[0], miss, found[1]
        size = float(np.abs(miss).max(initial=0.0))
        if not np.isfinite(size) or size > LOST * best:
            return None
        if size <= CLOSED or (size <= 100.0 * CLOSED and anew and size >= 0.5 * last):
            return Zero(place, what, size, count)
        anew = matrix is None or (count > 0 and size > SLOW * last)
        if matrix is None or anew:
            matrix = derivatives(place, what)
        elif count:
            matrix = matrix + np.outer(miss - before - matrix @ step, step) / (step @ step)
        best, last = min(best, size), size
        step = -np.asarray(np.linalg.lstsq(matrix, miss, rcond=None)[0], dtype=float)
        place = place + step
    return None
