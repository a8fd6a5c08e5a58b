"""Verdicts where the answer is known: linear models, products, ratios, flat and two-headed likelihoods."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from tarsus.base.errors import InputError
from tarsus.identify.correlation import Sum, Ties
from tarsus.identify.profile import one_by_one
from tarsus.identify.profiled import judge_likelihood, judge_steps
from tarsus.identify.step import StepResult
from tarsus.identify.verdict import Determined, NotFromTheseData, OnlyTogether, judge_samples

REACH = float(norm.ppf(0.975))
X = np.linspace(1.0, 2.0, 20)
DESIGN = np.column_stack([np.ones(20), X])
DATA = DESIGN @ [2.0, 3.0] + 0.05 * np.random.default_rng(0).standard_normal(20)


def straight(theta):
    return -0.5 * np.sum((DATA - theta @ DESIGN.T) ** 2, axis=1) / 0.05**2


def powers(exponents, width, value=1.0):
    """Likelihood of a product of powers alone, of log standard deviation ``width``."""
    return lambda theta: -0.5 * ((np.log(theta) @ np.array(exponents) - np.log(value)) / width) ** 2


def test_a_linear_model_has_its_textbook_intervals_and_correlation():
    found = judge_likelihood(("a", "b"), (1.0, 1.0), straight)
    exact = np.linalg.lstsq(DESIGN, DATA, rcond=None)[0]
    cov = 0.05**2 * np.linalg.inv(DESIGN.T @ DESIGN)
    for j, name in enumerate(("a", "b")):
        half = REACH * np.sqrt(cov[j, j])
        assert isinstance(found[name], Determined)
        assert (found.range(name).low, found.range(name).high) == pytest.approx(
            (exact[j] - half, exact[j] + half), rel=2e-3
        )
    assert found.correlation[0, 1] == pytest.approx(cov[0, 1] / np.sqrt(cov[0, 0] * cov[1, 1]), abs=5e-3)
    assert found["a"].sentence("m").startswith("a is determined: 1.9")


@pytest.mark.parametrize(
    ("exponents", "said"),
    [
        ((1.0, 1.0), "a * b"),
        ((1.0, -1.0), "a * b^-1"),
        pytest.param((1.0, -3.0), "a * b^-3", marks=pytest.mark.slow),
        pytest.param((-0.5, 1.0), "a * b^-2", marks=pytest.mark.slow),
        ((-3.0, 1.0), "b * a^-3"),
        ((2.0, 3.0), "a^2 * b^3"),
    ],
)
def test_only_the_product_is_known(exponents, said):
    found = judge_likelihood(("a", "b", "c"), (2.0, 3.0, 5.0), lambda theta: (
        powers(exponents, 0.02, np.prod(np.power([2.0, 3.0], exponents)))(theta[:, :2])
        + powers((1.0,), 0.05, 5.0)(theta[:, 2:])
    ))  # fmt: skip
    for name in ("a", "b"):
        verdict = found[name]
        assert isinstance(verdict, OnlyTogether)
        assert str(verdict.combination) == said and verdict.combination.whole
        scale = verdict.combination.exponents[0][1] / exponents[0]
        assert verdict.combination.interval.half_width() == pytest.approx(REACH * 0.02 * abs(scale), rel=0.01)
        assert verdict.range.low == -np.inf and verdict.range.high == np.inf
    assert isinstance(found["c"], Determined)
    assert len(found.combinations) == 1
    assert "determined only together with b" in found["a"].sentence()
    assert abs(found.correlation[0, 1]) > 0.99 and abs(found.correlation[0, 2]) < 0.01


def test_a_product_of_three():
    found = judge_likelihood(("a", "b", "c"), (2.0, 3.0, 5.0), powers((1.0, 1.0, 1.0), 0.05, 30.0))
    assert [str(one) for one in found.combinations] == ["a * b * c"]
    assert all(isinstance(one, OnlyTogether) for one in found.verdicts)


def test_a_number_known_to_a_thousandth_ties_none_known_to_a_factor():
    """Correlated by chance with one spread over decades: a product with its 1000th power would say nothing."""
    random = np.random.default_rng(4)
    wide = 8.0 * random.standard_normal(400)
    narrow = 0.008 * (wide / 8.0 + 0.01 * random.standard_normal(400))
    draws = np.exp(np.column_stack([wide, narrow]))
    judged = judge_samples(("C", "zeta"), (1.0, 1.0), draws)
    assert isinstance(judged["C"], NotFromTheseData)
    assert isinstance(judged["zeta"], Determined)


def test_exponents_that_are_not_whole_are_those_fitted():
    random = np.random.default_rng(3)
    g = random.normal(0.0, 1.0, 2000)
    samples = np.exp(np.column_stack([2.7183 * g + random.normal(0.0, 0.02, 2000), g]))
    found = judge_samples(("c", "g"), (1.0, 1.0), samples)["c"]
    assert isinstance(found, OnlyTogether) and not found.combination.whole
    assert dict(found.combination.exponents) == {"c": 1.0, "g": pytest.approx(-2.7183, rel=5e-3)}


def test_a_film_seen_at_one_gap_is_known_by_its_product():
    random = np.random.default_rng(4)
    thickness = 50e-6 * np.exp(random.normal(0.0, 0.3, 800))
    coefficient = 2.2e-8 * thickness**3 * np.exp(random.normal(0.0, 0.05, 800))
    names = ("ground.film.coefficient", "ground.film.thickness")
    found = judge_samples(names, (2.2e-8 * 50e-6**3, 50e-6), np.column_stack([coefficient, thickness]))
    for verdict in found.verdicts:
        assert isinstance(verdict, OnlyTogether)
        assert str(verdict.combination) == "ground.film.coefficient * ground.film.thickness^-3"
        assert verdict.combination.interval.half_width() == pytest.approx(REACH * 0.05, rel=0.1)
    sentence = found["ground.film.thickness"].sentence("m")
    assert "together with ground.film.coefficient" in sentence and "anywhere from 2" in sentence


def test_a_flat_parameter_is_free_and_an_end_that_does_not_close_is_open():
    found = judge_likelihood(("a", "flat"), (2.0, 3.0), lambda theta: powers((1.0,), 0.05, 2.0)(theta[:, :1]))
    flat = found["flat"]
    assert isinstance(flat, NotFromTheseData) and flat.related == ()
    assert "free to be anything" in flat.sentence() and isinstance(found["a"], Determined)

    def saturating(theta):
        return -0.5 * ((theta[:, 0] / (1.0 + theta[:, 0]) - 1.0) / 0.05) ** 2

    stiff = judge_likelihood(("k",), (100.0,), saturating)["k"]
    assert isinstance(stiff, NotFromTheseData)
    assert stiff.range.low == pytest.approx(1.0 / (1.0 / (1.0 - REACH * 0.05) - 1.0), rel=0.01)
    assert stiff.range.high == np.inf and "anything above 9" in stiff.sentence()


def test_two_heads_are_two_pieces():
    def heads(theta):
        near, far = (powers((1.0,), 0.05, middle)(theta) for middle in (2.0, 20.0))
        return np.logaddexp(near, far)

    found = judge_likelihood(("a",), (2.0,), heads)["a"]
    assert isinstance(found, NotFromTheseData)
    (low, high), (again, top) = found.range.pieces
    assert (low, high) == pytest.approx((2.0 * np.exp(-0.098), 2.0 * np.exp(0.098)), rel=1e-3)
    assert (again, top) == pytest.approx((20.0 * np.exp(-0.098), 20.0 * np.exp(0.098)), rel=1e-3)
    assert " or " in found.sentence()


def test_a_larger_head_far_from_the_start_is_found():
    def heads(theta):
        near, far = (powers((1.0,), 0.05, middle)(theta) for middle in (2.0, 20.0))
        return np.logaddexp(near - 20.0, far)

    found = judge_likelihood(("a",), (2.0,), heads)
    assert found.range("a").value == pytest.approx(20.0, rel=1e-3) and isinstance(found["a"], Determined)


def test_only_a_sum_is_known():
    """A force that grows from a start at a rate, seen at one age."""
    age = 0.03

    def likelihood(theta):
        return -0.5 * ((theta[:, 0] + age * theta[:, 1] - 250e-9) / 5e-9) ** 2

    names = ("start", "rate")
    found = judge_likelihood(names, (150e-9, 100e-9 / age), likelihood)
    for name in names:
        verdict = found[name]
        assert isinstance(verdict, OnlyTogether) and isinstance(verdict.combination, Sum)
        total = verdict.combination.interval
        assert (total.low, total.high) == pytest.approx(
            (250e-9 - REACH * 5e-9, 250e-9 + REACH * 5e-9), rel=1e-3
        )
        assert verdict.range.low == -np.inf and np.isfinite(verdict.range.high)
    assert found["start"].sentence("N") == (
        "start is determined only together with rate: these data fix start + 0.03 * rate = 2.5e-07 (SI) within 3.9 %, "
        "and leave start alone anything below 259.8 nN."
    )
    random = np.random.default_rng(12)
    rate = 100e-9 / age * np.exp(random.normal(0.0, 0.35, 600))
    start = np.abs(random.normal(250e-9, 5e-9, 600) - age * rate)
    drawn = judge_samples(names, (150e-9, 100e-9 / age), np.column_stack([start, rate]))["start"]
    assert isinstance(drawn, OnlyTogether) and isinstance(drawn.combination, Sum)
    assert dict(drawn.combination.weights) == {"start": 1.0, "rate": pytest.approx(age, rel=0.03)}
    assert drawn.combination.interval.half_width() == pytest.approx(REACH * 0.02, rel=0.1)
    assert len(found.combinations) == 1


def test_a_ridge_that_is_neither_product_nor_sum_is_no_combination():
    def round_about(theta):
        return -0.5 * ((np.hypot(np.log(theta[:, 0]), np.log(theta[:, 1])) - 1.0) / 0.05) ** 2

    found = judge_likelihood(("a", "b"), (np.e, 1.0), round_about)
    assert all(isinstance(one, NotFromTheseData) for one in found.verdicts)


def test_a_likelihood_with_a_kink_and_noise_of_rounding():
    def rough(theta):
        return np.round(-20.0 * np.abs(np.log(theta[:, 0] / 2.0)) - 10.0 * np.abs(np.log(theta[:, 1])), 6)

    found = judge_likelihood(("a", "b"), (2.3, 0.8), rough)
    half = 0.5 * REACH**2  # loss of log-likelihood that is allowed
    assert found.range("a").half_width() == pytest.approx(half / 20.0, rel=0.02)
    assert found.range("b").half_width() == pytest.approx(half / 10.0, rel=0.02)


def test_a_number_with_a_size_may_be_of_either_sign():
    random = np.random.default_rng(6)
    samples = random.normal([0.02, 1.0], [0.1, 0.05], (500, 2))
    names, values = ("offset", "gain"), (0.02, 1.0)
    assert isinstance(judge_samples(names, values, samples)["offset"], NotFromTheseData)
    assert isinstance(judge_samples(names, values, samples, sizes={"offset": 1.0})["offset"], Determined)
    zero = judge_samples(names, (0.0, 1.0), samples)
    assert isinstance(zero["offset"], NotFromTheseData) and isinstance(zero["gain"], Determined)
    assert zero.correlation.shape == (2, 2) and zero.basis == "500 draws"


def test_thresholds_are_arguments():
    samples = np.exp(np.random.default_rng(7).normal(0.0, 0.15, (500, 1)))
    assert isinstance(judge_samples(("a",), (1.0,), samples)["a"], NotFromTheseData)
    assert isinstance(judge_samples(("a",), (1.0,), samples, ties=Ties(width=0.4))["a"], Determined)


def test_what_cannot_be_judged():
    with pytest.raises(InputError) as refused:
        judge_likelihood(("a", "b"), (0.0, np.inf), straight, sizes={"c": 1.0})
    assert len(refused.value.problems) == 3
    with pytest.raises(InputError, match="outside its limits"):
        judge_likelihood(("a", "b"), (2.0, 3.0), straight, limits={"a": (3.0, 4.0)})
    with pytest.raises(InputError, match="not finite"):
        judge_likelihood(("a",), (2.0,), lambda theta: np.full(len(theta), -np.inf))
    with pytest.raises(InputError, match=r"shape \(draws, 2\)"):
        judge_samples(("a", "b"), (1.0, 1.0), np.ones((30, 3)))


def test_a_limit_is_no_evidence_but_binds_the_others():
    found = judge_likelihood(("a", "b"), (2.0, 3.0), powers((1.0, 1.0), 0.02, 6.0), limits={"a": (1.0, 4.0)})
    assert found.range("a").low == -np.inf and found.range("a").high == np.inf
    assert found.range("b").low == pytest.approx(6.0 / 4.0 * np.exp(-REACH * 0.02), rel=1e-3)


def test_a_likelihood_of_one_set_at_a_time():
    one = judge_likelihood(("a", "b"), (1.0, 1.0), one_by_one(lambda x: float(straight(x[None])[0])))
    assert one.range("b").high == pytest.approx(
        judge_likelihood(("a", "b"), (1.0, 1.0), straight).range("b").high
    )


def test_steps_of_a_chain_are_judged_side_by_side():
    random = np.random.default_rng(9)
    gap, rest = random.normal(0.0, 0.4, (2, 400))
    first = StepResult("gap", ("g",), np.array([1.0]), np.exp(gap[:, None]))
    film = np.exp(3.0 * gap + 0.03 * rest)
    flat = np.exp(0.01 * random.standard_normal(400))  # draws that never left their start

    def likelihood(theta):
        return -0.5 * (np.log(theta[0]) / 0.5) ** 2

    second = StepResult("film", ("C", "k"), np.ones(2), np.column_stack([film, flat]), likelihood=likelihood)
    found = judge_steps({"gap": first, "film": second})
    tied = found["C"]
    assert isinstance(tied, OnlyTogether) and str(tied.combination) == "C * g^-3"
    assert isinstance(found["k"], NotFromTheseData) and found.range("k").high == np.inf
    without = judge_steps({"gap": first, "film": StepResult("film", ("C", "k"), np.ones(2), second.samples)})
    assert isinstance(without["k"], Determined)


@pytest.mark.slow
def test_profile_intervals_cover():
    """200 ring-downs of known noise, fitted for level, rate and offset; 95 % intervals of the rate."""
    random = np.random.default_rng(11)
    times = np.linspace(0.0, 3.0, 30)
    truth = np.array([1.0, 0.8, 0.3])
    covered = 0
    for _ in range(200):
        data = truth[0] * np.exp(-truth[1] * times) + truth[2] + random.normal(0.0, 0.05, 30)

        def likelihood(theta, data=data):
            model = theta[:, :1] * np.exp(-theta[:, 1:2] * times) + theta[:, 2:]
            return -0.5 * np.sum((data - model) ** 2, axis=1) / 0.05**2

        found = judge_likelihood(
            ("level", "rate", "offset"), truth, likelihood, sizes={"offset": 1.0}, starts=0
        )
        inside = found.range("rate").low <= truth[1] <= found.range("rate").high
        columns = np.column_stack([np.exp(-truth[1] * times), np.ones(30)])
        at_truth = np.sum((data - columns @ np.linalg.lstsq(columns, data, rcond=None)[0]) ** 2) / 0.05**2
        lowest = -2.0 * likelihood(np.array([[found.range(name).value for name in found.names]]))[0]
        assert inside == (at_truth - lowest <= REACH**2)
        covered += inside
    assert 0.90 <= covered / 200 <= 0.98
