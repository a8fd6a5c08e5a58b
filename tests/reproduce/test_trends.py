"""Verdicts on curves made by hand."""

from __future__ import annotations

import numpy as np
import pytest

from tarsus_reproduce.trends import HasExtrema, HasMaximum, MuchAbove, TrendCurve, TrendVerdict, falls, rises

X = np.linspace(1.0, 3.0, 21)
UP, HUMP, WAVE = X, 4.0 - (X - 1.8) ** 2, X + np.sin(6.0 * X)
AGREES, CONTRADICTS, INSENSITIVE, OPEN = (
    TrendVerdict.AGREES,
    TrendVerdict.CONTRADICTS,
    TrendVerdict.INSENSITIVE,
    TrendVerdict.NOT_DETERMINED,
)


def curve(*rows: np.ndarray, spread: float = np.nan) -> TrendCurve:
    y = np.column_stack(rows)
    return TrendCurve(X, y, np.full(y.shape, spread))


FLAT = np.full(21, 5.0)
NOISE = 5.0 + np.random.default_rng(4).normal(0.0, 1.0, 21)

CASES = [
    (rises(), [UP, UP**2], AGREES),
    (rises(), [-UP], CONTRADICTS),
    (rises(), [FLAT, FLAT], INSENSITIVE),
    (rises(), [FLAT + 1e-4 * X, FLAT], INSENSITIVE),
    (rises(), [-UP, FLAT], CONTRADICTS),
    (rises(), [UP, -UP], OPEN),
    (rises(), [UP, FLAT], OPEN),
    (rises(), [NOISE], OPEN),
    (rises(), [0.0 * X], INSENSITIVE),
    (falls(), [-UP, -(UP**3)], AGREES),
    (falls(), [UP], CONTRADICTS),
    (falls(beyond=1.8), [HUMP], AGREES),
    (falls(), [HUMP], OPEN),
    (HasMaximum(), [HUMP, 2.0 * HUMP], AGREES),
    (HasMaximum(), [UP], CONTRADICTS),
    (HasMaximum(), [FLAT], INSENSITIVE),
    (HasExtrema(), [FLAT, FLAT], INSENSITIVE),
    (HasMaximum(), [HUMP, UP], OPEN),
    (HasMaximum(), [np.where(X < 2.0, 5.0, 1.0)], CONTRADICTS),
    (HasExtrema(), [WAVE], AGREES),
    (HasExtrema(), [UP], CONTRADICTS),
    (HasExtrema(), [HUMP], OPEN),
]


@pytest.mark.parametrize(("claim", "rows", "verdict"), CASES)
def test_a_curve_is_judged_by_all_its_replicates(claim, rows, verdict):
    assert claim.judge(curve(*rows)).verdict is verdict


def test_what_is_within_the_spread_from_period_to_period_is_no_change():
    assert rises().judge(curve(UP, spread=0.9)).verdict is AGREES
    finding = rises().judge(curve(UP, spread=1.1))
    assert finding.verdict is INSENSITIVE and finding.words == "does not change"
    assert HasMaximum().judge(curve(HUMP, spread=0.4)).verdict is CONTRADICTS
    assert HasMaximum().judge(curve(HUMP, spread=0.8)).verdict is INSENSITIVE


def test_a_finding_holds_the_numbers_behind_it():
    finding = HasMaximum().judge(curve(HUMP, 3.0 * HUMP))
    assert finding.at == pytest.approx((1.8, 1.8)) and finding.words == "largest at 1.8"
    assert finding.first == pytest.approx(2.0 * HUMP[0]) and finding.last == pytest.approx(2.0 * HUMP[-1])
    fall = falls().judge(curve(-UP))
    assert fall.rho == pytest.approx((-1.0,)) and fall.words == "rho -1"
    assert rises().judge(curve(UP, -UP)).words == "rho -1 to 1 (1 of 2 replicates as said)"
    assert fall.to_dict()["verdict"] == "agrees"


def test_runs_that_failed_are_left_out():
    broken = UP.copy()
    broken[[3, 7]] = np.nan
    assert rises().judge(curve(broken)).verdict is AGREES
    assert rises().judge(curve(np.full(21, np.nan))).verdict is OPEN


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
    found = MuchAbove("(b)", (1, 1)).judge(TrendCurve(np.arange(2.0), pair, 0.0 * pair))
    assert (found.verdict, found.words) == (verdict, words)
