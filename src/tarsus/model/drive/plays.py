"""The play operator and its memory, over sequences of voltage extremes.

A play of threshold r follows the voltage with slack: after a monotone move to V its state is p = clip(p, V
- r, V + r). It is engaged while it is being dragged along, p = V - r rising or p = V + r falling. Clips
compose to clips, so the states along a whole sequence are one prefix scan.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def play_states(volts: Floats, thresholds: Floats, initial: Floats) -> Floats:
    """States (K, n) [V] of n plays after each of K monotone moves to `volts` (K,), from `initial` (n,)."""
    low = volts[:, None] - thresholds
    high = volts[:, None] + thresholds
    step = 1
    while step < len(volts):
        before_low, before_high = low[:-step], high[:-step]
        new_low = np.minimum(np.maximum(before_low, low[step:]), high[step:])
        new_high = np.minimum(np.maximum(before_high, low[step:]), high[step:])
        low = np.concatenate([low[:step], new_low])
        high = np.concatenate([high[:step], new_high])
        step *= 2
    return np.minimum(np.maximum(initial, low), high)


ROUNDING = 2e-13
"""A voltage that changes by less of its largest value has not changed: an amplifier's output is followed to half of
that, and settles on its command from either side."""


def last_directions(moves: Floats, initial: float, largest: float) -> Floats:
    """(K,) sign of the last of `moves` (K,) [V] up to each index that is more than rounding of the `largest` voltage
    [V], `initial` where there is none."""
    signs = np.where(np.abs(moves) > ROUNDING * largest, np.sign(moves), 0.0)
    index = np.maximum.accumulate(np.where(signs != 0.0, np.arange(len(signs)), -1))
    return np.where(index >= 0, signs[index], initial)


def visited(history: Sequence[float]) -> Floats:
    """(1 + H,) voltages visited before t = 0: 0 V, at which every drive is born, then the history [V]."""
    return np.concatenate([[0.0], np.asarray(history, dtype=np.float64)])
