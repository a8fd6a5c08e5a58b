"""A record is counted by the rule that counts events."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from laboratory import LABORATORY
from tarsus.identify.heldout import contacts_of

PERIOD = 0.02


@pytest.fixture(scope="module")
def run() -> ts.Run:
    return ts.simulate(ts.load_scene(LABORATORY, hz=50, volts=8), 5 * PERIOD)


@pytest.mark.parametrize(("rate", "noise_x", "noise_v"), [(1e6, 1e-10, 1e-6), (200e3, 5e-9, 1e-4)])
def test_a_sampled_record_is_counted_as_the_events_of_its_run(run, rate, noise_x, noise_v):
    time = np.arange(round(run.duration * rate)) / rate
    states = run.states(time)
    noise = np.random.default_rng(1).normal(size=(2, len(time)))
    height, speed = states.gap[0] + noise_x * noise[0], states.rate[0] + noise_v * noise[1]
    found = contacts_of(time, height, speed, PERIOD, noise_x, noise_v)
    measures = run.measures
    assert found.periods == measures.bounces.n == 3
    assert found.counting.height == measures.bounces.height and found.counting.dwell == measures.bounces.dwell
    assert found.bounces == measures.bounces.value
    assert measures.bounces.value > measures.rebounds.value, (
        "a hop after a capture of 40 to 70 us is seen by both"
    )
    assert found.contact == pytest.approx(measures.contact_duration.value, rel=3e-3)
    assert found.peak == pytest.approx(measures.peak.value, rel=1e-3)


def made(*pieces: tuple[float, float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time, height and speed at 1 us of pieces (length [s], height of a parabola [m], 0 on the ground)."""
    height, speed = [], []
    for length, apex in pieces:
        count = round(length * 1e6)
        s = (np.arange(count) + 0.5) / count
        height.append(4 * apex * s * (1 - s))
        speed.append(4 * apex * (1 - 2 * s) / length)
    return np.arange(sum(map(len, height))) * 1e-6, np.concatenate(height), np.concatenate(speed)


@pytest.mark.parametrize(("stay", "count"), [(50e-6, 1), (0.4e-3, 1), (0.6e-3, 0)])
def test_a_hop_of_a_record_after_a_capture(stay, count):
    record = made((4e-3, 20e-6), (stay, 0.0), (1e-3, 5e-6), (PERIOD - 5e-3 - stay, 0.0))
    found = contacts_of(*record, PERIOD, 1e-9, 1e-6)
    assert found.bounces == count
    assert found.contact == pytest.approx(PERIOD - 5e-3, abs=3e-6)
    assert found.peak == pytest.approx(20e-6, rel=1e-4)


def test_a_record_of_a_foot_that_stands_or_never_lands():
    held = contacts_of(*made((PERIOD, 0.0)), PERIOD, 1e-9, 1e-6)
    assert held.bounces == held.peak == 0.0 and held.contact == pytest.approx(PERIOD)
    away = contacts_of(*made((PERIOD, 20e-6)), PERIOD, 1e-9, 1e-6)
    assert away.bounces == 0.0 and away.contact < 5e-6 and away.peak == pytest.approx(20e-6)
    with pytest.raises(ts.InputError, match="shorter than the drive's period"):
        contacts_of(*made((0.9 * PERIOD, 0.0)), PERIOD, 1e-9, 1e-6)
