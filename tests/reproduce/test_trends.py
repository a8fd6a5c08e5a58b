"""Verdicts on curves made by hand."""

from __future__ import annotations

import numpy as np
import pytest

from tarsus_reproduce.trends import TrendCurve, TrendVerdict, judge

X = np.linspace(1.0, 3.0, 21)
UP, HUMP, WAVE, FLAT = X, 4.0 - (X - 1.8) ** 2, X + np.sin(6.0 * X), np.full(21, 5.0)
NOISE = 5.0 + np.random.default_rng(4).normal(0.0, 1.0, 21)
BROKEN = np.where(np.isin(np.arange(21), (3, 7)), np.nan, UP)
AGREES, CONTRADICTS, INSENSITIVE, OPEN = TrendVerdict


def curve(*rows: np.ndarray, spread: float = np.nan) -> TrendCurve:
    y = np.column_stack(rows)
    return TrendCurve(X, y, np.full(y.shape, spread))


@pytest.mark.parametrize(
    ("said", "rows", "verdict", "words"),
    [
        ("rises", [UP, UP**2], AGREES, "rho 1"),
        ("rises", [BROKEN], AGREES, "rho 1"),
        ("rises", [-UP], CONTRADICTS, "rho -1"),
        ("rises", [FLAT, FLAT], INSENSITIVE, "does not change"),
        ("rises", [0.0 * X], INSENSITIVE, "0 throughout"),
        ("rises", [-UP, FLAT], CONTRADICTS, "rho -1 to 0"),
        ("rises", [UP, -UP], OPEN, "rho -1 to 1 (1 of 2 replicates as said)"),
        ("rises", [NOISE], OPEN, None),
        ("rises", [np.nan * X], OPEN, "too few runs reached their end"),
        ("falls", [-UP, -(UP**3)], AGREES, "rho -1"),
        ("falls", [HUMP], OPEN, None),
        ("maximum", [HUMP, 2.0 * HUMP], AGREES, "largest at 1.8"),
        ("maximum", [UP], CONTRADICTS, "largest at an end"),
        ("maximum", [FLAT], INSENSITIVE, "does not change"),
        ("maximum", [HUMP, UP], OPEN, "largest at 1.8 (1 of 2 replicates as said)"),
        ("maximum", [np.where(X < 2.0, 5.0, 1.0)], CONTRADICTS, "largest at an end"),
        ("extrema", [WAVE], AGREES, "local maximum and minimum at 1.3 to 2.9"),
        ("extrema", [UP], CONTRADICTS, "no local extremum"),
        ("extrema", [HUMP], OPEN, "local maximum at 1.8 (0 of 1 replicates as said)"),
    ],
)
def test_a_curve_is_judged_by_all_its_replicates(said, rows, verdict, words):
    found = judge(said, curve(*rows))
    assert found.verdict is verdict and (words is None or found.words == words)


def test_what_is_said_of_a_part_is_asked_there():
    assert judge("falls", curve(HUMP), 1.8).verdict is AGREES


def test_what_is_within_the_spread_from_period_to_period_is_no_change():
    found = [judge("rises", curve(UP, spread=spread)).verdict for spread in (0.9, 1.1)]
    assert found == [AGREES, INSENSITIVE]
    found = [judge("maximum", curve(HUMP, spread=spread)).verdict for spread in (0.4, 0.8)]
    assert found == [CONTRADICTS, INSENSITIVE]


def test_a_finding_holds_the_numbers_behind_it():
    finding = judge("maximum", curve(HUMP, 3.0 * HUMP))
    assert finding.at == pytest.approx((1.8, 1.8))
    assert finding.first == pytest.approx(2.0 * HUMP[0]) and finding.last == pytest.approx(2.0 * HUMP[-1])
    assert judge("falls", curve(-UP)).rho == pytest.approx((-1.0,))


@pytest.mark.parametrize(
    ("values", "verdict", "words"),
    [
        ([[4.0, 9.0], [9.0, 2.0]], AGREES, "2 times"),
        ([[3.0, 9.0], [9.0, 2.0]], OPEN, "1.5 times"),
        ([[1.0, 9.0], [9.0, 2.0]], CONTRADICTS, "0.5 times"),
        ([[2.001, 9.0], [9.0, 2.0]], INSENSITIVE, "1 times"),
        ([[1.0, 9.0], [9.0, 1e-12]], AGREES, "the other stands still"),
        ([[1e-12, 9.0], [9.0, 1e-13]], INSENSITIVE, "the other stands still"),
        ([[np.nan, 9.0], [9.0, 1.0]], OPEN, "too few runs reached their end"),
    ],
)
def test_much_greater_is_twice(values, verdict, words):
    pair = np.array(values)
    found = judge("much above (b)", TrendCurve(np.arange(2.0), pair, 0.0 * pair))
    assert (found.verdict, found.words) == (verdict, words)
