"""What a file accepts, the functions accept: names of devices, paths of files, texts with units."""

import numpy as np
import pytest

import tarsus as ts


def test_a_device_may_be_named_and_a_time_have_a_unit():
    named = ts.simulate("cantilever", "5 ms")
    meant = ts.simulate(ts.load_scene("cantilever"), 0.005)
    assert named.duration == 0.005 and np.array_equal(named.events, meant.events) and len(named.events) > 1


def test_a_scene_file_may_be_named(tmp_path):
    ts.write_scene(ts.load_scene("cantilever"), tmp_path / "mine.toml")
    assert len(ts.simulate(tmp_path / "mine.toml", "2 ms").events) == len(
        ts.simulate("cantilever", 0.002).events
    )


def test_varied_values_may_have_units():
    batch = ts.simulate_batch("cantilever", {"robot.feet.tip.gap": ["70 um", "0.08 mm"]}, "2 ms")
    assert batch.vary["robot.feet.tip.gap"].tolist() == [7e-5, 8e-5]
    session = ts.Session("cantilever").batch({"robot.feet.tip.gap": ["70 um", "0.08 mm"]}, "2 ms")
    assert [len(run.events) for run in (session.run(0), session.run(1))] == [
        len(run.events) for run in (batch.run(0), batch.run(1))
    ]


def test_what_is_wrong_is_a_sentence():
    with pytest.raises(ts.InputError, match="duration: expected a time"):
        ts.simulate("cantilever", "5 mm")
    with pytest.raises(ts.InputError, match="did you mean 'cantilever'"):
        ts.simulate("cantilver")
    with pytest.raises(ts.InputError, match=r"robot\.feet\.tip\.gap: expected a length"):
        ts.simulate_batch("cantilever", {"robot.feet.tip.gap": ["70 V"]})
    with pytest.raises(ts.InputError, match=r"robot\.feet\.tp\.gap: unknown path; did you mean"):
        ts.simulate_batch("cantilever", {"robot.feet.tp.gap": ["70 um"]})
    with pytest.raises(AttributeError, match="did you mean 'Session'"):
        ts.Sesion  # noqa: B018
