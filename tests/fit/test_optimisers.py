"""Optimisers on a fit whose answer is known, and what they say where their package is missing."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from tarsus.base.errors import InputError
from tarsus.fit import Residuals, Unknowns, cma_es, least_squares
from tarsus.fit.regressions import Valleys, steps
from tarsus.fit.uncertainty import uncertainty_of


class Valley(Residuals):
    """Rosenbrock's valley over -2 to 2, its bottom at (1, 1)."""

    def __init__(self) -> None:
        sides = np.full(2, 2.0)
        self.unknowns = Unknowns(("a", "b"), ("1", "1"), -sides, sides, np.zeros(2, dtype=bool), (None, None))

    def residuals_at(self, points):
        a, b = self.unknowns.values(points).T
        return np.array([10.0 * (b - a * a), 1.0 - a]).T


def test_least_squares_finds_the_bottom_by_differences():
    found = least_squares(Valley(), np.array([0.2, 0.7]))
    assert found.values == {"a": pytest.approx(1.0, abs=1e-3), "b": pytest.approx(1.0, abs=2e-3)}
    assert found.cost < 1e-6 and 0 < found.slopes <= found.evaluations < 60


def test_steps_by_regressions_from_two_valleys_go_down_to_the_bottom():
    valley, rng, known = Valley(), np.random.default_rng(1), Valleys()
    points = valley.unknowns.draws(16, rng)
    for _ in range(40):
        residuals = valley.residuals_at(points)
        bases = known.bases(points, (residuals**2).sum(axis=1), 2)
        points = np.concatenate([points, *(steps(points, residuals, base, rng) for base in bases)])
    best = valley.costs(points).argmin()
    assert points[best] == pytest.approx([0.75, 0.75], abs=0.05)  # of a bent valley only nearly


def test_steps_by_regressions_go_on_from_a_corner_that_was_visited_twice():
    points = np.array([[0.2], [0.4], [0.6], [1.0], [1.0]])
    assert steps(points, 2.0 - points, 3, np.random.default_rng(1)) == pytest.approx(1.0)


def test_cma_es_finds_the_bottom_and_stays_in_its_bounds():
    found = cma_es(Valley(), np.array([0.2, 0.7]), seed=2, most=3000)
    assert found.x == pytest.approx([0.75, 0.75], abs=1e-4) and found.cost < 1e-8
    assert found.evaluations <= 3020 and found.message


def test_without_the_extra_a_sentence_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "cma", None)
    with pytest.raises(InputError, match=r"pip install cma$"):
        cma_es(Valley())


class Line(Residuals):
    """A straight line a + b t through points with errors: the covariance is a closed form. A third number is idle."""

    times, error = np.linspace(0.0, 4.0, 9), 0.25

    def __init__(self, log: bool = False) -> None:
        low, high = np.array([1.0, 1.0, 1.0]), np.array([5.0, 9.0, 2.0])
        self.unknowns = Unknowns(("a", "b", "idle"), ("m",) * 3, low, high, np.full(3, log), (None,) * 3)

    def residuals_at(self, points):
        a, b, _ = self.unknowns.values(points).T
        return (a[:, None] + b[:, None] * self.times - (2.0 + 3.0 * self.times)) / self.error

    def jacobian(self, x):
        slopes = self.unknowns.slopes(self.point(x))
        return np.stack([1.0 + 0.0 * self.times, self.times, 0.0 * self.times], axis=1) * slopes / self.error


@pytest.mark.parametrize("log", [False, True])
def test_standard_errors_of_a_line_are_those_of_the_closed_form(log):
    found = least_squares(Line(log), np.array([0.3, 0.3, 0.5]))
    t, n = Line.times, len(Line.times)
    spread = n * (t**2).sum() - t.sum() ** 2
    sure = found.uncertainty
    assert sure is not None and found.values["b"] == pytest.approx(3.0)
    assert sure.errors["a"] == pytest.approx(Line.error * np.sqrt((t**2).sum() / spread))
    assert sure.errors["b"] == pytest.approx(Line.error * np.sqrt(n / spread))
    assert sure.correlations[0, 1] == pytest.approx(-t.sum() / np.sqrt(n * (t**2).sum()))
    assert np.isinf(sure.errors["idle"]) and np.isnan(sure.correlations[2]).all()
    assert sure.notes == ("the residuals do not determine idle: the Jacobian is singular there",)
    again = Line(log).uncertainty(found.x)
    assert again.errors == pytest.approx(sure.errors)


def test_two_numbers_that_only_their_sum_is_told_of_are_both_untold():
    unknowns = Unknowns(("a", "b"), ("1", "1"), np.zeros(2), np.ones(2), np.zeros(2, bool), (None, None))
    sure = uncertainty_of(np.array([[1.0, 1.0], [3.0, 3.0]]), unknowns, np.array([0.5, 1.0]))
    assert np.isinf([*sure.errors.values()]).all() and np.isnan(sure.correlations).all()
    assert "a, b" in sure.notes[0] and sure.notes[1].startswith("b ended at a bound")
