"""Optimisers on a fit whose answer is known, and what they say where their package is missing."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from tarsus.base.errors import InputError
from tarsus.fit import (
    Residuals,
    Unknowns,
    cma_es,
    differential_evolution,
    least_squares,
    minimize,
    pymoo_problem,
)


class Valley(Residuals):
    """Rosenbrock's valley over -2 to 2, its bottom at (1, 1); with goals, the distances from two places."""

    def __init__(self, goals: bool = False) -> None:
        sides = np.full(2, 2.0)
        self.unknowns = Unknowns(("a", "b"), ("1", "1"), -sides, sides, np.zeros(2, dtype=bool), (None, None))
        self.goals, self.asked = goals, []

    def residuals_at(self, points):
        self.asked.append(len(points))
        a, b = self.unknowns.at(points).T
        every = np.array([10.0 * (b - a * a), 1.0 - a]).T
        return every[:, :0] if self.goals else every

    def jacobian(self, x):
        a = self.unknowns.at(self.point(x))[0]
        return 4.0 * np.array([[-20.0 * a, 10.0], [-1.0, 0.0]])[: 0 if self.goals else 2]

    def goals_at(self, points):
        at = self.unknowns.at(points)
        return np.array([((at - p) ** 2).sum(axis=1) for p in ((0.0, 0.0), (1.0, 0.0))]).T[
            :, : 2 * self.goals
        ]

    def constraints_at(self, points):
        return (self.unknowns.at(points)[:, :1] - 0.5)[:, : int(self.goals)]


@pytest.mark.parametrize("optimise", [least_squares, minimize])
def test_scipy_with_derivatives_finds_the_bottom(optimise):
    found = optimise(Valley(), np.array([0.2, 0.7]))
    assert found.values == {"a": pytest.approx(1.0, abs=1e-3), "b": pytest.approx(1.0, abs=2e-3)}
    assert found.cost < 1e-6 and 0 < found.slopes <= found.evaluations < 60


def test_differential_evolution_asks_for_whole_generations():
    valley = Valley()
    found = differential_evolution(valley, popsize=10, maxiter=80, rng=np.random.default_rng(3))
    assert found.x == pytest.approx([0.75, 0.75], abs=0.01) and found.slopes == 0
    assert set(valley.asked) == {20} and found.evaluations == sum(valley.asked)


def test_cma_es_finds_the_bottom_and_stays_in_its_bounds():
    found = cma_es(Valley(), np.array([0.2, 0.7]), seed=2, most=3000)
    assert found.x == pytest.approx([0.75, 0.75], abs=1e-4) and found.cost < 1e-8
    assert found.evaluations <= 3020 and found.message


def test_pymoo_finds_the_front_of_two_goals_under_a_constraint():
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.optimize import minimize as search

    problem = pymoo_problem(Valley(goals=True))
    assert (problem.n_var, problem.n_obj, problem.n_ieq_constr) == (2, 2, 1)
    found = search(problem, NSGA2(pop_size=40), ("n_gen", 60), seed=1)
    a, b = Valley().unknowns.at(found.X).T
    assert np.abs(b).max() < 0.05 and a.min() > -0.05 and a.max() <= 0.5 and a.max() > 0.45
    assert pymoo_problem(Valley()).n_obj == 1


@pytest.mark.parametrize(("name", "use"), [("cma", cma_es), ("pymoo.core.problem", pymoo_problem)])
def test_without_the_extra_a_sentence_says_what_to_install(monkeypatch, name, use):
    monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(InputError, match=r"pip install 'tarsus\[optimise\]'"):
        use(Valley())
