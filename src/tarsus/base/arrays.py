"""Arrays of one kind of number, whatever their shape."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Ints = NDArray[np.int64]


def counted(counts: NDArray[np.integer]) -> NDArray[np.intp]:
    """0, 1, ... within each of groups of so many (n,) that follow one another: (sum of counts,)."""
    return np.arange(int(counts.sum())) - np.repeat(np.cumsum(counts) - counts, counts)
