"""Intervals of shares and of values against the binomial distribution."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom

from tarsus.measure.shares import share_of, tolerance_interval


def test_ends_hold_95_percent_with_95_percent_confidence_and_no_more_are_left_out():
    """Of n ranks in order, the share between two is at least 95 % unless more than n - out of n uniform numbers fall
    below it."""
    for count in (93, 192, 768, 2000):
        low, high = tolerance_interval(np.arange(1.0, count + 1.0))
        out = int(low) + int(count + 1 - high)

        def short(left: int, count: int = count) -> float:
            """Chance that the ends hold less than 95 %, so many left out."""
            return float(binom.sf(count - left, count, 0.95))

        assert short(out) <= 0.05 < short(out + 1) and abs(low - (count + 1 - high)) <= 1.0


def test_a_share_of_none_has_the_end_of_wilson():
    z = 1.959964**2
    assert share_of(0, 10) == pytest.approx((0.0, 0.0, z / (10.0 + z)), abs=1e-12)
    assert share_of(5, 10)[2] - 0.5 == pytest.approx(0.5 * np.sqrt(z / (10.0 + z)))


def test_too_few_values_and_values_that_are_none_have_no_ends():
    assert np.isnan(tolerance_interval(np.arange(92.0))).all()
    assert np.isnan(tolerance_interval(np.append(np.arange(200.0), np.nan))).all()
