"""Whether data determine a number: one meaning of the words for every verb that uses them.

A number is *determined* when its 95 % interval reaches no farther than a quarter to either side, when the data, not a
bound of the search, set both of its ends, and when no check of what it predicts has failed. Where one has, it is
*preferred*: the best that the model can say, with the figure by which the model fails. Else it is *undecided*, or
*assumed* where the data say nothing of it. How wide the bounds were drawn does not enter.
"""

from __future__ import annotations

import math
from enum import StrEnum


class Verdict(StrEnum):
    """What data say of a number."""

    DETERMINED = "determined"
    PREFERRED = "preferred"
    """Its interval is narrow, but a check of the model that it rests on has failed."""
    UNDECIDED = "undecided"
    """Its interval is wide, or a bound of the search set an end of it."""
    ASSUMED = "assumed"
    """The data say nothing of it: its spread is that of what was known beforehand, or it goes with other numbers."""


LEVEL = 0.95
"""Probability that an interval is meant to cover the truth with: two standard errors, as is usual for measurements."""

WIDTH = 0.25
"""Half-width of a 95 % interval up to which a number counts as determined: a quarter to either side is a standard error
of an eighth, so that the leading digit is known, which distinguishes a measured value from an order of magnitude. A
convention of reporting: no other result depends on it."""

CUT = 0.1
"""A bound cuts an interval whose end lies nearer to it than this part of the interval's own width: of a density that is
uniform up to a bound the 95 % interval ends at 1/38 of its width from it (twenty draws put it a tenth off at most in
nine of ten cases), and of a normal one that a bound cuts two standard deviations below its mean at 1/11."""


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


PRIOR_KEPT = 0.6
"""An ensemble that keeps so much of the prior's spread says nothing beyond it: the likelihood region cuts off a tenth
to a fifth of the spread, and a short chain may miss as much again."""


def verdict_of(
    interval: tuple[float, float],
    cut: tuple[bool, bool] = (False, False),
    *,
    size: float | None = None,
    of_prior: float = 0.0,
    doubted: bool = False,
) -> Verdict:
    """What data say of a number.

    Parameters
    ----------
    interval
        Its 95 % interval.
    cut
        Whether bounds of the search set its ends (`cut_ends`).
    size
        See `determined`.
    of_prior
        Its spread in parts of that of its prior; 0 without a prior.
    doubted
        Whether a check of the model that it rests on has failed.
    """
    if of_prior > PRIOR_KEPT:
        return Verdict.ASSUMED
    if any(cut) or not determined(*interval, size):
        return Verdict.UNDECIDED
    return Verdict.PREFERRED if doubted else Verdict.DETERMINED
