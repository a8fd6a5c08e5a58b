"""A channel integrated over time from zero, once or twice: the way of ground of given velocity or acceleration."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from tarsus.base.arrays import Floats
from tarsus.model.drive.pieces import Pieces, evaluate


def integral(pieces: Pieces, time: ArrayLike, times: int) -> Floats:
    """Value at ``time`` [s], any shape, not negative, of a channel integrated so many times, 0 to 2, from t = 0."""
    t = np.asarray(time, dtype=float)
    if times == 0:
        return evaluate(pieces, t)
    start, half = pieces.start, 0.5 * np.diff(pieces.start)
    once = _primitive(pieces.coef, half)
    once[1:, 0] += np.cumsum(once.sum(axis=1))[:-1]
    twice = _primitive(once, half)
    twice[1:, 0] += np.cumsum(twice.sum(axis=1))[:-1]
    speed, way = once[-1].sum(), twice[-1].sum()
    if pieces.loop < 0:
        over = np.maximum(t - start[-1], 0.0)
        held = pieces.coef[-1].sum()
        inside = np.minimum(t, start[-1])
        later = held * over if times == 1 else (speed + 0.5 * held * over) * over
    else:
        begin = start[pieces.loop]
        period = start[-1] - begin
        rounds = np.maximum(np.floor((t - begin) / period), 0.0)
        inside = np.minimum(t - rounds * period, start[-1])
        gain = speed - _at(once, start, begin)  # speed gained in each round
        later = rounds * gain
        if times == 2:
            each = way - _at(twice, start, begin)
            later = rounds * (each + gain * (0.5 * (rounds - 1.0) * period + inside - begin))
    return _at(once if times == 1 else twice, start, inside) + later


def _primitive(rows: Floats, half: Floats) -> Floats:
    """Integrals (P, k + 1) of polynomials (P, k) in xi over pieces of these half widths [s], zero where each begins."""
    powers = np.arange(1, rows.shape[1] + 1)
    out = np.zeros((len(rows), rows.shape[1] + 1))
    out[:, 1:] = rows / powers * half[:, None]
    out[:, 0] = -(out[:, 1:] * (-1.0) ** powers).sum(axis=1)
    return out


def _at(rows: Floats, start: Floats, time: ArrayLike) -> Floats:
    """Polynomials of pieces at times within them."""
    t = np.asarray(time, dtype=float)
    piece = np.clip(np.searchsorted(start, t, side="right") - 1, 0, len(rows) - 1)
    xi = 2.0 * (t - start[piece]) / (start[piece + 1] - start[piece]) - 1.0
    value = rows[piece, -1]
    for k in range(rows.shape[1] - 2, -1, -1):
        value = value * xi + rows[piece, k]
    return np.asarray(value)
