"""Measures of motion for constraints: at a search's accuracy, in contact as in the air."""

from __future__ import annotations

import math

import tarsus as ts
from laboratory import HEXAPOD
from scene_files import scene
from tarsus.calibrate.readings import motion_of


def test_a_bouncing_foot_has_oscillations_at_a_search_s_accuracy(monkeypatch):
    """A search does not ask for the energy account: a set whose account is open is none that failed."""
    monkeypatch.setattr("tarsus.solve.run.CLOSED", 0.0)  # rounding counts as open
    robot = ts.load_scene(HEXAPOD, wave="square")
    coarse = ts.Accuracy(gap=1e-4)
    assert not ts.simulate(robot, 0.1, coarse).ok
    found = motion_of(robot, "foot1", 0.05, 0.05, 1.0 / 85.0, coarse)
    assert 0.3 < found["oscillations_per_step"] < 5.0 and 1e-5 < found["swing"] < 1e-4


def test_a_ball_that_loses_nothing_comes_back_once_a_bounce():
    """From 1 m: ten bounces from half way up, in 20 steps of a drive of their period."""
    period = 2.0 * math.sqrt(2.0 / 9.81)
    ball = scene("ball", {"ground.restitution.coefficient": 1.0})
    found = motion_of(ball, "ball", 0.25 * period, 10.0 * period, period, ts.Accuracy())
    assert found["oscillations_per_step"] == 0.5 and abs(found["swing"] - 1.0) < 1e-3


def test_a_run_that_stops_early_has_none():
    robot = ts.load_scene(HEXAPOD, wave="square")
    found = motion_of(robot, "foot1", 0.05, 0.05, 1.0 / 85.0, ts.Accuracy(gap=1e-6, steps=50))
    assert all(math.isinf(value) for value in found.values())
