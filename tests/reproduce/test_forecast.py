"""Medians, intervals and ensembles."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.calibrate.ensemble import HypothesisEnsemble
from tarsus.calibrate.objective import Cells, Hypothesis
from tarsus.calibrate.prediction import Discrepancy, Miss, predict_row
from tarsus_reproduce.forecast import Member, WeightedValues, forecast, members_of, role_of


def test_quantiles_of_many_equal_weights_are_the_usual_ones():
    values = np.random.default_rng(1).normal(10.0, 2.0, 40_000)
    found = forecast(WeightedValues(values, np.ones(len(values))))
    assert found.median == pytest.approx(10.0, abs=0.05)
    assert (found.low, found.high) == pytest.approx((10.0 - 1.2816 * 2.0, 10.0 + 1.2816 * 2.0), abs=0.06)


def test_a_ensemble_weighs_its_members_whatever_the_number_of_their_periods():
    few, many = np.full(4, 1.0), np.full(400, 3.0)
    found = WeightedValues.joined([(0.75, few), (0.25, many)])
    assert forecast(found).median == 1.0 and forecast(found).high == 3.0
    assert found.share(2.0) == pytest.approx(0.25)
    turned = forecast(WeightedValues.joined([(0.25, few), (0.75, many)]))
    assert turned.median == 3.0 and turned.low == 1.0


def test_a_ensemble_predicts_as_the_calibration_that_it_came_from():
    """Two members, three windows each: the same median, interval and chance of a bounce from both, and wider than the
    windows alone."""
    windows, weights = np.array([[1.0, 2.0, 2.0], [3.0, 0.0, 2.0]]), np.array([0.6, 0.4])
    one = np.ones(1)
    cells = Cells(("bounces",), ("1",), np.ones((1, 1)), 0.5 * np.ones((1, 1)), 0.1 * one, one, one > 0.0)
    members = HypothesisEnsemble(np.zeros((2, 1)), weights, np.zeros(2), Hypothesis({}, 0, (0,)), np.zeros(0))
    (calibrated,) = predict_row(
        [members],
        one,
        [windows[:, None]],
        cells,
        np.array([0.5]),
        Discrepancy(1.7 * one, 0.2 * one),
        None,
        0.0,
    )
    samples = WeightedValues.joined(list(zip(weights.tolist(), windows, strict=True)))
    miss = Miss(0.5, 0.1, 1.7, 0.2)
    found = forecast(samples, miss)
    assert (found.median, found.low, found.high) == (calibrated.median, calibrated.low, calibrated.high)
    assert samples.share(0.5, miss) == pytest.approx(calibrated.p_bounce)
    bare = forecast(samples)
    assert found.high - found.low > bare.high - bare.low


def test_values_that_do_not_exist_are_left_out():
    found = WeightedValues(np.array([np.nan, 2.0, 2.0]), np.ones(3))
    assert forecast(found).to_dict() == {"median": 2.0, "low": 2.0, "high": 2.0}
    assert found.share(1.0) == 1.0
    nothing = WeightedValues(np.full(3, np.nan), np.ones(3))
    assert forecast(nothing).to_dict() == {"median": None, "low": None, "high": None}
    assert nothing.share(1.0) is None


def test_weights_of_a_ensemble_sum_to_one_and_bad_ones_are_refused():
    scene = ts.load_scene("cantilever")
    assert [one.weight for one in members_of([Member(scene, 3.0), Member(scene, 1.0)])] == [0.75, 0.25]
    with pytest.raises(ts.InputError, match="at least one"):
        members_of([])
    with pytest.raises(ts.InputError) as caught:
        members_of([Member(scene, 0.0), Member(scene, np.nan), Member(scene, 1.0)])
    assert len(caught.value.problems) == 2


def test_only_packaged_rows_that_a_device_was_fitted_to_are_calibrated_on():
    fitted = members_of("cantilever")
    assert role_of(fitted, True, True) == "calibrated on"
    assert role_of(fitted, False, True) == role_of(fitted, True, False) == "predicted"
    bare = [Member(ts.with_values(fitted[0].scene, {"provenance": {}}))]
    assert role_of(bare, True, True) == "predicted"
