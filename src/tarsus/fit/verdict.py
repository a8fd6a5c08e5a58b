"""Whether data determine a number: one meaning of the word for every verb that uses it.

A number is *determined* when its 95 % interval reaches no farther than a quarter to either side, and when the data, not
a bound of the search, set both of its ends. How wide the bounds were drawn does not enter.
"""

from __future__ import annotations

import math

__all__ = ["CUT", "LEVEL", "WIDTH", "cut_ends", "determined", "half_width"]

LEVEL = 0.95
"""Probability that an interval is meant to cover the truth with: two standard errors, as is usual for measurements."""

WIDTH = 0.25
"""Half-width of a 95 % interval up to which a number counts as determined: a quarter to either side is a standard error
of an eighth, so that the leading digit is known, which tells a measured value from an order of magnitude. A convention
of reporting: no other result depends on it."""

CUT = 0.05
"""A bound cuts an interval whose end lies nearer to it than this part of the interval's own width: of a density that is
uniform up to a bound the 95 % interval ends at 1/38 of its width from it, of one that falls off from it at less, and of
a normal one that is cut off 1.5 standard deviations below its mean at 1/21."""


def half_width(low: float, high: float, size: float | None = None) -> float:
    """Half of an interval's width relative to ``size``; without it, half of the logarithm of high over low.

    0.1 is about 10 % to either side. Infinite where an end is, or, without a size, where the sign is open.
    """
    if not (math.isfinite(low) and math.isfinite(high)):
        return math.inf
    if size is not None:
        return 0.5 * (high - low) / abs(size)
    if low * high <= 0.0:
        return math.inf
    return 0.5 * abs(math.log(high / low))


def cut_ends(low: float, high: float, bounds: tuple[float, float]) -> tuple[bool, bool]:
    """Whether the bounds of the search cut the lower and the upper end of an interval of draws; all on the scale on
    which was searched."""
    near = CUT * (high - low)
    return low - bounds[0] <= near, bounds[1] - high <= near


def determined(low: float, high: float, size: float | None = None) -> bool:
    """Whether a number with this 95 % interval is determined.

    Parameters
    ----------
    low, high
        Ends of the interval; infinite where a bound of the search set the end (see `cut_ends`).
    size
        For a number that may be zero or of either sign, such as an offset: what a change of it is compared with, in its
        unit; by default the number itself.
    """
    return half_width(low, high, size) <= WIDTH
