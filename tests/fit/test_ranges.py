"""Intervals from draws, and one meaning of "determined": widths, signs, and ends that a bound of the search has set."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import norm

from tarsus.base.errors import InputError
from tarsus.fit.ranges import Range, range_of
from tarsus.fit.verdict import WIDTH, cut_ends, determined, half_width


def test_draws_give_their_tails():
    draws = norm(3.0, 0.1).ppf((np.arange(2000) + 0.5) / 2000)
    found = range_of([*draws, np.nan], value=3.0)
    assert (found.low, found.high) == pytest.approx((3.0 - 0.196, 3.0 + 0.196), abs=1e-3)
    assert found.half_width() == pytest.approx(0.5 * np.log(3.196 / 2.804), rel=5e-3)
    assert found.closed and found.pieces == ()
    with pytest.raises(InputError, match="at least 20 draws, got 3"):
        range_of([1.0, 2.0, 3.0])


def test_an_end_on_a_limit_of_the_search_is_open():
    draws = np.clip(np.linspace(-1.0, 1.0, 400), 0.0, None)
    found = range_of(draws, value=0.0, limits=(0.0, 2.0))
    assert found.low == -np.inf and found.high == pytest.approx(0.95, abs=0.01)
    assert found.text("m").startswith("below 9") and found.half_width() == np.inf


def test_a_range_in_words():
    assert Range(2e-6, 1.9e-6, 2.1e-6).text("m") == "1.9 µm to 2.1 µm"
    assert Range(623.0, 622.991, 623.008).text("Hz") == "622.991 Hz to 623.008 Hz"
    assert Range(2.0, 1.0, np.inf).text("V") == "above 1 V"
    assert Range(2.0, -np.inf, np.inf).text() == "anything"
    assert Range(0.0, -1.0, 1.0).half_width() == np.inf
    assert Range(0.0, -1.0, 1.0).half_width(10.0) == pytest.approx(0.1)


def test_a_number_is_determined_up_to_a_quarter_to_either_side_in_any_unit():
    for unit in (1e-21, 1.0, -1e9):
        ends = sorted((2.0 * math.exp(-0.99 * WIDTH) * unit, 2.0 * math.exp(0.99 * WIDTH) * unit))
        assert determined(*ends) and half_width(*ends) == pytest.approx(0.99 * WIDTH)
        ends = sorted((2.0 * math.exp(-1.01 * WIDTH) * unit, 2.0 * math.exp(1.01 * WIDTH) * unit))
        assert not determined(*ends)


def test_a_number_of_open_sign_needs_a_size_and_an_open_end_determines_nothing():
    assert not determined(-0.1, 0.1) and not determined(0.0, 0.1)
    assert determined(-0.1, 0.1, 1.0) and not determined(-0.1, 0.1, 0.3)
    assert not determined(-math.inf, 0.1, 1.0) and not determined(1.0, math.inf)


def test_a_bound_is_told_from_the_data_by_the_draws_alone():
    """However far the other bound lies: a uniform and a falling density are cut, a normal one three sd off is not."""
    at = (np.arange(2000) + 0.5) / 2000
    normal = 0.5 + 0.1 * np.random.default_rng(0).standard_normal(4000)
    for far in (1.0, 1e3):
        ends = np.quantile(at, [0.025, 0.975])
        assert cut_ends(*ends, (0.0, far)) == (True, far == 1.0)
        assert cut_ends(*np.quantile(-0.1 * np.log(at), [0.025, 0.975]), (0.0, far)) == (True, False)
        assert cut_ends(*np.quantile(normal, [0.025, 0.975]), (0.2, far)) == (False, False)
        kept = normal[normal > 0.5]
        assert cut_ends(*np.quantile(kept, [0.025, 0.975]), (0.5, far)) == (True, False)
