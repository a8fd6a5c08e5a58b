"""Shares of counted things, with their intervals."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

NORMAL_95 = 1.959964
"""Standard deviations from the mean to either end of the middle 95 % of a normal distribution."""


def share_of(met: int, count: int) -> tuple[float, float, float]:
    """A share and its 95 % interval (Wilson 1927), which holds near 0 and 1 as well."""
    p, z = met / count, NORMAL_95**2 / count
    middle, half = (p + z / 2.0) / (1.0 + z), math.sqrt(p * (1.0 - p) * z + z**2 / 4.0) / (1.0 + z)
    return p, max(middle - half, 0.0), min(middle + half, 1.0)


CONTENT, SURE = 0.95, 0.95
"""Share of all values that `tolerance_interval` holds, and the confidence that it does."""
FEWEST = 93
"""Values of which the smallest and the largest are such ends."""


def tolerance_interval(values: NDArray[np.float64]) -> tuple[float, float]:
    """Ends between which 95 % of all values lie with 95 % confidence, of values (n,) drawn by chance, whatever
    their distribution (Wilks, Ann. Math. Stat. 12, 1941): as many as may be are left out, half at either end. NaN of
    fewer than 93, whose smallest and largest hold less, and where a value is none.
    """
    from scipy.special import betainc

    ordered, out = np.sort(values), 2
    if len(values) < FEWEST or not np.isfinite(values).all():
        return math.nan, math.nan
    # the share between the a-th smallest and the b-th largest is Beta(n + 1 - a - b, a + b)
    while out < len(values) and betainc(len(values) - out, out + 1, CONTENT) <= 1.0 - SURE:
        out += 1
    low = out // 2
    return float(ordered[low - 1]), float(ordered[len(ordered) - (out - low)])
