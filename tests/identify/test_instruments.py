"""Gains and delays of channels, found from records alone and corrected."""

from __future__ import annotations

import numpy as np
import pytest

from tarsus.identify.instruments import Instruments, compared
from tarsus.identify.with_error import WithError
from tarsus.records.measurement import Channel, Measurement, Quantity

STEP = 5e-5
POINTS = ("tip", "center")


def record(seed: int, lag: float = 0.0, gain: float = 1.0, noise: float = 1e-2) -> Measurement:
    """Two points in two decaying modes, the displacements so late [s], that of the tip times a gain."""
    random = np.random.default_rng(seed)
    time = STEP * np.arange(4000.0)
    channels, values = [], []
    for k, point in enumerate(POINTS):
        x, v = np.zeros(len(time)), np.zeros(len(time))
        for hertz, size in ((623.0, 1e-5), (6424.0, 1e-6 * (1.0 - 2.0 * k))):
            pole = 2.0 * np.pi * hertz * (-0.01 + 1.0j)
            phase = np.exp(2.0j * np.pi * random.random())
            x += (size * phase * np.exp(pole * (time - lag))).imag
            v += (size * phase * pole * np.exp(pole * time)).imag
        factor = gain if point == "tip" else 1.0
        for quantity, one in ((Quantity.DISPLACEMENT, factor * x), (Quantity.VELOCITY, v)):
            channels.append(Channel(f"{point} {quantity.name}", quantity, point))
            values.append(one + noise * one.std() * random.standard_normal(len(one)))
    return Measurement(tuple(channels), np.array(values), STEP)


@pytest.mark.parametrize("lag", [6e-6, 20e-6, -9e-6])
def test_a_delay_is_found_to_a_fifth_of_a_microsecond_and_corrected(lag):
    records = [record(seed, lag) for seed in range(6)]
    found = compared(records, POINTS)
    assert found.lags == pytest.approx(lag, abs=2e-7) and abs(found.lag.value - lag) < 3.0 * found.lag.error
    assert not found.wrong
    late, sound = record(7, lag, noise=0.0), record(7, 0.0, noise=0.0)
    off = found.corrected(late, False).values - sound.values
    scale = np.abs(late.values - sound.values).max(axis=1)
    assert np.all(np.abs(off[[0, 2], 20:-20]).max(axis=1) < 0.06 * scale[[0, 2]])
    assert "us after" in found.sentences()[0] if lag > 0.0 else "us before" in found.sentences()[0]


@pytest.mark.parametrize("lag", [6e-6, 20e-6])
def test_taking_off_adds_little_noise(lag):
    """A slow motion is brought back with as much noise as it had, also between two samples."""
    time, random = STEP * np.arange(4000.0), np.random.default_rng(1)
    omega, size, noise = 2.0 * np.pi * 40.0, 1e-5, 1e-7
    own = noise * random.standard_normal(len(time))
    channels = (Channel("x", Quantity.DISPLACEMENT, "tip"), Channel("v", Quantity.VELOCITY, "tip"))
    speed = size * omega * np.cos(omega * time)
    late = Measurement(channels, np.array([size * np.sin(omega * (time - lag)) + own, speed]), STEP)
    found = Instruments(STEP, {"tip": WithError(1.0, 1e-4)}, WithError(lag, 5e-8))
    left = found.corrected(late, False)["x"] - size * np.sin(omega * time)
    assert left[20:-20].std() < 1.03 * noise


def test_the_other_channel_may_have_the_gain():
    found = compared([record(seed, gain=-1.0) for seed in range(6)], POINTS)
    own, other = found.hypotheses()
    assert own.gain("tip", Quantity.DISPLACEMENT) == pytest.approx(-1.0, rel=1e-3)
    assert own.gain("tip", Quantity.VELOCITY) == other.gain("tip", Quantity.DISPLACEMENT) == 1.0
    assert other.gain("tip", Quantity.VELOCITY) == pytest.approx(-1.0, rel=1e-3)


def test_a_gain_is_found_and_divided_out():
    records = [record(seed, gain=1.03) for seed in range(6)]
    found = compared(records, POINTS)
    assert found.gain("tip", Quantity.DISPLACEMENT) == pytest.approx(1.03, rel=1e-3)
    assert found.gain("center", Quantity.DISPLACEMENT) == 1.0
    late, sound = record(7, gain=1.03, noise=0.0), record(7, noise=0.0)
    assert np.allclose(found.corrected(late, False).values[0], sound.values[0], rtol=1e-3)


def test_a_factor_that_all_points_have_is_an_error_of_all_gains():
    for second, shared in ((0.99, 0.01), (1.03, 0.0), (1.0, 0.0)):
        found = Instruments(STEP, {"tip": WithError(0.99, 1e-4), "center": WithError(second, 1e-4)})
        assert found.shared == pytest.approx(shared)
        assert any("no record shows which" in one for one in found.sentences()) is (shared > 0.0)


def test_sound_records_stay_as_they_are():
    records = [record(seed) for seed in range(6)]
    found = compared(records, POINTS)
    assert not found.differ and not found.sentences()
    assert found.corrected(records[0], False) is records[0]


def test_slow_records_that_modes_alias_in_tell_no_delay() -> None:
    """A staircase at 1 kHz whose corners set a mode of 623 Hz ringing, beside a sweep at 20 kHz without velocities."""
    time, pole = 1e-3 * np.arange(3000.0), 2.0 * np.pi * 623.0 * (-0.01 + 1.0j)
    x, v, speed = np.zeros(len(time)), np.zeros(len(time)), 0.0
    for begin, slope in ((0.0, 2e-4), (0.5, -2e-4), (1.5, 2e-4), (2.5, -1e-4)):
        past = np.maximum(time - begin, 0.0)
        ringing = (speed - slope) * np.where(past > 0.0, np.exp(pole * past), 0.0)
        x, v = (x + (slope - speed) * past + (ringing / pole).real, v + (slope - speed) * (past > 0.0) + ringing.real)
        speed = slope
    channels = (Channel("x", Quantity.DISPLACEMENT, "tip"), Channel("v", Quantity.VELOCITY, "tip"))
    random = np.random.default_rng(5)
    slow = Measurement(channels, np.array([x, v]) + 1e-10 * random.standard_normal((2, len(time))), 1e-3)
    sweep = Measurement(channels[:1], random.standard_normal((1, 500)), STEP)
    assert abs(compared([slow], POINTS).lag.value) > 2e-6  # what it would be taken for
    assert not compared([slow, sweep], POINTS).gains


def test_a_gain_is_corrected_with_an_error():
    late = Instruments(STEP, {"tip": WithError(1.03, 2e-4)}, WithError(20e-6, 5e-8))
    (gain,) = late.uncertain()
    assert gain.gain("tip", Quantity.DISPLACEMENT) == pytest.approx(1.0302) and gain.lags == 20e-6
    assert late.errors == (5e-8, 0.0)
    sound = Instruments(STEP, {"tip": WithError(1.001, 2e-4)}, WithError(0.0, 5e-8))
    assert not sound.uncertain() and sound.errors == (0.0, 0.0)


def test_numbers_are_drawn_along_with_what_was_corrected():
    from tarsus.identify.afterwards import _along
    from tarsus.identify.step import StepResult

    drawn = np.random.default_rng(1).standard_normal(400)
    paths, still = ("ground.film.thickness", "robot.drives.pzt.law.constant"), np.zeros((400, 2))
    own = StepResult("film", paths, np.array([2.0, -1.0]), np.array([2.0, -1.0]) + still)
    there = StepResult("film", paths, np.array([2.2, -1.3]), still)
    along = _along(own, there, drawn).samples
    assert np.allclose(along[:, 0], 2.0 * 1.1**drawn) and np.allclose(along[:, 1], -1.0 - 0.3 * drawn)
