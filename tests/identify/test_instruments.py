"""Gains, delays, clocks and low-passes of channels, found from records alone and corrected."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tarsus.identify.clock import PACE, clocks_of
from tarsus.identify.delay import LowPass, delay_of
from tarsus.identify.instruments import Instruments, compared
from tarsus.identify.volts import jumps_of, moved
from tarsus.identify.with_error import WithError
from tarsus.model.drive.waveforms import SweptSine
from tarsus.modes.frf import Frf
from tarsus.modes.modal import ModalFit, identify_modes
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


COUNT = 24000
UP = SweptSine(amplitude=0.2, start_frequency=200.0, stop_frequency=9000.0, duration=1.0)
DOWN = SweptSine(amplitude=0.2, start_frequency=9000.0, stop_frequency=200.0, duration=1.0)


def sweep(signal: SweptSine, slow: float, seed: int, late: float = 0.0) -> Measurement:
    """A displacement that follows the volts, late [s], recorded in steps that are longer by a share, 40 dB."""
    time = STEP * np.arange(COUNT, dtype=np.float64)
    moved = 1e-6 * signal.volts(np.maximum(time * (1.0 + slow) - late, 0.0))
    moved += 1e-2 * moved.std() * np.random.default_rng(seed).standard_normal(COUNT)
    channels = Channel("x", Quantity.DISPLACEMENT, "tip"), Channel("u", Quantity.VOLTAGE)
    return Measurement(channels, np.array([moved, signal.volts(time)]), STEP, 0.0, f"sweep {seed}", "u")


@pytest.mark.parametrize("slow", [1e-4, -3e-5, 4e-6])
def test_the_clock_is_found_and_corrected(slow):
    sweeps = [(sweep(one, slow, k), one) for k, one in enumerate((UP, DOWN, UP))]
    found = clocks_of(sweeps).pace
    assert found is not None and found.value == pytest.approx(slow, abs=max(4.0 * found.error, 2.0 * slow**2))
    assert found.error < 0.05 * PACE
    instruments = Instruments(STEP, pace=found)
    assert "clock" in instruments.sentences()[0] and ("slow" if slow > 0.0 else "fast") in instruments.sentences()[0]
    taken = instruments.corrected(sweeps[0][0], True)
    assert taken.step == pytest.approx(STEP * (1.0 + slow), rel=1e-9)
    off = 1e-6 * taken["u"] - taken["x"]
    assert np.std(off[100:19000]) < 1.02e-2 * np.std(taken["x"][:20000]), "nothing is left but the noise"


def test_one_clock_is_left_alone():
    found = clocks_of([(sweep(one, 0.0, k), one) for k, one in enumerate((UP, DOWN))]).pace
    assert not Instruments(STEP, pace=found).differ
    assert clocks_of([(sweep(UP, 1e-4, k), UP) for k in (1, 2)]).pace.error == np.inf, (
        "all pass all frequencies at one time"
    )


@pytest.mark.parametrize("slow", [0.0, 5e-5])
def test_starts_that_are_late_by_more_or_less_are_found_beside_the_clock(slow):
    lates = [10e-6, -14e-6, 31e-6, 3e-6]
    sweeps = [(sweep(one, slow, k, lates[k]), one) for k, one in enumerate((UP, DOWN, UP, DOWN))]
    found = clocks_of(sweeps)
    assert found.pace.value == pytest.approx(slow, abs=1e-7)
    assert list(found.starts) == [f"sweep {k}" for k in range(4)]
    assert list(found.starts.values()) == pytest.approx(np.array(lates) - np.mean(lates), abs=0.1e-6)
    assert not clocks_of([(sweep(one, slow, k), one) for k, one in enumerate((UP, DOWN, UP))]).starts


def test_samples_that_were_lost_are_no_clock():
    """One of three sweeps lost a sample in its middle, the later ones having moved up."""
    sweeps = [(sweep(one, 0.0, k), one) for k, one in enumerate((UP, DOWN, UP))]
    record, signal = sweeps[1]
    moved = np.append(np.delete(record["x"], COUNT // 2), record["x"][-1])
    sweeps[1] = replace(record, values=np.array([moved, record["u"]])), signal
    found = clocks_of(sweeps)
    (said,) = Instruments(STEP, pace=found.pace, starts=found.starts, lost=found.lost).sentences()
    assert said.startswith("samples of the motion were lost in the sweeps")


def responses(late: float, low: LowPass | None) -> ModalFit:
    """Two real modes behind a delay and a low-pass, at 57 dB."""
    random, frequency = np.random.default_rng(3), np.arange(200.0, 9000.0, 8.0)
    s = 2.0j * np.pi * frequency
    omega, zeta = 2.0 * np.pi * np.array([623.0, 6424.0]), np.array([0.011, 0.072])
    modes = 1.0 / (s**2 + 2.0 * (zeta * omega)[:, None] * s + omega[:, None] ** 2)
    through = np.exp(-s * late) * (1.0 if low is None else low.response(s))
    values = through * (np.array([[1.0, 20.0], [0.4, -12.0]]) @ modes)
    noise = random.standard_normal((6, 2, 2, len(s)))
    size = 1.4e-3 * np.sqrt(np.mean(np.abs(values) ** 2, axis=1))[:, None]
    repeats = (values + size * (noise[:, 0] + 1.0j * noise[:, 1]))[:, :, None]
    frf = Frf(frequency, repeats.mean(axis=0), ("a", "b"), ("volts",), Quantity.DISPLACEMENT, repeats)
    return identify_modes(frf, (200.0, 9000.0), 12, between_fits=False)


@pytest.mark.parametrize("late", [0.0, 6e-6])
def test_delay_behind_the_drive(late: float) -> None:
    """From the residues of modes that are real."""
    seen = delay_of(responses(late, None))
    assert seen is not None and seen.low is None
    assert seen.time.value == pytest.approx(late, abs=0.05e-6)
    assert seen.off(STEP) == (late != 0.0)


def test_low_pass_is_told_from_a_delay() -> None:
    """Its kind, its corner to 0.5 %, and the delay of what is slow."""
    corner = 8000.0
    poles = np.exp(1.0j * np.pi * (2.0 * np.arange(4) + 5.0) / 8.0)
    low = LowPass("butter", poles, corner)
    assert low.delay == pytest.approx(2.6131 / (2.0 * np.pi * corner), rel=1e-4)
    seen = delay_of(responses(0.0, low))
    assert seen is not None and seen.low is not None
    assert seen.low.name == "butter low-pass of order 4"
    assert seen.low.corner == pytest.approx(corner, rel=5e-3)
    assert seen.time.value == pytest.approx(low.delay, abs=0.2e-6)


def test_delayed_volts() -> None:
    """A triangle keeps its corners, a square the jumps that a sample now lies within."""
    place = np.arange(200.0)
    triangle = 5.0 * np.abs((place / 40.0) % 2.0 - 1.0)
    shifted = 5.0 * np.abs(((place - 0.12) / 40.0) % 2.0 - 1.0)
    assert moved(triangle, 0.12)[5:-5] == pytest.approx(shifted[5:-5], abs=1e-3)
    square = np.where((place // 40) % 2 == 0, 5.0, -5.0)
    assert list(jumps_of(square)) == [39, 79, 119, 159]
    assert list(jumps_of(moved(square, 0.4))) == [39, 40, 79, 80, 119, 120, 159, 160]
