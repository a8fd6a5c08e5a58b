"""Figures of rows, and what becomes of claims."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from tarsus.base.errors import InputError
from tarsus.base.spec import validate
from tarsus.validation.claims import MeasuredColumn, StatedClaim
from tarsus.validation.verdict import ClaimOutcome, Compared, Figures, judged

COLUMN = MeasuredColumn(words="time", unit="ms")


def compared(measured: list[float], computed: list[float]) -> list[Compared]:
    return [
        Compared(i, i, {}, "time_ms", one, None, other)
        for i, (one, other) in enumerate(zip(measured, computed, strict=True))
    ]


def claim(**criteria: Any) -> StatedClaim:
    return validate(StatedClaim, {"written": "2026-11-28", "seen": "all", **criteria})


def test_figures():
    found = Figures.of(compared([1.0, 2.0, 4.0, 0.0], [1.1, 1.9, math.nan, 0.3]))
    assert (found.rows, found.closes) == (4, 0.75)
    np.testing.assert_allclose(found.errors, [0.1, 0.05, math.inf], rtol=1e-12)  # of 0 there is no relative error
    assert found.median_error == pytest.approx(0.1) and found.bias == pytest.approx(0.025)
    assert found.mean_deviation == pytest.approx(0.5 / 3.0)
    assert math.isnan(found.r2)  # one row has no number
    assert found.share_within(0.06) == pytest.approx(1.0 / 3.0)
    assert Figures.of(compared([1.0], [1.5])).share_within(0.5) == 1.0


def test_the_coefficient_of_determination_is_that_of_the_numbers_as_they_are():
    measured = np.array([1.0, 2.0, 3.0])
    assert Figures.of(compared(measured.tolist(), measured.tolist())).r2 == 1.0
    assert Figures.of(compared(measured.tolist(), [2.0, 2.0, 2.0])).r2 == pytest.approx(0.0)
    assert Figures.of(compared(measured.tolist(), (2.0 * measured).tolist())).r2 == pytest.approx(-6.0)


@pytest.mark.parametrize(
    ("criteria", "holds"),
    [
        ({"median_error": 0.08}, True),
        ({"median_error": 0.07}, False),
        ({"within": {"error": 0.06, "share": 0.5}}, True),
        ({"within": {"error": 0.04, "share": 0.5}}, False),
        ({"bias": [0.0, 0.05]}, True),
        ({"bias": [-0.1, 0.0]}, False),
        ({"mean_deviation": "150 ms"}, True),
        ({"mean_deviation": "50 ms"}, False),
        ({"closes": 1.0}, True),
        ({"r2": 0.9}, True),
        ({"r2": 0.999}, False),
        ({"median_error": 0.11, "r2": 0.999}, False),  # all of them, or it fails
    ],
)
def test_a_claim_holds_by_all_of_its_criteria(criteria, holds):
    rows = compared([1.0, 2.0], [1.1, 1.9])
    for known in (False, True):
        verdict = judged("one", claim(**criteria, should_fail=known), "time_ms", COLUMN, rows)
        expected = {
            (True, False): ClaimOutcome.HOLDS,
            (False, False): ClaimOutcome.FAILS,
            (True, True): ClaimOutcome.HOLDS_UNEXPECTEDLY,
            (False, True): ClaimOutcome.FAILS_AS_KNOWN,
        }[holds, known]
        assert verdict.outcome is expected
        assert verdict.outcome.expected is (holds is not known)
    none = judged("one", claim(**criteria), "time_ms", COLUMN, [])
    assert none.outcome is ClaimOutcome.NO_ROWS and none.outcome.expected


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ({}, "claims nothing"),
        ({"bias": [0.1, -0.1]}, "begins at its lower end"),
        ({"median_error": 0.1, "rows": "volts"}, "expected comparisons"),
    ],
)
def test_a_claim_that_is_none(table, said):
    with pytest.raises(InputError, match=said):
        claim(**table)


@pytest.mark.parametrize(("after", "said"), [(False, "2026-11-28"), (True, "2026-11-28, after a run")])
def test_a_claim_says_whether_a_run_came_before_it(after, said):
    assert claim(closes=1.0, after_run=after).when == said
