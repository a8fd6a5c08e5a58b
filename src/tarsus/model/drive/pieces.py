"""One channel as a piecewise polynomial of time: what the engine integrates, and how to evaluate it.

A channel is continued for ever: it either repeats its last pieces (`loop >= 0`) or holds its last value.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.base.errors import InputError

TERMS = 12
"""Coefficients of a piece: polynomials of degree 11 at most."""


@dataclass(frozen=True)
class Pieces:
    """A piecewise polynomial of time with P pieces, in the channel's SI unit (volts or newtons)."""

    start: NDArray[np.float64]
    """(P+1,) [s], increasing, start[0] = 0: piece p spans [start[p], start[p+1]]."""
    coef: NDArray[np.float64]
    """(P, 12): value = sum_k coef[p, k] xi**k with xi = 2 (t - start[p]) / (start[p+1] - start[p]) - 1.
    On a constant stretch coef[p, 1:] is exactly zero."""
    kink: NDArray[np.bool_]
    """(P,): True if value or a derivative may jump at start[p], False if start[p] only subdivides a smooth
    stretch. For the first piece of the loop the flag also holds for the way back from the end of the loop."""
    loop: int
    """Piece that follows the last one (periodic channel), or -1: the last value is held."""

    @property
    def count(self) -> int:
        """P, the number of pieces."""
        return len(self.kink)

    @property
    def span(self) -> float:
        """Range of the values: that of bounds of the pieces, each the sum of its coefficients' sizes."""
        swing = np.abs(self.coef[:, 1:]).sum(axis=1)
        top, bottom = self.coef[:, 0] + swing, self.coef[:, 0] - swing
        held = float(self.coef[-1].sum()) if self.loop < 0 else float(self.coef[0, 0])
        return max(float(top.max()), held) - min(float(bottom.min()), held)


def evaluate(pieces: Pieces, time: ArrayLike) -> NDArray[np.float64]:
    """Value of a channel at `time` [s], any shape, all >= 0; on a jump the value after it.

    Raises InputError for a negative or NaN time.
    """
    t = np.asarray(time, dtype=np.float64)
    if t.size and not t.min() >= 0.0:
        raise InputError("a drive is defined from t = 0 on: times must be numbers that are not negative")
    start = pieces.start
    end = start[-1]
    held = None
    if pieces.loop >= 0:
        first = start[pieces.loop]
        t = np.where(t >= end, first + np.fmod(t - first, end - first), t)
        t = np.where(t >= end, first, t)
    else:
        held = t >= end
    piece = np.clip(np.searchsorted(start, t, side="right") - 1, 0, pieces.count - 1)
    left = start[piece]
    xi = 2.0 * (t - left) / (start[piece + 1] - left) - 1.0
    if held is not None:
        xi = np.where(held, 1.0, xi)
    rows = pieces.coef
    value = rows[piece, TERMS - 1].copy()
    for k in range(TERMS - 2, -1, -1):
        value = value * xi + rows[piece, k]
    return value
