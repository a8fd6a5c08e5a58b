"""The examples two_legged_millipede.py, thirty_legs.py, hexapod_tripod.py and millipede_ground.py."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from example_files import load


def test_two_legged_millipede_py_steps_cost_the_same_and_fast_ones_take_it_farther():
    example = load("two_legged_millipede")
    run = example.walk(50.0)
    slow, fast = run.measures, example.walk(400.0).measures
    assert example.stride_by_hand(run) == pytest.approx(slow.stride.value, rel=0.03)
    assert slow.stride.value == pytest.approx(1.1886e-6, rel=1e-3)
    drives = ts.load_scene("millipede-table").robot.drives.values()
    energy = sum(drive.capacitance for drive in drives) * 14.0**2
    assert slow.electrical_energy.value == pytest.approx(energy)
    assert fast.electrical_energy.value == pytest.approx(energy)
    assert fast.mean_speed.value > 20.0 * slow.mean_speed.value
    assert fast.body_lengths_per_second.value == pytest.approx(fast.mean_speed.value / 10e-3)


def test_thirty_legs_py_dead_legs_draw_nothing_and_tilt_the_body():
    example = load("thirty_legs")
    alike, faulty = example.walk(duration=0.06), example.walk(scatter=0.1, dead=example.DEAD, duration=0.06)
    assert alike.ok and faulty.ok and faulty.ledger.closure < 1e-8
    each = alike.scene.robot.drives["L1"].capacitance * 14.0**2
    assert alike.measures.electrical_energy.value == pytest.approx(30 * each)
    assert faulty.measures.electrical_energy.value == pytest.approx(27 * each)
    assert alike.measures.stride.value == pytest.approx(1.1193e-6, rel=2e-3)
    assert faulty.measures.stride.value == pytest.approx(1.38e-6, rel=0.02)
    roll = [abs(run.marks["body"][-1, 2]) for run in (alike, faulty)]
    assert roll[1] > 5.0 * roll[0]


def test_hexapod_tripod_py_a_hold_at_once_helps_and_one_that_grows_keeps_the_feet():
    example = load("hexapod_tripod")
    batch = example.on_grounds(np.array([0.0, 10e-6, 20e-6, 0.0]), np.array([0.0, 0.0, 0.0, 3e-3]))
    stride, contact = batch.measure("stride"), batch.measure("duty_factor")
    assert stride[0] == pytest.approx(1.2734e-6, rel=1e-3)
    assert stride[1] > 10.0 * stride[0] and stride[2] > 10.0 * stride[0]
    assert 0.5 < contact[1] < 0.9 and contact[2] == pytest.approx(1.0)
    assert abs(stride[3]) < 1e-10 and contact[3] == pytest.approx(1.0)


def test_millipede_ground_py_stands_still_where_it_should_by_hand():
    example = load("millipede_ground")
    scene = ts.load_scene("millipede-table")
    assert example.critical_rate(scene) == pytest.approx(example.expected_rate(scene), rel=0.02)
    found = example.strides(np.array([1e-5, 1e-2]), np.array([1e-19, 1e-17, 1e-15]))
    assert found[0] == pytest.approx([1.1542e-6, 3.1945e-6, 29.651e-6], rel=1e-3)
    assert np.abs(found[1]).max() < 1e-10
