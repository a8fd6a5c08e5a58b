"""Verdicts on draws where the answer is known: normal ones, products, ratios, open ends."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from tarsus.base.errors import InputError
from tarsus.identify.verdict import judge_samples

REACH = float(norm.ppf(0.975))


def test_normal_draws_have_their_textbook_intervals_and_correlation():
    covariance = np.array([[0.04, -0.015], [-0.015, 0.01]])
    draws = np.random.default_rng(0).multivariate_normal([2.0, 3.0], covariance, 20000)
    found = judge_samples(("a", "b"), (2.0, 3.0), draws)
    for j, name in enumerate(("a", "b")):
        half = REACH * np.sqrt(covariance[j, j])
        assert found[name].word == "determined"
        ends = (found.range(name).low, found.range(name).high)
        assert ends == pytest.approx(([2.0, 3.0][j] - half, [2.0, 3.0][j] + half), rel=0.01)
    assert found.correlation[0, 1] == pytest.approx(-0.75, abs=0.02)
    assert found["a"].sentence("m").startswith("a is determined: 1.6")


@pytest.mark.parametrize("exponents", [(1.0, 1.0), (1.0, -3.0), (-0.5, 1.0), (-3.0, 1.0), (2.7183, 3.0)])
def test_only_the_product_is_known(exponents):
    random = np.random.default_rng(1)
    along = random.normal(0.0, 0.8, 4000)
    logs = np.column_stack([along, (random.normal(0.0, 0.02, 4000) - exponents[0] * along) / exponents[1]])
    c = random.normal(0.0, 0.05, 4000)
    values = np.array([2.0, 3.0, 5.0])
    found = judge_samples(("a", "b", "c"), values, values * np.exp(np.column_stack([logs, c])))
    for name in ("a", "b"):
        verdict = found[name]
        assert verdict.word == "undecided" and verdict.combination is not None
        assert verdict.combination.power == pytest.approx(exponents[1] / exponents[0], rel=2e-3)
        half = REACH * 0.02 / abs(exponents[0])
        assert verdict.combination.interval.half_width() == pytest.approx(half, rel=0.05)
    assert found["c"].word == "determined" and len(found.combinations) == 1
    assert "together with b" in found["a"].sentence()
    assert abs(found.correlation[0, 1]) > 0.99 and abs(found.correlation[0, 2]) < 0.05


def test_an_end_at_a_limit_is_open_and_two_heaps_are_two_pieces():
    random = np.random.default_rng(3)
    draws = np.column_stack(
        [
            random.uniform(40.0, 100.0, 4000),
            np.exp(random.choice(np.log([2.0, 20.0]), 4000) + random.normal(0.0, 0.05, 4000)),
        ]
    )
    limits = {"k": (0.0, 100.0)}
    found = judge_samples(("k", "two"), (70.0, 2.0), draws, limits=limits)
    assert found["k"].word == "undecided" and found["k"].combination is None and found["k"].related == ()
    assert found.range("k").high == np.inf and "anything above 41" in found["k"].sentence()
    assert found["two"].word == "undecided" and found["two"].combination is None
    (low, high), (again, top) = found.range("two").pieces
    assert (low, top) == pytest.approx((2.0 * np.exp(-0.08), 20.0 * np.exp(0.08)), rel=0.02)
    assert 2.0 < high < 2.5 and 16.0 < again < 20.0 and " or " in found["two"].sentence()


def test_a_ridge_that_is_no_product_is_no_combination():
    turn = np.random.default_rng(5).uniform(0.0, 2.0 * np.pi, 2000)
    found = judge_samples(("a", "b"), (np.e, 1.0), np.exp(np.column_stack([np.cos(turn), np.sin(turn)])))
    assert all(one.word == "undecided" and one.combination is None for one in found.verdicts)


def test_a_number_known_to_a_thousandth_ties_none_known_to_a_factor():
    """Correlated by chance with one spread over decades: a product with its 1000th power would say nothing."""
    random = np.random.default_rng(4)
    wide = 8.0 * random.standard_normal(400)
    narrow = 0.008 * (wide / 8.0 + 0.01 * random.standard_normal(400))
    draws = np.exp(np.column_stack([wide, narrow]))
    judged = judge_samples(("C", "zeta"), (1.0, 1.0), draws)
    assert judged["C"].word == "undecided" and judged["C"].combination is None
    assert judged["zeta"].word == "determined"


def test_a_number_with_a_size_may_be_of_either_sign():
    random = np.random.default_rng(6)
    samples = random.normal([0.02, 1.0], [0.1, 0.05], (500, 2))
    names, values = ("offset", "gain"), (0.02, 1.0)
    assert judge_samples(names, values, samples)["offset"].word == "undecided"
    assert judge_samples(names, values, samples, sizes={"offset": 1.0})["offset"].word == "determined"
    zero = judge_samples(names, (0.0, 1.0), samples)
    assert zero["offset"].word == "undecided" and zero["gain"].word == "determined"
    assert zero.correlation.shape == (2, 2) and zero.basis == "500 draws"


def test_what_cannot_be_judged():
    draws = np.exp(np.random.default_rng(8).normal(0.0, 0.1, (30, 2)))
    with pytest.raises(InputError) as refused:
        judge_samples(("a", "b"), (np.inf, 1.0), draws, sizes={"c": 1.0})
    assert len(refused.value.problems) == 2
    with pytest.raises(InputError, match="shape"):
        judge_samples(("a", "b"), (1.0, 1.0), np.ones((30, 3)))
