"""Samples that stand at the end of an instrument's range, told from the samples alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["clipped_samples"]

_SHORTEST_RUN = 3
"""Samples on the outermost value: a peak of a smooth signal may have two."""
_STEEP = 4.0
"""A run is clipped if the signal enters it with a step above this many steps of its digits: the crest of a wave that
is rounded to such steps is entered with less than 3."""


def clipped_samples(values: NDArray[np.float64]) -> int:
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


def _at(values: NDArray[np.float64], extreme: float, digit: float) -> int:
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
