"""Intervals from draws and over repeats: what they are, and that they cover."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm, t

from tarsus.base.errors import InputError
from tarsus.identify.ranges import Range, over_repeats, range_of_draws, range_of_repeats


def test_draws_give_their_tails():
    draws = norm(3.0, 0.1).ppf((np.arange(2000) + 0.5) / 2000)
    found = range_of_draws([*draws, np.nan], 3.0)
    assert (found.low, found.high) == pytest.approx((3.0 - 0.196, 3.0 + 0.196), abs=1e-3)
    assert found.half_width() == pytest.approx(0.5 * np.log(3.196 / 2.804), rel=5e-3)
    assert found.closed and found.pieces == ()
    with pytest.raises(InputError, match="at least 20 draws, got 3"):
        range_of_draws([1.0, 2.0, 3.0])


def test_an_end_on_a_limit_of_the_search_is_open():
    draws = np.clip(np.linspace(-1.0, 1.0, 400), 0.0, None)
    found = range_of_draws(draws, 0.0, limits=(0.0, 2.0))
    assert found.low == -np.inf and found.high == pytest.approx(0.95, abs=0.01)
    assert found.text("m").startswith("below 9") and found.half_width() == np.inf


def test_two_heaps_of_draws_are_two_pieces():
    random = np.random.default_rng(1)
    draws = np.concatenate([random.normal(1.0, 0.02, 300), random.normal(2.0, 0.02, 200)])
    first, second = range_of_draws(draws).pieces
    assert first[1] < 1.1 and second[0] > 1.9
    assert range_of_draws(random.normal(1.0, 0.02, 500)).pieces == ()


def test_a_range_in_words():
    assert Range(2e-6, 1.9e-6, 2.1e-6).text("m") == "1.9 um to 2.1 um"
    assert Range(623.0, 622.991, 623.008).text("Hz") == "622.991 Hz to 623.008 Hz"
    assert Range(2.0, 1.0, np.inf).text("V") == "above 1 V"
    assert Range(2.0, -np.inf, np.inf).text() == "anything"
    assert Range(0.0, -1.0, 1.0).half_width() == np.inf
    assert Range(0.0, -1.0, 1.0).half_width(10.0) == pytest.approx(0.1)


def test_few_repeats_have_the_interval_of_student():
    values = np.exp([0.1, 0.2, 0.15, 0.05])
    logs = np.log(values)
    half = t.ppf(0.975, 3) * logs.std(ddof=1) / 2.0
    found = range_of_repeats(values)
    assert found.value == pytest.approx(np.exp(logs.mean()))
    assert (found.low, found.high) == pytest.approx(tuple(np.exp(logs.mean() + half * np.array([-1.0, 1.0]))))
    with pytest.raises(InputError, match="at least 2 finite"):
        range_of_repeats([1.0])


def test_a_fit_is_drawn_over_its_repeats():
    random = np.random.default_rng(5)
    repeats = [random.normal([2.0, 5.0], [0.2, 0.1]) for _ in range(20)]
    found = over_repeats(lambda some: np.mean(some, axis=0), repeats, draws=2000)
    mean, error = np.mean(repeats, axis=0), np.std(repeats, axis=0, ddof=1) / np.sqrt(20)
    assert found.values == pytest.approx(mean) and found.samples.shape == (2000, 2)
    for one, middle, std in zip(found.ranges, mean, error, strict=True):
        assert one.high - one.low == pytest.approx(2.0 * t.ppf(0.975, 19) * std, rel=0.12)
        assert one.low < middle < one.high


def test_draws_that_cannot_be_fitted_are_counted_and_too_many_refused():
    def fragile(some):
        if min(some) == 1.0:
            raise InputError("no")
        return np.mean(some)

    with pytest.raises(InputError, match="no"):
        over_repeats(fragile, [1.0, 2.0, 3.0])

    def often(some):
        if len(set(some)) < 3:
            raise InputError("all the same")
        return np.mean(some)

    with pytest.raises(InputError, match="of 500 draws of the repeats could not be fitted"):
        over_repeats(often, [1.0, 2.0, 3.0])
    assert over_repeats(often, list(range(12))).failed == 0


@pytest.mark.slow
@pytest.mark.parametrize("count", [5, 12, 30])
def test_intervals_over_repeats_cover(count):
    """200 campaigns of log-normal estimates; 95 % intervals of their median."""
    random = np.random.default_rng(17)
    covered = 0
    for _ in range(200):
        found = range_of_repeats(np.exp(random.normal(0.0, 0.3, count)))
        covered += found.low <= 1.0 <= found.high
    assert 0.90 <= covered / 200 <= 0.98


@pytest.mark.slow
@pytest.mark.parametrize("count", [6, 15])
def test_intervals_of_a_fit_to_drawn_repeats_cover(count):
    """200 campaigns of decays with a rate that scatters: the fit pools all repeats, the draws refit them."""
    random = np.random.default_rng(23)
    times = np.linspace(0.0, 2.0, 15)

    def fit(repeats):
        logs = np.mean(repeats, axis=0)
        return [-np.polyfit(times, logs, 1)[0]]

    covered = 0
    for k in range(200):
        rates = random.normal(1.5, 0.1, count)
        repeats = [-rate * times + random.normal(0.0, 0.05, 15) for rate in rates]
        found = over_repeats(fit, repeats, draws=200, seed=k).ranges[0]
        covered += found.low <= 1.5 <= found.high
    assert 0.90 <= covered / 200 <= 0.985
