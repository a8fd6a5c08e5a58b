"""Arrays laid end to end, segment after segment: segment s of ``first`` (ns + 1,) is ``first[s]:first[s + 1]``.

What is found for a segment depends on nothing but its own entries, to the last bit, whatever lies next to it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats

Rows = NDArray[np.intp]


def firsts(counts: NDArray[np.integer]) -> Rows:
    """Where segments (ns,) of so many entries begin, and where the last one ends (ns + 1,)."""
    first = np.zeros(len(counts) + 1, dtype=np.intp)
    np.cumsum(counts, out=first[1:])
    return first


def owners(first: Rows) -> Rows:
    """Number of the segment of every entry."""
    return np.repeat(np.arange(len(first) - 1), np.diff(first))


def places(first: Rows) -> Rows:
    """Place of every entry within its segment, from 0."""
    return np.arange(first[-1]) - np.repeat(first[:-1], np.diff(first))


def sums(own: Rows, count: int, values: Floats | None = None) -> Floats:
    """Sum (count,) of the values of each segment in their order, or how many entries it has."""
    return np.bincount(own, values, minlength=count).astype(float)


def largest(own: Rows, count: int, values: Floats) -> Floats:
    """Largest value (count,) of each segment, minus infinity where it has none."""
    out = np.full(count, -np.inf)
    np.maximum.at(out, own, values)
    return out
