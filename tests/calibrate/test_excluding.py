"""A row left out is predicted by a search that has not seen it, and as well as by somebody else's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import differential_evolution

from calibrate.toys import bent_rows, search
from tarsus.calibrate.calibrating import solve
from tarsus.calibrate.ensemble import exclude, missed_by, searched_ensembles
from tarsus.calibrate.objective import SoftLimit
from tarsus.calibrate.problem import Archive

PLAN = search(population=10, prescreening=48, short=8, generations=24, spread=5, members=24, local_search=0)
"""As the packaged study of the cantilever searches."""


class Watched:
    """Archives that remember which rows were asked for, and which sets, by the number of their search."""

    def __init__(self):
        self.rows, self.sets = {}, {}

    def archive(self, problem, number):
        rows, sets = self.rows.setdefault(number, []), self.sets.setdefault(number, set())

        def simulate(run, points, chosen):
            rows.append(tuple(chosen))
            if len(chosen) > 1:
                sets.update(one.tobytes() for one in points)
            return problem.simulate(run, points, chosen)

        return Archive(replace(problem, simulate=simulate), part=number)

    @property
    def shared(self):
        """Numbers of searches that asked for a set of another one."""
        return {a for a, own in self.sets.items() for b, other in self.sets.items() if a != b and own & other}


def test_the_search_without_a_row_asks_for_nothing_of_it():
    problem, seen = bent_rows(1, rows=3)[0], Watched()
    plan = search(generations=4, spread=2, local_search=0)
    searched_ensembles(seen.archive(problem, 0), plan)
    found = [exclude(problem, plan, row, seen.archive) for row in problem.rows]
    assert seen.shared == set() and len(found) == 3
    for row in problem.rows:
        asked = seen.rows[row + 1]
        assert {one for one in asked if len(one) > 1} == {tuple(n for n in problem.rows if n != row)}
        assert asked[-1] == (row,) and asked.count((row,)) == 1, "the row is simulated once all is found"
        assert found[row].fit.sets == len(seen.sets[row + 1]) and found[row].readings[0].shape[1:] == (3, 1)


def test_without_a_row_nothing_of_it_is_left_in_the_problem():
    problem = bent_rows(1)[0]
    limits = (SoftLimit("there", (0,), 0, 0.0, 1.0, 0.1),)
    whole = replace(problem, rows=(*problem.rows, 12), objective=replace(problem.objective, limits=limits))
    other = whole.without(1)
    assert other.rows == (0, *range(2, 13)) and other.trained == 11
    assert np.array_equal(other.objective.cells.observed, np.delete(problem.objective.cells.observed, 1, axis=0))
    assert other.objective.limits == limits
    points = np.random.default_rng(0).random((5, 9))
    one, less = problem.hypotheses[0], problem.without(1)
    costs = problem.objective.pieces(problem.simulate(0, points, problem.rows), one)
    found = (less.objective.pieces(less.simulate(0, points, less.rows), one).roots ** 2).sum(axis=1)
    assert found == pytest.approx(np.delete(costs.rows, 1, axis=1).sum(axis=1))


def refit(model, observed, row, seed):
    """The table's row predicted by the set that differential evolution of scipy finds for the other rows: the cost of
    docs/calibration.md, written anew."""
    others = np.delete(np.arange(len(observed)), row)

    def cost(x):
        z = np.log(model(x.T)[:, others] / observed[others]) / 0.1
        return (9.0 * np.log1p(z**2 / 9.0)).sum(axis=(1, 2))

    found = differential_evolution(
        cost,
        [(0.0, 1.0)] * 9,
        rng=seed,
        vectorized=True,
        updating="deferred",
        popsize=5,
        maxiter=160,
        tol=1e-6,
        polish=False,
    )
    return model(found.x[None])[0, row], float(found.fun)


def test_a_row_left_out_is_missed_by_as_much_as_in_a_refit_by_scipy():
    """Two rows of one toy: as low a cost, and the same error within the scatter of its cells."""
    problem, model = bent_rows(3)
    observed, plan, rows = problem.objective.cells.observed, PLAN.model_copy(update={"seed": 3}), (0, 1)
    ours = [exclude(problem, plan, row, lambda of, number: Archive(of, part=number)) for row in rows]
    theirs = [refit(model, observed, row, [3, row]) for row in rows]
    for mine, (_, cost) in zip(ours, theirs, strict=True):
        assert mine.fit.best.best < cost + 2.0, "the search is not the worse one"
    medians = np.array([[cell.median for cell in one.predictions(problem)] for one in ours])
    errors = [np.abs(found / observed[list(rows)] - 1.0) for found in (medians, np.array([one for one, _ in theirs]))]
    off = (errors[0] - errors[1]).ravel()
    assert abs(off.mean()) < 2.0 * off.std() / np.sqrt(len(off)) + 0.02


def test_the_interval_of_a_row_left_out_is_made_without_its_own_miss():
    plan = search(leave_out=True, generations=3, spread=2)
    problem = bent_rows(2, rows=5)[0]
    found = solve(problem, plan)
    refits = list(found.refits or ())
    for row in range(5):
        others = [one.missed for one in refits if one.row != row]
        told = missed_by(problem, refits, row)
        changed = [replace(one, missed=one.missed * 100.0) if one.row == row else one for one in refits]
        assert len(others) == 4 and np.array_equal(told.sigma, missed_by(problem, changed, row).sigma)
        assert (missed_by(problem, changed).sigma > told.sigma).any()


def test_the_sets_to_come_are_told():
    """Once the whole table has been searched the rows left out are as much work each; each is predicted."""
    told, problem = [], bent_rows(4, rows=4)[0]
    found = solve(problem, search(leave_out=True, spread=3), progress=lambda *now: told.append(now))
    assert [[one.measure for one in row] for row in found.excluded or ()] == [["y0", "y1", "y2"]] * 4
    assert (found.discrepancy.sigma == missed_by(problem, list(found.refits or ())).sigma).all()
    done, total, stages = zip(*told, strict=True)
    assert list(done) == sorted(done) and all(a <= b for a, b in zip(done, total, strict=True))
    left_out = stages.index("each row excluded")
    assert 0.9 < total[left_out] / done[-1] < 1.1 and 1.0 <= total[0] / done[-1] < 2.0
