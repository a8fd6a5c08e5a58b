"""Displacements behind a high-pass: the corner is found from records alone, to what noise leaves, and put back."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import butter, lfilter

from tarsus.identify.coupling import high_pass_of, restored
from tarsus.records.measurement import Channel, Measurement, Quantity

STEP, REST, PERIOD, PERIODS = 5e-5, 0.01, 0.05, 4
NOISE = 1e-7, 3e-5
CHANNELS = Channel("x", Quantity.DISPLACEMENT, "tip"), Channel("v", Quantity.VELOCITY, "tip")


def record(seed: int, corner: float = 0.0, creep: float = 0.0) -> Measurement:
    """A point that goes to and fro at a place of its own, a share of it late by 0.3 s; displacements behind a filter of
    scipy's, whose noise it passes as well."""
    random = np.random.default_rng(seed)
    time = STEP * np.arange(round((REST + PERIODS * PERIOD) / STEP)) - REST
    omega, size = 2.0 * np.pi / PERIOD, random.uniform(1e-5, 4e-5)
    on = time >= 0.0
    x = np.where(on, size * (1.0 - np.cos(omega * time)), 0.0)
    v = np.where(on, size * omega * np.sin(omega * time), 0.0)
    late = np.where(on, creep * size * -np.expm1(-time / 0.3), 0.0)
    v = v + np.where(on, creep * size * np.exp(-time / 0.3) / 0.3, 0.0)
    x = x + late + NOISE[0] * random.standard_normal(len(x))
    if corner:
        above, below = butter(1, 2.0 * corner * STEP, "high")
        x = lfilter(above, below, x)
    return Measurement(CHANNELS, np.array([x, v + NOISE[1] * random.standard_normal(len(x))]), STEP)


def found(corner: float, creep: float = 0.0, period: float | None = PERIOD):
    records = [record(seed, corner, creep) for seed in range(12)]
    return high_pass_of(records, [REST] * 12, [period] * 12, ["tip"])


@pytest.mark.parametrize("corner", [0.1, 0.5])
def test_a_corner_is_found_within_its_error_and_taken_off(corner: float) -> None:
    told = found(corner)
    assert told is not None and told.error < 0.01 * corner
    assert abs(told.value - corner) < 3.0 * told.error
    behind, sound = record(99, corner), record(99)
    left = restored(behind, REST, corner).values - sound.values
    assert np.array_equal(left[1], np.zeros(len(left[1])))
    # the filter of scipy is the trapezoid's sum: what is left is the zero, which is that of 200 samples
    assert np.abs(left[0] - left[0, 0]).max() < 0.2 * NOISE[0]
    assert np.ptp(behind.values[0] - sound.values[0]) > 10.0 * NOISE[0]


def test_sound_displacements_and_a_drive_that_creeps_are_left_alone() -> None:
    assert found(0.0) is None
    assert found(0.0, creep=0.1) is None
    assert found(0.1, period=None) is None  # a drive without a period does not tell
    assert found(0.1, period=0.7 * STEP + PERIOD) is None
