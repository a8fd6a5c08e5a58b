"""A record taken up as far as it is predicted: where it is cut, and what becomes of one that is lost."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.base.quantities import Quantity
from tarsus.base.spec import get_value, with_values
from tarsus.fit.record_ties import TiedWindows
from tarsus.fit.verdict import Verdict
from tarsus.identify import walking
from tarsus.identify.walking import WalkRecord, identify_walk
from tarsus.solve.outputs import Output

PATHS = ("ground.restitution.coefficient", "ground.friction.coefficient", "ground.adhesion.initial")
BODY = tuple(Output(kind, at) for kind in (Quantity.DISPLACEMENT, Quantity.VELOCITY) for at in ("body_x", "body"))


def record(seconds: float) -> tuple[ts.Scene, WalkRecord]:
    """A robot, and how its body moves, taken for that of one on another ground."""
    truth = ts.load_scene("millipede", hz=50, volts=14)
    times = np.arange(1, round(20e3 * seconds) + 1) / 20e3
    noise = np.array([1e-7, 1e-7, 5e-5, 5e-5])
    values = ts.simulate(truth, seconds).outputs(list(BODY), times)
    values += noise[:, None] * np.random.default_rng(0).standard_normal(values.shape)
    known = with_values(truth, dict(zip(PATHS, (0.5, 0.3, 5e-7), strict=True)))
    return truth, WalkRecord(known, times, BODY, values, noise)


def test_the_first_contacts_tell_the_ground() -> None:
    truth, seen = record(0.03)
    found = identify_walk([seen], dict.fromkeys(PATHS, 1.0))
    assert found.followed == 1.0 and found.settled
    assert len(found.edges[0]) > 2 and found.edges[0][0] == 0.0 and found.edges[0][-1] == seen.times[-1]
    events = np.unique(ts.simulate(truth, 0.03).events["time"])
    inner = found.edges[0][1:-1]
    assert np.abs(inner[:, None] - events).min() > 1e-4  # no window begins near an event
    error = np.log(found.values / [float(get_value(truth, path)) for path in PATHS])
    assert np.abs(error / np.sqrt(np.diag(found.covariance))).max() < 3.5
    assert np.sqrt(found.covariance[1, 1]) < 0.1  # told by the first steps


@pytest.mark.parametrize("confirmed", [False, True])
def test_feet_are_told_apart_only_where_another_start_asks_for_it_too(
    monkeypatch: pytest.MonkeyPatch, confirmed: bool
) -> None:
    """A wrong minimum asks for feet that differ; so the record is taken up again, from numbers that are drawn."""
    _, seen = record(0.008)
    friction, drawn, taken_up = PATHS[1], list[int](), walking._taken_up

    def asked(windows, fit, paths):
        return dict.fromkeys(paths, 2.0) if confirmed or not drawn else {}

    def again(problem, records, moved, seed=0):
        drawn.extend([seed] if seed else [])
        return taken_up(problem, records, moved, seed)

    monkeypatch.setattr(walking, "asked_of_feet", asked)
    monkeypatch.setattr(walking, "_taken_up", again)
    found = identify_walk([seen], dict.fromkeys(PATHS, 1.0), differing=[friction])
    assert drawn == [1] and dict(found.asked) == ({friction: 2.0} if confirmed else {})
    assert set(found.feet) == ({f"{foot}: {friction}" for foot in ("L1", "R1")} if confirmed else set())


def test_a_window_with_one_sample_far_off_is_not_followed() -> None:
    """By eight of its noise, which its mean square hardly shows: an impact at another moment leaves no more."""
    _, seen = record(0.012)
    seen.values[3, 120] += 8.0 * seen.noise[3]
    found = identify_walk([seen], dict.fromkeys(PATHS, 1.0))
    assert np.nanmean(found.residuals[0] ** 2) < 1.2 and not found.good.all()
    assert {found.verdict(path) for path in PATHS} <= {Verdict.PREFERRED, Verdict.UNDECIDED, Verdict.ASSUMED}


def test_of_two_starts_that_are_followed_the_one_that_leaves_less_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    _, seen = record(0.008)
    costs, together = list[float](), walking._together

    def worse(windows, segments, moved):  # the first
        joint = together(windows, segments, moved)
        costs.append(joint.fit.cost)
        return joint if costs[1:] else joint._replace(fit=replace(joint.fit, cost=joint.fit.cost + 100.0, values={}))

    monkeypatch.setattr(walking, "_together", worse)
    monkeypatch.setattr(walking, "asked_of_feet", lambda *_: {} if costs[1:] else {PATHS[1]: 2.0})
    found = identify_walk([seen], dict.fromkeys(PATHS, 1.0), differing=[PATHS[1]])
    assert len(costs) == 2 and len(found.values) == 3  # of the first there is none


@pytest.mark.slow
def test_of_a_record_that_no_ground_explains_no_number_is_determined() -> None:
    _, seen = record(0.05)
    values = seen.values.copy()
    values[:, 500:] = values[:, 499::-1]  # backwards in time from 25 ms on
    found = identify_walk([replace(seen, values=values)], dict.fromkeys(PATHS, 1.0))
    assert found.edges[0][-1] < 0.03 and found.followed < 0.7
    assert not any(found.verdict(path) is Verdict.DETERMINED for path in PATHS)


@pytest.mark.full
def test_numbers_that_no_robot_takes_are_lost_and_others_are_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    _, seen = record(0.008)
    refused, solve = [], TiedWindows.solve

    def some(self, segments, moved, **options):
        if len(refused) < 7:  # all that a beginning is tried from, and some that go on from others
            refused.append(moved)
            raise InputError("ground.restitution.coefficient: expected a pure number from 0 to 1")
        return solve(self, segments, moved, **options)

    monkeypatch.setattr(TiedWindows, "solve", some)
    found = identify_walk([seen], dict.fromkeys(PATHS, 1.0))
    assert len(refused) == 7 and not np.array_equal(refused[0], refused[-1])
    assert found.followed == 1.0
