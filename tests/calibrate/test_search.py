"""The search: recovers unknowns and options, keeps open what data do not decide, resumes to the same bytes."""

from __future__ import annotations

import re

import numpy as np
import pytest

from calibrate.toys import cells, problem, search, unknowns
from tarsus.calibrate.calibrating import solve
from tarsus.calibrate.objective import Hypothesis, SoftLimit
from tarsus.files.runstore import RunStore
from tarsus.fit import Prior, Range, Verdict
from tarsus.fit.chain import mixing
from tarsus.fit.ensemble import drawn_evenly

X = np.array([1.0, 2.0, 3.0, 4.0])


def straight(run: int, one: np.ndarray) -> np.ndarray:
    """a + b x in run 0, a + b x^2 in run 1."""
    return (one[0] + one[1] * X ** (1 + run))[:, None, None]


TWO = (Hypothesis({"power": "one"}, 0, (0,)), Hypothesis({"power": "two"}, 1, (0,)))
TRUTH = (0.3, 0.6)


def ranges(found) -> tuple[Range, ...]:
    """What the first ensemble says of the unknowns."""
    return found.fit.ensembles[0].ranges(found.problem.unknowns)


def of(run: int, **values) -> object:
    table = cells(straight(run, np.array(TRUTH))[:, :, 0])
    return problem(table, straight, unknowns("ab"), TWO, **values)


@pytest.mark.parametrize("run", [0, 1])
def test_the_unknowns_and_the_right_option_are_recovered(run):
    found = solve(of(run), search())
    assert [one.hypothesis.options["power"] for one in found.fit.ensembles] == [("one", "two")[run]]
    for one, true in zip(ranges(found), TRUTH, strict=True):
        assert one.value == pytest.approx(true, abs=0.01) and one.low <= true <= one.high
        assert one.verdict is Verdict.DETERMINED
    assert found.option_weights()["power"][("two", "one")[run]] == 0.0
    assert found.fit.found[1 - run].rejected and not found.fit.found[run].rejected


def test_the_ensemble_is_as_wide_as_the_likelihood():
    found = solve(of(0), search(spread=60, members=60, generations=20))
    design = np.column_stack([np.ones(4), X])
    spread = 0.01 * np.sqrt(np.linalg.inv(design.T @ design)[0, 0])
    ensemble = found.fit.ensembles[0]
    a = ensemble.points[:, 0]
    mean = ensemble.weights @ a
    assert np.sqrt(ensemble.weights @ (a - mean) ** 2) == pytest.approx(spread, rel=0.4)
    spread = np.cov(ensemble.points.T, aweights=ensemble.weights)
    assert spread[0, 1] / np.sqrt(spread[0, 0] * spread[1, 1]) == pytest.approx(-0.91, abs=0.1)


def test_the_interval_of_one_unknown_is_two_standard_errors_to_either_side():
    table = cells(straight(0, np.array(TRUTH))[:, :, 0])
    found = solve(
        problem(table, lambda run, one: straight(0, [one[0], TRUTH[1]]), unknowns("a")), search(spread=60, members=32)
    )
    (a,) = ranges(found)
    assert a.high - a.low == pytest.approx(2 * 1.96 * 0.01 / np.sqrt(4), rel=0.15)


def test_chains_that_have_not_mixed_determine_nothing():
    found = solve(of(0), search(spread=2))
    assert "the chains of the ensemble have not mixed" in found.fit.best.doubt and "(it had 2)" in found.fit.best.doubt
    asked = re.findall(r"Give it a spread of about (\d+) ", found.fit.best.doubt)
    assert not solve(of(0), search(spread=int(asked[0]))).fit.best.doubt
    assert mixing(np.array([[0.0], [2.0], [2.0], [4.0]]), 2) == pytest.approx(np.sqrt(1.5))  # variances 2 and 2, of two


def test_a_search_of_few_sets_determines_nothing():
    found = solve(of(0), search(generations=0, spread=0))
    assert "sets lie in the likelihood region, 20 make an interval" in found.fit.best.doubt


def test_options_that_the_data_do_not_decide_stay_open():
    table = cells(straight(0, np.array(TRUTH))[:, :, 0])
    same = problem(table, lambda run, one: straight(0, one), unknowns("ab"), TWO)
    weights = solve(same, search(generations=20)).option_weights()["power"]
    assert weights["one"] == pytest.approx(0.5, abs=0.1)


def test_a_choice_of_a_columns_meaning_needs_no_runs_of_its_own():
    asked = []

    def both(run: int, one: np.ndarray) -> np.ndarray:
        asked.append(run)
        first = straight(0, one)
        return np.concatenate([first, first**2], axis=1)

    table = cells(straight(0, np.array(TRUTH))[:, :, 0])
    two = (Hypothesis({"column": "itself"}, 0, (0,)), Hypothesis({"column": "squared"}, 0, (1,)))
    first = search(short=0, generations=0, spread=0, local_search=0)
    solve(problem(table, both, unknowns("ab"), two), first)
    assert len(asked) == first.prescreening and set(asked) == {0}
    found = solve(problem(table, both, unknowns("ab"), two), search())
    assert found.fit.best.hypothesis.options == {"column": "itself"}


def test_what_the_data_do_not_touch_is_not_determined_and_a_prior_is_told_apart():
    table = cells(straight(0, np.array(TRUTH))[:, :, 0])
    found = solve(problem(table, straight, unknowns("abc")), search(spread=40, members=40))
    assert [one.verdict for one in ranges(found)] == [Verdict.DETERMINED] * 2 + [Verdict.UNDECIDED]
    numbers = unknowns("abc", priors=(None, None, Prior(0.5, 0.05)))
    found = solve(problem(table, straight, numbers), search(spread=40, members=32))
    third = ranges(found)[2]
    assert third.verdict is Verdict.ASSUMED and third.high - third.low == pytest.approx(3.92 * 0.05, rel=0.5)


def test_a_constraint_is_data():
    def sloped(run: int, one: np.ndarray) -> np.ndarray:
        """Row 1 sees a + b alone; row 2, of a constraint, sees b."""
        return np.array([one[0] + one[1], one[1]])[:, None, None]

    table = cells([[0.9]])
    limit = (SoftLimit("b is small", (0,), 0, -np.inf, 0.2, 0.005),)
    free, held = (
        ranges(solve(problem(table, sloped, unknowns("ab"), limits=given, extra_rows=1), search(spread=30)))[1]
        for given in ((), limit)
    )
    assert free.high > 0.5 and held.high < 0.25


def test_a_hypothesis_far_behind_after_the_short_search_gets_no_more_sets():
    asked = [0, 0]

    def counted(run: int, one: np.ndarray) -> np.ndarray:
        asked[run] += 1
        return straight(0, one) if run == 0 else np.full((4, 1, 1), 50.0)

    table = cells(straight(0, np.array(TRUTH))[:, :, 0])
    plan = search()
    found = solve(problem(table, counted, unknowns("ab"), TWO), plan)
    assert "after the short search" in found.fit.found[1].rejected
    assert asked[1] <= plan.prescreening + plan.population * plan.short < asked[0]


class Killed(Exception):
    """A process that ends in the middle."""


def test_a_killed_search_goes_on_to_the_same_result(tmp_path):
    """In one of those without a row."""
    plan = search(leave_out=True, members=6, generations=3, spread=2, local_search=0)
    whole = solve(of(0), plan)
    each = [whole.fit.sets, *(one.fit.sets for one in whole.refits or ())]
    calls = 0

    def fragile(run: int, one: np.ndarray) -> np.ndarray:
        nonlocal calls
        calls += 1
        if calls == 100 + sum(each[:3]):
            raise Killed
        return straight(run, one)

    table = cells(straight(0, np.array(TRUTH))[:, :, 0])
    broken = problem(table, fragile, unknowns("ab"), TWO)
    with pytest.raises(Killed):
        solve(broken, plan, RunStore.open(tmp_path, {"x": "1"}))
    assert len(list((tmp_path / "units").glob("*/*.npz"))) > 3
    done, calls = calls, 10**6
    again = solve(broken, plan, RunStore.open(tmp_path, {"x": "1"}, resume=True))
    assert again.excluded == whole.excluded
    assert np.array_equal(again.fit.best.points, whole.fit.best.points) and again.sets == whole.sets
    members = 4 * 2 * plan.members  # of every refit's hypotheses, simulated once more in the row itself
    assert calls - 10**6 + done <= whole.sets + members + 2 * 20, "visited sets are not simulated again"
    third = calls
    solve(broken, plan, RunStore.open(tmp_path, {"x": "1"}, resume=True))
    assert calls == third, "a finished search simulates nothing"


def test_members_are_a_sample_and_not_its_edge():
    """Thinned so that each is far from the others, members lay on the edge of the cloud they stood for."""
    rng = np.random.default_rng(1)
    points = rng.normal(size=(4000, 5))
    cost = (points**2).sum(axis=1)
    share = np.where(points[:, 0] > 0.0, 3.0, 1.0)
    chosen = drawn_evenly(share, cost, 400)
    assert cost[chosen].mean() == pytest.approx(5.0, rel=0.03)
    assert np.quantile(cost[chosen], 0.9) == pytest.approx(np.quantile(cost, 0.9), rel=0.05)
    assert (points[chosen, 0] > 0.0).mean() == pytest.approx(0.75, abs=0.06)


def test_without_a_row_its_value_is_predicted_from_the_others():
    """The least-squares mean of the other two, by hand: 2.5, 2 and 1.5 for 1, 2 and 3."""
    table = cells([[1.0], [2.0], [3.0]], absolute=1e3)
    constant = problem(table, lambda run, one: np.full((3, 1, 1), one[0]), unknowns("a", 0.0, 4.0), robust=1e3)
    found = solve(constant, search(leave_out=True))
    best = [float(constant.unknowns.values(one.fit.best.points[0])[0]) for one in found.refits or ()]
    assert best == pytest.approx([2.5, 2.0, 1.5], abs=0.02)


def parabola(x):
    """Points (n,) of a parabola, which a line is fitted to, with a tolerance of 0.1."""
    return problem(
        cells(20.0 + x[:, None] ** 2, absolute=0.1),
        lambda run, one: (20.0 + one[0] + one[1] * x)[:, None, None],
        unknowns("ab", -9.0, 9.0),
        robust=1e3,
    )


def test_a_row_left_out_is_as_uncertain_as_the_other_rows_left_out_were_wrong():
    """A line through three of four points of a parabola misses those by 0.7 at most, and the fourth by 1.4 or 3.3."""
    found = solve(parabola(np.array([1.0, 2.0, 3.0, 4.0])), search(generations=10, leave_out=True))
    assert found.excluded is not None
    told = [one for (one,) in found.excluded]
    by_least_squares = [17.67, 25.43, 30.43, 32.67]  # which the logarithms of the comparison bend a little
    assert [one.median for one in told] == pytest.approx(by_least_squares, abs=0.8)
    assert all(3.0 < one.high - one.low < 16.0 for one in told), "the tolerance alone is 0.3 wide"


def test_what_one_of_three_rows_left_out_misses_is_not_taken_for_the_model():
    """Two points leave a line no misfit: what it misses the third by tells of the line, not of the model."""
    found = solve(parabola(np.array([1.0, 2.0, 3.0])), search(generations=5, leave_out=True))
    assert found.excluded is not None
    assert np.array_equal(found.discrepancy.sigma, found.fit.discrepancy.sigma)
    four = solve(parabola(np.array([1.0, 2.0, 3.0, 4.0])), search(generations=5, leave_out=True))
    assert not np.array_equal(four.discrepancy.sigma, four.fit.discrepancy.sigma)
