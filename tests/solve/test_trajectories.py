"""Runs that go on: in parts they are what they are in one, and each goes as far as it is asked to."""

import numpy as np
import pytest

import tarsus as ts
from scene_files import scene as scene_of
from tarsus.base.events import EventKind
from tarsus.design.stance import standing
from turning_scenes import turning_walk

PARTS = np.array([3.0625, 7.9375, 12.0625])
"""Ends of parts in drive periods, none at an edge of a drive."""


def _millipede():
    scene = standing(ts.load_scene("millipede"))
    lifted = scene.initial.displacement[1] + np.linspace(0.0, 5e-6, 4)
    return scene, {"initial.displacement.1": lifted}, 1.0 / 102.0


def _cantilever():
    return ts.load_scene("cantilever"), {"signals.pzt.phase": np.linspace(0.0, 5.0, 4)}, 0.02


def _turning():
    """Between the parts feet of it stick, slide and fly, each some of the time."""
    scene = turning_walk(7)
    return scene, {"ground.friction.coefficient": np.array([0.1, 0.2, 0.3, 0.4])}, 1e-3


def _table():
    return scene_of("vibrating_table"), {"robot.feet.ball.gap": np.linspace(0.0, 0.5, 4)}, 1.0


@pytest.mark.parametrize("of", [_millipede, _cantilever, _table, _turning])
def test_runs_in_parts_have_the_events_of_whole_ones(of):
    scene, vary, period = of()
    whole = ts.simulate_batch(scene, vary, PARTS[-1] * period)
    runs = ts.Session(scene).trajectories(vary, 20.0 * period)
    parts = [runs.advance([np.array([end * period])] * 4) for end in PARTS]
    for i in range(4):
        events = np.concatenate([part[i].events for part in parts])
        expected = whole.events(i)
        assert len(expected) > 15
        assert events["kind"].tolist() == expected["kind"].tolist()
        assert np.abs(events["time"] - expected["time"]).max() < 1e-8 * period


def test_a_part_may_end_while_bounces_accumulate():
    """Rest is told of where the last bounces would end, which may be beyond the end of the part that has them."""
    scene = ts.load_scene("ball-on-table", hz=100, volts=0.5)
    whole = ts.simulate(scene, 0.2)
    rest = next(e for e in whole.events if e["kind"] == EventKind.REST)
    before = whole.events["time"][whole.events["time"] < rest["time"]][-1]
    ends = before + np.linspace(0.05, 0.999, 20) * (rest["time"] - before)
    runs = ts.Session(scene).trajectories({"robot.feet.ball.gap": np.zeros(len(ends))}, 0.2)
    first = runs.advance([np.array([end]) for end in ends])
    beyond = [float(part.events["time"][-1]) > end for part, end in zip(first, ends, strict=True)]
    assert any(beyond) and not all(beyond)
    then = runs.advance([np.array([0.2])] * len(ends))
    for part, more in zip(first, then, strict=True):
        events = np.concatenate([part.events, more.events])
        assert events["kind"].tolist() == whole.events["kind"].tolist()
        assert np.abs(events["time"] - whole.events["time"]).max() < 1e-12


def test_each_run_goes_as_far_as_it_is_asked_to():
    scene, vary, period = _cantilever()
    runs = ts.Session(scene).trajectories(vary, 20.0 * period)
    runs.advance([np.array([k + 1.0]) * period for k in range(4)])
    assert np.allclose(runs.time, period * np.arange(1.0, 5.0), rtol=1e-15)
    before = runs.state.copy()
    window, other = runs.advance([np.array([5.5, 6.0]) * period] * 2, np.array([2, 0]))
    assert window.states.x.shape == (2, 2) and len(other.events)
    assert np.allclose(runs.time, np.array([6.0, 2.0, 6.0, 4.0]) * period, rtol=1e-15)
    assert (runs.state[[1, 3]] == before[[1, 3]]).all() and (runs.state[[0, 2]] != before[[0, 2]]).any()
    phase = vary["signals.pzt.phase"][2]
    alone = ts.simulate(ts.with_values(scene, {"signals.pzt.phase": phase}), 6.0 * period)
    there = alone.states([6.0 * period]).x[:, 0]
    assert np.allclose(there, runs.state[2, :2], rtol=0.0, atol=1e-7 * np.abs(there).max())


def test_all_events_of_a_batch_are_those_of_its_runs():
    scene, vary, period = _cantilever()
    batch = ts.simulate_batch(scene, vary, 3.0 * period)
    events, first = batch.all_events()
    assert first[0] == 0 and first[-1] == len(events) > 20
    for i in range(4):
        assert (events[first[i] : first[i + 1]] == batch.events(i)).all()
