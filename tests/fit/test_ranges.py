"""Intervals from draws."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from tarsus.base.errors import InputError
from tarsus.fit.ranges import Range, range_of


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


def test_two_heaps_of_draws_are_two_pieces():
    random = np.random.default_rng(1)
    draws = np.concatenate([random.normal(1.0, 0.02, 300), random.normal(2.0, 0.02, 200)])
    first, second = range_of(draws).pieces
    assert first[1] < 1.1 and second[0] > 1.9
    assert range_of(random.normal(1.0, 0.02, 500)).pieces == ()


def test_a_range_in_words():
    assert Range(2e-6, 1.9e-6, 2.1e-6).text("m") == "1.9 µm to 2.1 µm"
    assert Range(623.0, 622.991, 623.008).text("Hz") == "622.991 Hz to 623.008 Hz"
    assert Range(2.0, 1.0, np.inf).text("V") == "above 1 V"
    assert Range(2.0, -np.inf, np.inf).text() == "anything"
    assert Range(0.0, -1.0, 1.0).half_width() == np.inf
    assert Range(0.0, -1.0, 1.0).half_width(10.0) == pytest.approx(0.1)
