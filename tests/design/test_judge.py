"""Candidates on grounds: risks, worst grounds of a box, cutting planes; each against a closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tarsus.base.errors import InputError
from tarsus.design.grounds import Grounds
from tarsus.design.judge import MEAN, NOMINAL, WORST, AttackEffort, Certificate, Judge, cvar, risk_of
from tarsus.fit.unknowns import Unknowns


def box(*names: str, low: float = 0.0, high: float = 1.0) -> Unknowns:
    count = len(names)
    ends = np.full(count, low), np.full(count, high)
    return Unknowns(names, ("1",) * count, *ends, np.zeros(count, dtype=bool), (None,) * count)


def judge_of(costs, over: Unknowns, seed: int = 0, grounded: tuple[int, ...] = (0,)) -> Judge:
    """Of costs (nr, no) from candidates (nr, nx) and grounds (nr, np)."""
    own = Grounds({name: np.array([0.5 * (over.low[0] + over.high[0])]) for name in over.names})
    return Judge(
        lambda rows, grounds: costs(rows, np.stack(list(grounds.values()), axis=1)), own, over, WORST, seed, grounded
    )


def test_risks_are_what_they_say():
    scores, weights = np.array([[1.0, 5.0, 3.0, 4.0]]), np.array([0.1, 0.2, 0.3, 0.4])
    assert NOMINAL(scores, weights)[0] == 1.0 and WORST(scores, weights)[0] == 5.0
    assert MEAN(scores, weights)[0] == pytest.approx(0.1 + 1.0 + 0.9 + 1.6)
    # the worst 30 %: all of the 5 (0.2) and a quarter of the 4 (0.1)
    assert cvar(0.7)(scores, weights)[0] == pytest.approx((0.2 * 5.0 + 0.1 * 4.0) / 0.3)
    assert cvar(0.0)(scores, weights)[0] == pytest.approx(MEAN(scores, weights)[0])
    assert [risk_of(word).name for word in ("worst", {"cvar": 0.9}, "mean", "nominal")] == [
        "worst",
        "cvar 0.9",
        "mean",
        "nominal",
    ]
    assert [risk_of(word).tail for word in ("worst", "nominal", "mean")] == [0.0, None, 1.0]
    assert risk_of({"cvar": 0.9}).tail == pytest.approx(0.1)
    for word in ("cvar", {"cvar": 1.0}, {"cvar": "x"}, "cvar:0.9", "best"):
        with pytest.raises(InputError, match="risk"):
            risk_of(word)


@pytest.mark.parametrize("risk", [MEAN, WORST, cvar(0.5), cvar(0.9)], ids=lambda one: one.name)
def test_limits_are_kept_by_every_run_or_not_at_all(risk):
    """A mean of ones is not one by its last bit: candidates that kept all limits were barred."""
    judge = replace(judge_of(hills, box("a", "b", low=0.1, high=0.7)), limited=True)
    for count in range(2, 40):
        costs, grounds = np.ones((2, count, 2)), Grounds({"a": np.zeros(count)}, np.ones(count))
        costs[:, :, 0], costs[1, count // 2, 1] = np.linspace(1.0, 2.0, count), 3.0
        risked = judge.risked(costs, grounds, risk)
        assert risked[:, -1].tolist() == [1.0, 3.0]
        assert risked[0, 0] == pytest.approx(risk(costs[:1, :, 0], grounds.weights)[0])


def hills(rows, grounds):
    """A broad hill in one corner of a box, a narrow one, higher, elsewhere; and an objective without any."""
    x, y = grounds.T
    broad = np.exp(-(((x - 0.2) ** 2 + (y - 0.2) ** 2) / 0.02))
    narrow = 1.5 * np.exp(-(((x - 0.45) ** 2 + (y - 0.5) ** 2) / 0.004))
    return np.stack([broad + narrow + 0.0 * rows[:, 0], np.zeros(len(x))], axis=1)


SQUARE = box("a", "b", low=0.1, high=0.7)
ONE = np.array([[0.5, 0.5]])


def test_an_attack_finds_the_worst_ground_of_every_candidate_inside_the_box():
    """The worst is at 0.37, which no corner and no spread ground is."""

    def costs(rows, grounds):
        hurt = -((grounds[:, 0] - 0.37) ** 2) - rows[:, 0]
        return np.stack([hurt, np.zeros(len(hurt))], axis=1)

    found = judge_of(costs, box("g", low=0.2, high=0.6)).attack(np.array([[0.1], [0.9]]), AttackEffort(4, 8))
    assert found.grounds[:, 0, 0] == pytest.approx(0.37, abs=0.01)
    assert found.costs[:, 0] == pytest.approx([-0.1, -0.9], abs=1e-4)
    assert found.tried == 2 + 4 + 8 * 6


def test_several_regions_are_climbed_where_one_hides_the_worst():
    reached = {
        islands: sum(
            judge_of(hills, SQUARE, seed).attack(ONE, AttackEffort(32, 8, islands)).costs[0, 0] > 1.45
            for seed in range(12)
        )
        for islands in (1, 4)
    }
    assert reached[4] > reached[1] and reached[4] >= 8


def test_a_check_by_chance_says_how_much_of_the_box_may_be_worse():
    found = judge_of(hills, SQUARE, 3).attack(ONE, AttackEffort(512, 0), by_chance=True)
    assert found.first.shape == (1, 512, 2) and found.tried == 512
    worse = int((found.first[0, :, 0] > 1.05).sum())
    share = 0.004 * np.log(1.5 / 1.05) * np.pi / 0.36  # of the box: a circle about the narrow hill
    assert 0 < worse / 512 < Certificate(512, worse).share and Certificate(512, worse).share > share
    assert Certificate(1000, 0).share == pytest.approx(3.0 / 1000, rel=0.01)
    assert Certificate(10, 10).share == 1.0


def test_cutting_planes_close_the_gap_of_a_minimax_problem():
    """min over x of max over g in [0, 1] of (x - g)^2 + g, by a fine grid."""
    xs, gs = np.linspace(0.0, 1.5, 3001), np.linspace(0.0, 1.0, 2001)
    table = (xs[:, None] - gs) ** 2 + gs
    wanted = table.max(axis=1).min()
    judge = judge_of(lambda rows, grounds: (rows - grounds) ** 2 + grounds, box("g"))

    def improve(grounds):
        own = grounds.values["g"]
        scores = ((xs[:, None] - own) ** 2 + own).max(axis=1)
        return xs[np.argsort(scores)[:3], None]

    first = Grounds({"g": np.array([0.2])})
    for begun in (None, np.array([[0.3]])):
        grounds, rounds, best = judge.close_gap(improve, begun, first, AttackEffort(32, 8), 8, "x")
        assert rounds[0].gap > 0.02 and rounds[-1].gap <= 0.02 and len(grounds) > 1
        assert rounds[-1].worst == pytest.approx(wanted, rel=0.02)
        assert table[np.argmin(np.abs(xs - best[0]))].max() <= 1.02 * wanted
