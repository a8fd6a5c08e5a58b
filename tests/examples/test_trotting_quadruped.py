"""The example trotting_quadruped.py and the device it walks."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from example_files import load


def test_the_robot_is_the_published_one():
    scene = ts.load_scene("hamr-like")
    walker = scene.robot.structure
    assert walker.total_mass == pytest.approx(1.27e-3, rel=1e-12)
    assert load("trotting_quadruped").MEASURED / walker.length == pytest.approx(10.1, rel=0.02)
    # the payload of 2.9 g beside a mass of half of it, on two legs, from the lift's share of 225 V
    gain = scene.robot.drives["LF_lift"].law.gain
    assert 2.0 * gain * 112.5 == pytest.approx(1.5 * 2.9e-3 * 9.80665, rel=0.01)
    rises = {name: wave.volts(np.array([0.005])).item() for name, wave in scene.waveforms.items()}
    assert {name for name, volts in rises.items() if name.endswith("lift") and volts > 0.0} == {"LF_lift", "RH_lift"}


def test_it_trots_at_the_published_order_of_speed():
    run = load("trotting_quadruped").trot()
    assert run.ok and run.ledger.closure < 1e-8
    speed = run.measures.mean_speed
    assert 0.5 * 0.44 < speed.value < 2.0 * 0.44
    assert speed.value == pytest.approx(0.476, abs=0.05)
    assert run.measures.body_lengths_per_second.value == pytest.approx(speed.value / 44e-3)
    assert abs(run.marks["body"][:, 3]).max() < 0.5  # pitch [rad]: it stays on its feet


def test_below_50_hz_the_bouncing_body_is_in_the_way():
    hz = np.array([10.0, 30.0, 40.0, 50.0, 60.0])
    slow = load("trotting_quadruped").speeds(hz, duration=0.5)
    assert np.all(np.abs(slow[:3]) < 0.3) and np.all(slow[3:] > 0.35)


@pytest.mark.full
def test_over_all_that_is_not_known_the_measured_speed_is_inside():
    found = load("trotting_quadruped").spread()
    assert found.min() < 0.44 < found.max() < 0.88
    assert np.median(found) == pytest.approx(0.44, abs=0.1)
