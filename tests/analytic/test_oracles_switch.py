"""Oracle 6: closing of a MEMS switch (published table)."""

from __future__ import annotations

import math

import numpy as np
import pytest

import tarsus as ts
from scene_files import scene

STIFFNESS, GAP = 42.0, 3.8e-6
MASS = STIFFNESS / (2.0 * math.pi * 21e3) ** 2
FORCE = 1.9e-11 * MASS  # eps A / 2


def test_numbers_of_the_scene():
    values = scene("mems_switch")
    assert pytest.approx(2.41241e-9, rel=1e-6) == MASS
    assert values.ground.electrostatic.coefficient == pytest.approx(FORCE, rel=1e-14)


@pytest.mark.parametrize(("volts", "time", "speed"), [(90.0, 27.795e-6, 0.23378), (80.0, 69.24e-6, 0.1394)])
def test_closing_time_and_speed(volts, time, speed):
    run = ts.simulate(scene("mems_switch", {"signals.gate.level": volts}))
    closing = run.events[0]
    assert run.ok
    assert closing["time"] == pytest.approx(time, rel=0.5e-9 / time if volts == 90.0 else 5e-9 / time)
    assert closing["speed_before"] == pytest.approx(speed, abs=0.6e-5 if volts == 90.0 else 0.6e-4)


def pull_in(ratio: float, low: float, high: float, duration: float) -> tuple[float, float]:
    """Voltage between which and which a step closes the switch."""
    still = scene("mems_switch", {"robot.structure.damping_ratios": [ratio]})
    for _ in range(4):
        levels = np.linspace(low, high, 17)
        batch = ts.simulate_batch(still, {"signals.gate.level": levels}, duration=duration, threads=1)
        closed = np.array([len(batch.events(i)) > 0 for i in range(len(levels))])
        assert np.all(np.diff(closed.astype(int)) >= 0) and closed[-1] and not closed[0]
        first = int(np.argmax(closed))
        low, high = levels[first - 1], levels[first]
    return low, high


def test_dynamic_pull_in():
    low, high = pull_in(0.02, 79.0, 81.0, 2e-3)
    assert high - low < 1e-3
    assert 0.5 * (low + high) == pytest.approx(79.943, abs=5e-4)


def test_static_pull_in():
    """An overdamped switch creeps: a step closes it only above the static pull-in voltage."""
    low, high = pull_in(5.0, 86.0, 87.0, 2.0)
    exact = math.sqrt(8.0 * STIFFNESS * GAP**3 / (27.0 * 2.0 * FORCE))
    assert exact == pytest.approx(86.307, abs=5e-4)
    assert low - 1e-5 < exact < high + 1e-5


def test_a_switch_held_by_volts_opens_when_they_are_gone():
    signal = ts.OnOff(levels=(90.0, 60.0, 0.0), durations=(40e-6, 30e-6, 1.0))
    run = ts.simulate(scene("mems_switch", {"signals.gate": signal}), duration=150e-6)
    assert run.events["kind"].tolist()[:2] == [2, 3]
    assert run.events["time"][1] == pytest.approx(70e-6, rel=1e-12)
    assert run.ledger.closure < 1e-8
