"""Varied values with units, and what is said of names that are none."""

import pytest

import tarsus as ts


def test_varied_values_may_have_units():
    batch = ts.simulate_batch("cantilever", {"robot.feet.tip.gap": ["70 um", "0.08 mm"]}, "2 ms")
    assert batch.vary["robot.feet.tip.gap"].tolist() == [7e-5, 8e-5]
    session = ts.Session("cantilever").batch({"robot.feet.tip.gap": ["70 um", "0.08 mm"]}, "2 ms")
    assert [len(run.events) for run in (session.run(0), session.run(1))] == [
        len(run.events) for run in (batch.run(0), batch.run(1))
    ]


def test_what_is_wrong_is_a_sentence():
    with pytest.raises(ts.InputError, match=r"robot\.feet\.tip\.gap: expected a length"):
        ts.simulate_batch("cantilever", {"robot.feet.tip.gap": ["70 V"]})
    with pytest.raises(ts.InputError, match=r"robot\.feet\.tp\.gap: unknown path; did you mean"):
        ts.simulate_batch("cantilever", {"robot.feet.tp.gap": ["70 um"]})
    with pytest.raises(AttributeError, match="did you mean 'Session'"):
        ts.Sesion  # noqa: B018
