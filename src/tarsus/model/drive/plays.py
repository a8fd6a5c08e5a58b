"""The play operator and its memory, over sequences of voltage extremes.

A play of threshold r follows the voltage with slack: after a monotone move to V its state is p = clip(p, V
- r, V + r). It is engaged while it is being dragged along, p = V - r rising or p = V + r falling. Clips
compose to clips, so the states along a whole sequence are one prefix scan, and those along the sequences of many runs
as well: what a run begins with is a clip to one state.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats
from tarsus.base.columns import columns
from tarsus.model.drive.track import Track


def play_states(volts: Floats, thresholds: Floats, initial: Floats) -> Floats:
    """States (K, n) [V] of n plays after each of K monotone moves to `volts` (K,), from `initial` (n,).

    From one turn of the voltage to the next a state is one clip of that at the turn. Where it turns all the time, all
    blocks of about sqrt(K) moves go on together, one move at a time, before each is begun where the one before it ends;
    several runs are scanned by `states_along`.
    """
    ways = np.sign(np.diff(volts))
    turns = np.append(0, np.flatnonzero(ways[1:] != ways[:-1]) + 1)
    if 2 * len(turns) < len(volts):
        state = np.vstack([initial, play_states(volts[turns], thresholds, initial)])
        since = state[np.searchsorted(turns, np.arange(len(volts)))]
        return np.minimum(np.maximum(since, volts[:, None] - thresholds), volts[:, None] + thresholds)
    count = len(volts)
    size = math.isqrt(count) + 1
    blocks = -(-count // size)
    padded = np.append(volts, np.full(size * blocks - count, volts[-1] if count else 0.0))
    moves = padded.reshape(blocks, size).T[:, :, None]
    low, high = moves - thresholds, moves + thresholds
    for k in range(1, size):
        ends = low[k].copy(), high[k].copy()
        for one in (low, high):
            one[k] = np.minimum(np.maximum(one[k - 1], ends[0]), ends[1])
    begin = np.empty((blocks, len(thresholds)))
    state = np.asarray(initial, dtype=np.float64)
    for b in range(blocks):
        begin[b] = state
        state = np.minimum(np.maximum(state, low[-1, b]), high[-1, b])
    found = np.minimum(np.maximum(begin, low), high)
    return found.transpose(1, 0, 2).reshape(size * blocks, len(thresholds))[:count]


def _scanned(low: Any, high: Any, initial: Any, longest: int) -> Any:
    """What the first of clips to [low, high] (K, n) makes of `initial`, and each of what the one before has made; clips
    to one state begin anew, after `longest` at most."""
    step = 1
    while step < longest:
        before_low, before_high = low[:-step], high[:-step]
        new_low = np.minimum(np.maximum(before_low, low[step:]), high[step:])
        new_high = np.minimum(np.maximum(before_high, low[step:]), high[step:])
        low = np.concatenate([low[:step], new_low])
        high = np.concatenate([high[:step], new_high])
        step *= 2
    return np.minimum(np.maximum(initial, low), high)


def remembered(history: Any, thresholds: Any) -> Any:
    """States (nr, n) [V] of plays that have been through a history (H,), or (nr, H), from 0 V on; thresholds (n,) or
    (nr, n) [V]."""
    r = thresholds if np.ndim(thresholds) > 1 else thresholds[None]
    past: Any = columns(history) if len(history) else np.zeros(0)
    past = past if np.ndim(past) > 1 else past[None]
    state = np.zeros(r.shape)
    for k in range(past.shape[1]):
        volts = past[:, k][:, None]
        state = np.minimum(np.maximum(state, volts - r), volts + r)
    return state


def states_along(track: Track, thresholds: Any, initial: Any) -> Any:
    """States (2 S, n) [V] of plays at the start and at the end of each stretch of a track; thresholds (n,) or (nr,
    n) and initial (nr, n) or (1, n) [V], before t = 0."""
    counts = 2 * np.diff(track.runs)
    first = np.cumsum(counts + 1) - counts - 1  # a place before every run's, for what it begins with
    size = int(counts.sum()) + len(counts)
    moves = np.ones(size, dtype=bool)
    moves[first] = False
    own = np.repeat(np.arange(len(counts)), counts + 1)
    levels = np.stack([track.first, track.last], axis=1).reshape(-1)
    place = np.cumsum(moves) - 1
    volts = np.where(moves, levels[np.maximum(place, 0)], 0.0)
    r = thresholds[own] if np.ndim(thresholds) > 1 else thresholds
    begin = np.broadcast_to(initial, (len(counts), initial.shape[1]))[own]
    low, high = volts[:, None] - r, volts[:, None] + r
    low, high = (np.where(moves[:, None], one, begin) for one in (low, high))
    return _scanned(low, high, begin, int(counts.max()) + 1)[moves]


ROUNDING = 2e-13
"""A voltage that changes by less of its largest value has not changed: an amplifier's output is followed to half of
that, and settles on its command from either side."""


def last_directions(moves: Floats, initial: Floats, largest: Floats, since: NDArray[np.intp]) -> Floats:
    """(K,) sign of the last of `moves` (K,) [V] up to each index, from the index `since` (K,) on, that is more than
    rounding of the `largest` voltage (K,) [V]; `initial` (K,) where there is none."""
    signs = np.where(np.abs(moves) > ROUNDING * largest, np.sign(moves), 0.0)
    index = np.maximum.accumulate(np.where(signs != 0.0, np.arange(len(signs)), -1))
    return np.where(index >= since, signs[index], initial)


def visited(history: Sequence[float]) -> Floats:
    """(1 + H,) voltages visited before t = 0: 0 V, at which every drive is born, then the history [V]."""
    return np.concatenate([[0.0], np.asarray(history, dtype=np.float64)])
