"""Predictors that know nothing but the other rows, and the skill against them."""

from __future__ import annotations

import numpy as np
import pytest

from tarsus.calibrate.skill import distances, naive_errors, skill_of

ROWS = [
    {"wave": "sine", "hertz": 10.0},
    {"wave": "sine", "hertz": 100.0},
    {"wave": "square", "hertz": 100.0},
    {"wave": "square", "hertz": 10.0},
]


def test_the_mean_and_the_nearest_of_the_other_rows_are_what_they_are_called() -> None:
    """Of four rows on a square each has two that are equally near, at one decade or one word."""
    assert distances(ROWS) == pytest.approx(
        np.array([[0.0, 1.0, 2**0.5, 1.0], [1.0, 0.0, 1.0, 2**0.5], [2**0.5, 1.0, 0.0, 1.0], [1.0, 2**0.5, 1.0, 0.0]])
    )
    found = naive_errors(np.array([1.0, 2.0, 4.0, 2.0]), ROWS)
    assert found["mean of the other rows"] == pytest.approx(np.mean([8 / 3 - 1, 1 / 6, 1 - 5 / 12, 1 / 6]))
    assert found["nearest row"] == pytest.approx(np.mean([1.0, 0.25, 0.5, 0.25]))


def test_rows_without_a_value_do_not_count() -> None:
    assert naive_errors(np.array([1.0, np.nan, 0.0, 0.0]), ROWS) == {}
    assert naive_errors(np.array([1.0, np.nan, 1.0, 0.0]), ROWS) == {"mean of the other rows": 0.0, "nearest row": 0.0}


def test_a_power_law_is_found_from_the_other_rows() -> None:
    rows = [{"wave": wave, "hertz": hertz} for wave in ("sine", "square") for hertz in (5.0, 20.0, 90.0)]
    values = np.array([(2.0 if one["wave"] == "sine" else 3.0) * one["hertz"] ** -0.7 for one in rows])
    assert naive_errors(values, rows)["power law of the other rows"] < 1e-12


def test_skill_is_none_of_one_that_knows_as_little() -> None:
    naive = {"mean of the other rows": 0.2, "nearest row": 0.1}
    assert skill_of(0.1, naive) == 0.0 and skill_of(0.05, naive) == 0.5 and skill_of(None, naive) is None
    assert skill_of(0.1, {}) is None
