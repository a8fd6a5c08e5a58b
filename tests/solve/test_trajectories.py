"""Runs that go on: in parts they are what they are in one, and each goes as far as it is asked to."""

import numpy as np

import tarsus as ts
from scene_kinds import KINDS, over
from tarsus.base.events import EventKind
from tarsus.plan.slots import slots


def _cantilever():
    return ts.load_scene("cantilever"), {"signals.pzt.phase": np.linspace(0.0, 5.0, 4)}, 0.02


@over(modal=(0, 2, 3), legged=range(5), creeping=(0,), moving=(1, 4), sliding=(5,), turning=(0, 4, 5), uneven=range(5))
def test_runs_in_parts_have_the_events_of_whole_ones(kind, seed):
    """Robots that differ by up to a hundredth of a drive's gain: between parts feet stick, slide and fly."""
    scene = KINDS[kind](seed)
    path = next(path for path in slots(scene) if path.endswith(("gain", "linear")))
    vary = {path: float(ts.get_value(scene, path)) * (1.0 - np.linspace(0.0, 1e-2, 4))}
    whole = ts.simulate_batch(scene, vary)
    runs = ts.Session(scene).trajectories(vary, 1.2 * scene.duration)
    parts = [runs.advance([np.array([end * scene.duration])] * 4) for end in (0.31, 0.77, 1.0)]
    for i in range(4):
        events = np.concatenate([part[i].events for part in parts])
        expected = whole.events(i)
        assert len(expected) > 8
        assert events["kind"].tolist() == expected["kind"].tolist()
        assert np.abs(events["time"] - expected["time"]).max() < 1e-8 * scene.duration


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
