"""Predictions: median and interval by hand, probability of a bounce."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from calibrate.toys import cells
from tarsus.calibrate.ensemble import HypothesisEnsemble
from tarsus.calibrate.objective import Hypothesis
from tarsus.calibrate.prediction import Discrepancy, discrepancy_of, predict_row, widened
from tarsus.fit.ranges import weighted_quantile


def ensemble(weights: list[float]) -> HypothesisEnsemble:
    share = np.array(weights)
    return HypothesisEnsemble(
        np.zeros((len(share), 1)), share, np.zeros(len(share)), Hypothesis({}, 0, (0,)), np.zeros(0)
    )


def predicted(readings, weights, sigma=1.0, wrong=0.0):
    values = np.asarray(readings, dtype=float)[:, None, :]
    (found,) = predict_row(
        [ensemble(weights)],
        np.ones(1),
        [values],
        cells([[1.0]], exists=True),
        np.array([0.01]),
        Discrepancy(np.array([sigma]), np.array([wrong])),
    )
    return found


def test_one_member_has_the_discrepancy_alone():
    table = cells([[1.0]], absolute=0.0, relative=0.1)
    (found,) = predict_row(
        [ensemble([1.0])],
        np.ones(1),
        [np.full((1, 1, 1), 2.0)],
        table,
        np.zeros(1),
        Discrepancy(np.array([1.5]), np.zeros(1)),
    )
    assert found.median == pytest.approx(2.0)
    assert np.log(found.high / 2.0) == pytest.approx(0.15 * norm.ppf(0.9), rel=0.02)
    assert np.log(found.low / 2.0) == pytest.approx(-0.15 * norm.ppf(0.9), rel=0.02)
    assert found.holds(2.0 * np.exp(0.18)) and not found.holds(2.0 * np.exp(0.21))


def test_a_discrepancy_spreads_a_value_by_its_tolerances_and_never_below_zero():
    values, weights = widened(np.array([10.0, 0.0]), np.array([0.75, 0.25]), (3.0, 0.4), 1.0)
    assert len(values) == len(weights) == 30 and weights == pytest.approx(np.repeat([0.05, 0.25 / 15.0], 15))
    assert values.min() == 0.0 and values[7] == pytest.approx(10.0) and values[22] == pytest.approx(0.0)
    tau = np.hypot(3.0, 4.0)  # by hand: log((v + a) / (10 + a)) (10 + a) / tau is a standard normal
    normal = np.log((values[:15] + 3.0) / 13.0) * 13.0 / tau
    assert normal == pytest.approx(norm.ppf((np.arange(15) + 0.5) / 15.0), abs=1e-9)


def test_an_interval_of_a_model_that_misses_all_spans_two_orders_and_no_more():
    found = predicted([[1.0]], [1.0], sigma=1e4)
    assert found.median == pytest.approx(1.0) and 9.0 < found.high < 12.0 and 0.07 < found.low < 0.12


def test_the_probability_of_a_bounce_counts_windows_by_weight_and_the_models_own_errors():
    readings = [[1.0, 1.0, 0.0, 0.0], [1.0, 1.0, 1.0, 1.0]]
    assert predicted(readings, [0.75, 0.25]).p_bounce == pytest.approx(0.625)
    assert predicted(readings, [0.75, 0.25], wrong=0.2).p_bounce == pytest.approx(0.625 * 0.8 + 0.375 * 0.2)


def test_failed_members_are_left_out_and_counted():
    found = predicted([[1.0, 1.0], [np.inf, 1.0]], [0.75, 0.25])
    assert found.failed == pytest.approx(0.25) and found.median == found.p_bounce == pytest.approx(1.0)
    assert np.isnan(predicted([[np.inf]], [1.0]).median)


def test_discrepancy_is_the_quantile_of_residuals_over_that_of_a_normal():
    table = cells([[1.0]] * 10, exists=True)
    residuals = np.arange(1.0, 11.0)[:, None]
    wrong = np.full((10, 1), 0.1)
    found = discrepancy_of(table, residuals, wrong, 2)
    factor = np.sqrt(10.0 / 8.0)
    assert found.sigma[0] == pytest.approx(np.quantile(np.arange(1.0, 11.0), 0.88) / norm.ppf(0.9) * factor)
    assert found.wrong[0] == pytest.approx(1.5 / 11.0)
    assert discrepancy_of(table, 0.1 * residuals, wrong, 2).sigma[0] == 1.0, "never below the tolerance"


def test_weighted_quantiles_are_those_of_repeated_values():
    values, weights = np.array([3.0, 1.0, 2.0]), np.array([1.0, 2.0, 1.0])
    assert weighted_quantile(values, weights, 0.25) == 1.0
    assert weighted_quantile(values, weights, 0.875) == 3.0
