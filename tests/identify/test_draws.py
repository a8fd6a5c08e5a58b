"""Draws: they cover the truth, respect bounds, and what is known to a factor only moves by factors."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom

from tarsus.identify.draws import DRAWS, carried, sandwich_draws, within
from tarsus.identify.step import StepResult


def test_a_linear_estimate_of_well_known_numbers_is_carried_exactly() -> None:
    random = np.random.default_rng(1)
    values, slope = np.array([2.0, -3.0]), np.array([[0.5, 0.2]])
    samples = values + 0.01 * random.standard_normal((DRAWS, 2))
    off = carried(lambda x: slope @ x, values, samples)
    np.testing.assert_allclose(off, (samples - values) @ slope.T, rtol=0.0, atol=1e-12)


def test_a_number_known_to_a_factor_only_is_moved_to_where_draws_lie() -> None:
    """Coefficient and thickness of a film over decades: added standard deviations would lead to a thickness below 0."""
    random = np.random.default_rng(2)
    along = random.standard_normal(DRAWS)
    values = np.array([1e-25, 5e-6])
    samples = values * np.exp(np.outer(along, [9.0, 3.0]) + 0.1 * random.standard_normal((DRAWS, 2)))
    met: list[np.ndarray] = []

    def estimate(x: np.ndarray) -> np.ndarray:
        met.append(x)
        return np.array([np.log(x[0] * x[1])])

    off = carried(estimate, values, samples)
    tried = np.array(met)
    assert np.all((tried > samples.min(axis=0)) & (tried < samples.max(axis=0)))
    wanted = np.log(samples[:, 0] * samples[:, 1]) - np.log(values[0] * values[1])
    np.testing.assert_allclose(off[:, 0], wanted, rtol=0.0, atol=0.05 * wanted.std())


@pytest.mark.parametrize(("groups", "unequal", "noisier"), [(1, 0.0, 1.0), (2, 2.0, 3.0), (3, 0.0, 3.0), (8, 1.0, 3.0)])
def test_newton_draws_cover_the_truth_for_few_and_unequal_groups(groups, unequal, noisier):
    """Groups that are noisier than is known, and one alone, of which nothing but its noise is known."""
    random, covered, trials = np.random.default_rng(groups), 0, 300
    for seed in range(trials):
        information = np.exp(unequal * random.standard_normal(groups))
        seen = noisier * random.standard_normal(groups) / np.sqrt(information)
        found = float(information @ seen / information.sum())
        draws = sandwich_draws([(information[:, None, None], (information * (seen - found))[:, None])], seed)
        low, high = np.quantile(draws[:, 0], [0.025, 0.975]) + found
        covered += bool(low <= 0.0 <= high)
    assert binom.ppf(1e-3, trials, 0.95) <= covered


def test_a_line_over_few_events_is_covered_at_both_ends():
    """Each event tells one combination of the two parameters alone, so that n - 2 of n scores are left."""
    at, trials = np.array([0.2, 0.3, 0.7, 1.0, 1.1]), 300
    design = np.column_stack([np.ones_like(at), at])
    information = np.einsum("na,nb->nab", design, design)
    random, covered = np.random.default_rng(3), np.zeros(2)
    for seed in range(trials):
        seen = 5.0 * random.standard_normal(len(at))
        found = np.linalg.solve(design.T @ design, design.T @ seen)
        draws = sandwich_draws([(information, design * (seen - design @ found)[:, None])], seed)
        low, high = np.quantile(draws, [0.025, 0.975], axis=0) + found
        covered += (low <= 0.0) & (high >= 0.0)
    assert np.all(covered >= binom.ppf(1e-3, trials, 0.95))


@pytest.mark.parametrize("true", [0.0, 0.3, 1.0, 2.5, 9.0])
def test_draws_within_bounds_cover(true):
    """A number of unit error that is not negative, and one that goes with it."""
    spread = np.array([[1.0, -0.8], [-0.8, 1.0]])
    random, covered, trials = np.random.default_rng(7), np.zeros(2), 300
    for _ in range(trials):
        free = random.multivariate_normal([true, 5.0], spread)
        drawn = random.multivariate_normal(free, spread, DRAWS)
        given = free - min(free[0], 0.0) * np.array([1.0, -0.8])
        values, samples, ends = within(given, drawn, ((0.0, np.inf), (-np.inf, np.inf)))
        assert np.all(samples[:, 0] >= 0.0)
        step = StepResult("one", ("a", "b"), values, samples, bounds={"a": ends[0]})
        for j, (path, truth) in enumerate((("a", true), ("b", 5.0))):
            low, high = step.interval(path)
            covered[j] += low <= truth <= high
    assert np.all(covered >= binom.ppf(1e-3, trials, 0.95))


def test_draws_inside_stay_and_an_estimate_far_outside_is_no_number():
    random = np.random.default_rng(8)
    inside = random.uniform(0.4, 0.6, (DRAWS, 1))
    values, samples, ends = within(np.array([0.5]), inside, ((0.0, 1.0),))
    assert values[0] == 0.5 and ends == ((-np.inf, np.inf),) and np.array_equal(samples, inside)
    above, drawn, ends = within(np.array([1.3]), 1.3 + 0.01 * random.standard_normal((DRAWS, 1)), ((0.0, 1.0),))
    step = StepResult("one", ("e",), above, drawn, bounds={"e": ends[0]})
    assert np.all(drawn <= 1.0) and "lies outside" in step.unsound()[0]
    near, drawn, ends = within(np.array([1.01]), 1.01 + 0.02 * random.standard_normal((DRAWS, 1)), ((0.0, 1.0),))
    step = StepResult("one", ("e",), near, drawn, bounds={"e": ends[0]})
    assert step.value("e") == 1.0 == step.interval("e")[1] and step.unsound() == []
