"""Windows tied end to start, and ground that differs from foot to foot: against simulations without either."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.quantities import Quantity
from tarsus.base.spec import get_value, with_values
from tarsus.fit.record_problem import RecordProblem, Seen, SeenRecord, Segment
from tarsus.fit.record_ties import TAIL, TiedWindows, _key
from tarsus.fit.unknowns import Prior
from tarsus.plan.lowering import lower_scene
from tarsus.solve.contacts import Contacts
from tarsus.solve.outputs import Output

FRICTION, BOUNCE = "ground.friction.coefficient", "ground.restitution.coefficient"
BODY = tuple(Output(kind, at) for kind in (Quantity.DISPLACEMENT, Quantity.VELOCITY) for at in ("body_x", "body"))
NOISE = (1e-7, 1e-7, 5e-5, 5e-5)
EDGES = (6e-3, 17.7e-3, 28.1e-3)


def walk(*, feet: bool = False) -> tuple[RecordProblem, list[Segment]]:
    """Two windows of a walk between contacts, without noise."""
    scene = ts.load_scene("millipede", hz=50, volts=14)
    run, times = ts.simulate(scene, EDGES[-1]), np.arange(1, 563) / 20e3
    times = times[times < EDGES[-1]]
    channels = tuple(Seen(one, noise) for one, noise in zip(BODY, NOISE, strict=True))
    record = SeenRecord(channels, times, run.outputs(list(BODY), times))
    priors = {path: Prior(float(get_value(scene, path)), factor=1.05) for path in (FRICTION, BOUNCE)}
    if feet:
        priors |= {f"under {foot}: {FRICTION}": Prior(1.0, factor=1.1) for foot in ("L1", "R1")}
    segments, spread = [], np.repeat([1e-6, 1e-3], 6)
    for begin, end in pairwise(EDGES):
        at = run.states(np.array([begin]))
        assert not at.held.any()
        state = np.concatenate([at.x[:, 0], at.v[:, 0]])
        segments.append(Segment(0, begin, (begin, end), state, spread, Contacts()))
    return RecordProblem((scene,), (record,), priors), segments


def test_tied_windows_leave_what_one_window_leaves() -> None:
    problem, segments = walk()
    tied = TiedWindows(problem, np.repeat([1e-9, 1e-6], 6))
    # from the states of one run the ends meet, and nothing is left but what tolerances and cuts leave
    assert tied.placed(segments, np.zeros((2, 12)), np.zeros(2)).cost < 1e-2
    # a start that is off by its standard deviation is off the end before by that over the tie
    off = np.zeros((2, 12))
    off[1, 0] = 0.01
    gaps = tied.placed(segments, off, np.zeros(2)).gaps
    assert gaps[1, 0] == pytest.approx(0.01 * 1e-6 / 1e-9, rel=1e-2) and not gaps[0].any()


@pytest.mark.parametrize("feet", [False, True])
def test_slopes_of_tied_windows_are_those_of_their_costs(feet: bool) -> None:
    problem, segments = walk(feet=feet)
    tied = TiedWindows(problem, np.repeat([1e-7, 1e-4], 6))
    rng, count = np.random.default_rng(0), len(problem.priors)
    problem.records[0].values[3, ::20] += 50.0 * NOISE[3]  # in the tail
    own, moved = 0.02 * rng.standard_normal((2, 12)), 0.02 * rng.standard_normal(count)
    system, step = tied.equations(segments, tied.placed(segments, own, moved)), 1e-5
    right = np.concatenate([system.right_own.ravel(), system.right_shared])
    for k in range(24 + count):
        by = np.eye(24 + count)[k] * step
        up, down = (
            tied.placed(segments, own + s * by[:24].reshape(2, 12), moved + s * by[24:]).cost for s in (1.0, -1.0)
        )
        assert (down - up) / (4.0 * step) == pytest.approx(right[k], rel=1e-4, abs=1e-5 * np.abs(right).max())


def test_what_is_far_off_costs_the_logarithm_of_its_size_and_moves_no_number() -> None:
    problem, segments = walk()
    ties = np.repeat([2e-8, 2e-5], 6)
    tied, moved = TiedWindows(problem, ties), np.array([0.5, -0.5])
    before = tied.placed(segments, np.zeros((2, 12)), np.zeros(2)).cost
    problem.records[0].values[3, 200] += 80.0 * NOISE[3]  # a sample on the wrong side of an impact
    after = tied.placed(segments, np.zeros((2, 12)), np.zeros(2)).cost
    assert after - before == pytest.approx(TAIL**2 * (1.0 + 2.0 * np.log(80.0 / TAIL)), rel=1e-3)
    fit = tied.solve(segments, moved)
    assert np.abs(fit.moved / np.sqrt(np.diag(fit.covariance))).max() < 0.01  # squares: 0.07


def test_numbers_come_back_and_are_known_better_when_windows_are_tied() -> None:
    problem, segments = walk()
    moved = np.array([0.5, -0.5])
    free, tied = (
        TiedWindows(problem, np.repeat(ties, 6)).solve(segments, moved) for ties in ([1e-6, 1e-3], [2e-8, 2e-5])
    )
    assert free.settled and tied.settled
    for fit in (free, tied):
        off = fit.moved / np.sqrt(np.diag(fit.covariance))
        assert np.abs(off).max() < 0.3  # there is no noise; what is known beforehand draws by as much
    # friction is; restitution is as it was beforehand, but for slopes that are of where a descent began
    assert np.all(np.diag(tied.covariance) < np.diag(free.covariance) * np.array([0.95, 1.005]))


@pytest.mark.parametrize("odd", [0, 1])
def test_a_step_that_gained_nothing_renews_the_window_that_misled_it(odd: int) -> None:
    problem, segments = walk()
    tied = TiedWindows(problem, np.repeat([2e-8, 2e-5], 6))
    at = tied.placed(segments, np.zeros((2, 12)), np.array([0.02, 0.02]))
    tied.equations(segments, at)
    own = 0.01 * (np.arange(2) == odd)[:, None] * np.ones(12)
    here, new = (tied.placed(segments, start, np.array([0.021, 0.021])) for start in (0.0 * own, own))
    key = _key(segments[odd])
    tied._kept[key] = tied._kept[key]._replace(by=3.0 * tied._kept[key].by)
    assert tied._misled(segments, here, new) == [odd] and tied._misled(segments, here, None) == [0, 1]
    assert tied._misled(segments, at, new) == []  # all are of that place: a shorter step is what helps


def test_slopes_are_those_of_windows_with_other_priors_and_fewer_numbers() -> None:
    problem, segments = walk()
    ties, feet = np.repeat([2e-8, 2e-5], 6), walk(feet=True)[0].priors
    few = TiedWindows(problem, ties)
    few.equations(segments, few.placed(segments, np.zeros((2, 12)), np.array([0.5, 0.0])))
    wide = {name: Prior(one.median, factor=1.3) for name, one in problem.priors.items()}
    other = replace(problem, priors=wide | {name: feet[name] for name in feet if name not in wide})
    moved = np.append(np.log(1.05) / np.log(1.3) * np.array([0.5, 0.0]), [0.0, 0.0])
    found, fresh = (
        one.equations(segments, one.placed(segments, np.zeros((2, 12)), moved))
        for one in (TiedWindows(other, ties, few), TiedWindows(other, ties))
    )
    for name in ("own", "onward", "across", "shared"):
        expected = getattr(fresh, name)
        assert getattr(found, name) == pytest.approx(expected, rel=1e-3, abs=1e-4 * np.abs(expected).max())


def test_windows_and_ties_together_pull_as_all_and_to_nothing() -> None:
    problem, segments = walk()
    rng = np.random.default_rng(2)
    problem.records[0].values[:] += np.array(NOISE)[:, None] * rng.standard_normal(problem.records[0].values.shape)
    tied = TiedWindows(problem, np.repeat([2e-8, 2e-5], 6))
    fit = tied.solve(segments, np.zeros(2), exact=True)
    pulls = tied.pulls(fit)
    assert pulls.window.tolist() == [0, 1, 1] and pulls.tied.tolist() == [False, False, True]
    whole = np.linalg.inv(pulls.information.sum(axis=0) + np.eye(2))
    assert whole == pytest.approx(fit.covariance, rel=0.02)  # its first window's start is known anew where it was found
    left = whole @ (pulls.score.sum(axis=0) - fit.moved)
    assert np.abs(left / np.sqrt(np.diag(whole))).max() < 0.1
    assert np.all(np.linalg.eigvalsh(pulls.information) > -1e-9 * np.trace(pulls.information.sum(axis=0)))


def test_feet_that_are_all_alike_are_the_ground_and_one_that_is_not_is_its_own() -> None:
    problem, segments = walk(feet=True)
    scene = problem.scenes[0]
    more = 1.2
    alike = np.array(
        [0.0, 0.0, *[problem.priors[f"under {foot}: {FRICTION}"].offsets(np.array(more)) for foot in ("L1", "R1")]]
    )
    changed = replace(
        problem, scenes=(with_values(scene, {FRICTION: more * float(get_value(scene, FRICTION))}),), priors={}
    )
    zeros = np.zeros((2, 12))
    by_feet = problem.flown(segments, zeros, alike).outputs
    by_ground = changed.flown(segments, zeros, np.zeros(0)).outputs
    np.testing.assert_allclose(by_feet, by_ground, rtol=1e-12, atol=1e-18)
    assert np.abs(by_feet - problem.flown(segments, zeros, np.zeros(4)).outputs).max() > 1e-6
    # the first window is a landing of the one foot, the second of the other
    plan = lower_scene(scene)
    landed = [np.unique(one.events["foot"]) for one in problem.flown(segments, zeros, np.zeros(4)).batch]
    assert [one.tolist() for one in landed] == [[1], [0]] and plan.feet == 2
    one = problem.flown(segments, zeros, alike * np.array([1.0, 1.0, 1.0, 0.0]))
    first = one.batch.first[1]
    np.testing.assert_allclose(one.outputs[:, :first], problem.flown(segments, zeros, np.zeros(4)).outputs[:, :first])
    np.testing.assert_allclose(one.outputs[:, first:], by_ground[:, first:], rtol=1e-12, atol=1e-18)
