"""Measures of motion for constraints: at a search's accuracy, in contact as in the air."""

from __future__ import annotations

import math

import tarsus as ts
from laboratory import HEXAPOD
from tarsus.calibrate.readings import motion_of


def test_a_bouncing_foot_has_oscillations_at_a_search_s_accuracy(monkeypatch):
    """A search does not ask for the energy account: a set whose account is open is none that failed."""
    monkeypatch.setattr("tarsus.solve.run.CLOSED", 0.0)  # rounding counts as open
    scene = ts.load_scene(HEXAPOD, wave="square")
    coarse = ts.Accuracy(gap=1e-4)
    assert not ts.simulate(scene, 0.1, coarse).ok
    found = motion_of(scene, "foot1", 0.05, 0.05, 1.0 / 85.0, coarse)
    assert 0.3 < found["oscillations_per_step"] < 5.0 and 1e-5 < found["swing"] < 1e-4


def test_a_run_that_stops_early_has_none():
    scene = ts.load_scene(HEXAPOD, wave="square")
    found = motion_of(scene, "foot1", 0.05, 0.05, 1.0 / 85.0, ts.Accuracy(gap=1e-6, steps=50))
    assert all(math.isinf(value) for value in found.values())
