"""Shares of counted things, with their intervals."""

from __future__ import annotations

import math

NORMAL_95 = 1.959964
"""Standard deviations from the mean to either end of the middle 95 % of a normal distribution."""


def share_of(met: int, count: int) -> tuple[float, float, float]:
    """A share and its 95 % interval (Wilson 1927), which holds near 0 and 1 as well."""
    p, z = met / count, NORMAL_95**2 / count
    middle, half = (p + z / 2.0) / (1.0 + z), math.sqrt(p * (1.0 - p) * z + z**2 / 4.0) / (1.0 + z)
    return p, max(middle - half, 0.0), min(middle + half, 1.0)
