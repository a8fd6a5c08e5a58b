"""A row left out is predicted by a search that has not seen it, and as well as by somebody else's."""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import differential_evolution

from calibrate.toys import bent_rows, search
from tarsus.calibrate.calibrating import solve
from tarsus.calibrate.ensemble import searched_ensembles
from tarsus.calibrate.excluding import exclude, exclude_each, missed_by
from tarsus.calibrate.objective import SoftLimit
from tarsus.calibrate.problem import Archive

PLAN = search(population=10, prescreening=48, short=8, generations=24, spread=5, members=24, local_search=0)
"""As the packaged study of the cantilever searches."""


class Watched:
    """Archives that remember which rows were asked for, and which sets, by the number of their search."""

    def __init__(self, share=False):
        self.rows, self.sets, self.share = {}, {}, share

    def archive(self, problem, number):
        rows, sets = self.rows.setdefault(number, []), self.sets.setdefault(number, set())

        def simulate(run, points, chosen):
            rows.append(tuple(chosen))
            if len(chosen) > 1:
                sets.update(one.tobytes() for one in points)
            return problem.simulate(run, points, chosen)

        made = Archive(replace(problem, simulate=simulate), part=number)
        if self.share and number:
            made.evaluate(0, np.array([np.frombuffer(one) for one in sorted(self.sets[0])]))
        return made

    @property
    def shared(self):
        """Numbers of searches that asked for a set of another one."""
        return {a for a, own in self.sets.items() for b, other in self.sets.items() if a != b and own & other}


def watched(share=False, rows=3, plan=PLAN):
    """The whole table's search, and those without each of a few rows."""
    problem, seen = bent_rows(1, rows=rows)[0], Watched(share)
    searched_ensembles(seen.archive(problem, 0), plan)
    found = exclude_each(problem, plan, seen.archive, threading.Event())
    return problem, seen, found


def test_the_search_without_a_row_asks_for_nothing_of_it():
    problem, seen, found = watched(plan=search(generations=4, spread=2, local_search=0))
    assert seen.shared == set() and len(found) == 3
    for row in problem.rows:
        asked = seen.rows[row + 1]
        assert {one for one in asked if len(one) > 1} == {tuple(n for n in problem.rows if n != row)}
        assert asked[-1] == (row,) and asked.count((row,)) == 1, "the row is simulated once all is found"
        assert found[row].fit.sets == len(seen.sets[row + 1]) and found[row].readings[0].shape[1:] == (3, 1)


def test_archives_that_are_shared_are_noticed():
    _, seen, _ = watched(share=True, plan=search(generations=2, spread=2))
    assert seen.shared == {0, 1, 2, 3}


def test_without_a_row_nothing_of_it_is_left_in_the_problem():
    problem = bent_rows(1)[0]
    limits = (SoftLimit("everywhere", (0, 1, 2, 12), 0, 0.0, 1.0, 0.1), SoftLimit("there", (1,), 0, 0.0, 1.0, 0.1))
    whole = replace(problem, rows=(*problem.rows, 12), objective=replace(problem.objective, limits=limits))
    other = whole.without(1)
    assert other.rows == (0, *range(2, 13)) and other.trained == 11
    assert np.array_equal(other.objective.cells.observed, np.delete(problem.objective.cells.observed, 1, axis=0))
    assert [(one.name, one.rows) for one in other.objective.limits] == [("everywhere", (0, 1, 11))]
    points = np.random.default_rng(0).random((5, 9))
    one, less = problem.hypotheses[0], problem.without(1)
    costs = problem.objective.pieces(problem.simulate(0, points, problem.rows), one).costs
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


def errors(seed, archive=None, rows=range(12)):
    """Errors (rows, 3) of a toy's rows left out, by the library and by scipy, and both costs (rows,)."""
    problem, model = bent_rows(seed)
    observed = problem.objective.cells.observed
    plan = PLAN.model_copy(update={"seed": seed})
    make = archive(problem, plan) if archive else lambda of, number: Archive(of, part=number)
    ours = [exclude(problem, plan, row, make) for row in rows]
    theirs = [refit(model, observed, row, [seed, row]) for row in rows]
    medians = np.array([[cell.median for cell in one.predictions(problem)] for one in ours])
    chosen = observed[list(rows)]
    return (
        np.abs(medians / chosen - 1.0),
        np.abs(np.array([one for one, _ in theirs]) / chosen - 1.0),
        np.array([one.fit.best.best for one in ours]),
        np.array([cost for _, cost in theirs]),
    )


def test_a_row_left_out_is_missed_by_as_much_as_in_a_refit_by_scipy():
    """Two rows of one toy: as low a cost, and the same error within the scatter of its cells."""
    ours, theirs, cost, other = errors(3, rows=range(2))
    assert (cost < other + 2.0).all(), "the search is not the worse one"
    off = (ours - theirs).ravel()
    assert abs(off.mean()) < 2.0 * off.std() / np.sqrt(len(off)) + 0.02


@pytest.mark.slow
def test_published_errors_of_rows_left_out_are_those_of_refits_and_less_where_the_archive_is_shared():
    """Twelve toys; sharing what the search of the whole table has visited is what was wrong once."""

    def sharing(problem, plan):
        whole = Archive(problem)
        searched_ensembles(whole, plan)

        def make(of, number):
            made = Archive(of, part=number)
            made.evaluate(0, whole.visited(0)[0], "shared")
            return made

        return make

    seeds = range(12)
    honest, scipys, cost, other = (np.array(one) for one in zip(*(errors(n) for n in seeds), strict=True))
    shared = np.array([errors(n, sharing)[0] for n in seeds])
    by_toy = {name: one.mean(axis=(1, 2)) for name, one in (("honest", honest), ("scipy", scipys), ("shared", shared))}
    print({name: f"{one.mean():.4f}" for name, one in by_toy.items()}, cost.mean(), other.mean())

    def pull(a, b):
        off = by_toy[a] - by_toy[b]
        return off.mean() / (off.std(ddof=1) / np.sqrt(len(off)))

    assert abs(pull("honest", "scipy")) < 2.5
    assert pull("shared", "honest") < -2.0


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


def test_the_sets_to_come_are_told_as_many_as_they_are():
    """Once the whole table has been searched the rows left out are as much work each; before that, at most 2 times."""
    told = []
    plan = search(leave_out=True, generations=8, spread=3, local_search=0)
    solve(bent_rows(4, rows=4)[0], plan, progress=lambda *now: told.append(now))
    done, total, stages = zip(*told, strict=True)
    assert list(done) == sorted(done) and done[-1] == total[-1]
    assert all(a <= b for a, b in zip(done, total, strict=True))
    left_out = stages.index("each row excluded")
    assert 0.9 < total[left_out] / total[-1] < 1.1 and 0.5 < total[0] / total[-1] < 2.0
