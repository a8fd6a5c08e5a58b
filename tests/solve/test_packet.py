"""A packet runs without Python as `simulate` does: the same events to the last bit, and the same samples."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from random_scenes import scene_of as random_scene
from random_scenes import sliding_scene
from tarsus.core import _native
from tarsus.plan.lowering import lower_scene
from tarsus.solve.packet import packed, packet_arrays, packet_of
from tarsus.solve.run import Shared, prepared

DEVICES = (
    "cantilever",
    "cantilever-capture",
    "climber",
    "hexapod",
    "mems-switch",
    "millipede",
    "millipede-30",
    "quadruped",
)


def devices():
    return {name: (ts.load_scene(name), 0.02) for name in DEVICES}


def drawn(make, seeds):
    """Random scenes, those with more contact modes than a packet holds left out."""
    scenes = {f"{make.__name__} {seed}": make(seed) for seed in seeds}
    few = {name: one for name, one in scenes.items() if lower_scene(one).legs is not None or len(one.robot.feet) <= 5}
    assert len(few) > len(scenes) // 2
    return {name: (one, min(one.duration, 0.05)) for name, one in few.items()}


CASES = {**devices(), **drawn(random_scene, range(40)), **drawn(sliding_scene, range(20))}


@pytest.mark.parametrize("case", CASES)
def test_a_packet_runs_as_simulate_does(case):
    scene, seconds = CASES[case]
    run, times = ts.simulate(scene, seconds), np.linspace(0.0, seconds, 40)
    code, finish, events, samples, marks, refused = _native.Packaged(packet_of(scene, seconds)).run(times)
    assert code == run.motion.log.codes[0] and not len(refused)
    np.testing.assert_array_equal(finish, run.motion.log.finish[0])
    np.testing.assert_array_equal(events, run.motion.log.events)
    assert len(samples) == len(times)
    states, legs = run.states(times), lower_scene(scene).legs
    if legs is None:
        np.testing.assert_array_equal(samples[:, : 2 * len(states.x)].T, np.vstack([states.x, states.v]))
    else:
        np.testing.assert_array_equal(marks, run.motion.log.marks.ravel())
        body = len(legs.body.body_mass)
        np.testing.assert_array_equal(samples[:, :body].T, states.x[:body])


def test_a_packet_that_cannot_start_says_why():
    scene = ts.with_values(ts.load_scene("millipede"), {"ground.adhesion.initial": 0.0})
    engine, rows = prepared(scene, {}, 0.02, Shared())
    arrays = packet_arrays(scene, engine, rows, None) | {
        "rows.sources": rows.sources[0] * [*[1.0] * engine.plan.feet, -1.0, 1.0]
    }
    *_, refused = _native.Packaged(packed(arrays)).run(np.zeros(0))
    assert {_native.FAULTS[int(fault)] for fault in refused[:, 1]} == {"pulled down"} and (refused[:, 3] > 0.0).all()


def test_a_damaged_packet_is_refused():
    whole = packet_of(ts.load_scene("cantilever"), 0.01)
    for given, said in {
        b"": "this is no packet of a plan",
        whole[:-8]: "a packet of a plan is damaged",
        whole.replace(b"nodes.TAU\0", b"nodes.TOU\0"): "the packet has no nodes.TAU",
        whole.replace(b"mode.1.mobility\0", b"mode.1.mobilitz\0"): "the packet has no mode.1.mobility",
    }.items():
        with pytest.raises(ValueError, match=said):
            _native.Packaged(given).run(np.zeros(0))
