"""Samples that stand at the end of an instrument's range, recognised by the samples alone: in a row, as a reader sees
them in whole digits of a recorder, or one by one, more often than at the values next to it."""

from __future__ import annotations

import numpy as np

from tarsus.base.arrays import Floats

_SHORTEST_RUN = 3
"""Samples on the outermost value: a peak of a smooth signal may have two."""
_STEEP = 4.0
"""A run is clipped if the signal enters it with a step above this many steps of its digits: the crest of a wave that
is rounded to such steps is entered with less than 3."""
_FEWEST_HEAPED = 5
"""Samples on one value from which on a limit is looked for: fewer meet by chance."""
_HEAPED = 8.0
"""Samples at an extreme, and how many times more than at any of the values next to it: the crest of a wave that is
rounded has 2.4 times as many, a flat one 5 times."""
_SAME = 1e-9
"""Part of the span within which values are the same."""
_NEXT = 20
"""Values next to the outermost one that it is compared with."""
_FAR = 0.2
"""Part of the span from the middle that a limit lies at: what rests there is no limit."""


def digit_of(values: Floats) -> float:
    """Smallest step between values of a channel (ns,): that of its converter or of its digits; 0 of a constant."""
    return float(np.diff(np.unique(values)).min(initial=np.ptp(values)))


def clipped_samples(values: Floats) -> int:
    """Number of samples in runs of equal extreme values that the signal enters steeply.

    Parameters
    ----------
    values
        Finite samples (ns,).

    Returns
    -------
    int
        0 where nothing looks clipped, and for a constant signal.
    """
    levels = np.unique(values)
    if len(levels) < 3:
        return 0
    digit = float(np.diff(levels).min())
    return sum(_at(values, float(extreme), digit) for extreme in (levels[0], levels[-1]))


def _at(values: Floats, extreme: float, digit: float) -> int:
    """Samples in clipped runs at one extreme."""
    inside = np.concatenate([[False], values == extreme, [False]])
    edges = np.flatnonzero(inside[1:] != inside[:-1])
    starts, ends = edges[::2], edges[1::2]
    long = ends - starts >= _SHORTEST_RUN
    starts, ends = starts[long], ends[long]
    before = np.where(starts > 0, np.abs(values[np.maximum(starts - 1, 0)] - extreme), 0.0)
    after = np.where(ends < len(values), np.abs(values[np.minimum(ends, len(values) - 1)] - extreme), 0.0)
    steep = np.maximum(before, after) > _STEEP * digit
    return int(np.sum((ends - starts)[steep]))


def heaped_samples(values: Floats) -> tuple[int, float]:
    """Samples (ns,) that stand at the largest or smallest value far more often than at the next ones, and the value;
    0 where none do."""
    found = 0, 0.0
    middle, span = float(np.median(values)), float(np.ptp(values))
    if span == 0.0:
        return found
    steps = np.round(values / (_SAME * span))
    if max(np.count_nonzero(steps == end) for end in (steps.min(), steps.max())) < _FEWEST_HEAPED:
        return found
    levels, counts = np.unique(steps, return_counts=True)
    levels *= _SAME * span
    if len(levels) <= _NEXT:
        return found
    for place, inner in ((0, slice(1, 1 + _NEXT)), (-1, slice(-1 - _NEXT, -1))):
        hit, level = int(counts[place]), float(levels[place])
        heaped = hit >= _FEWEST_HEAPED and hit > _HEAPED * float(counts[inner].max())
        if heaped and abs(level - middle) > _FAR * span and hit > found[0]:
            found = hit, level
    return found
