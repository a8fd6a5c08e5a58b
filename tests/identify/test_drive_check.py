"""The recorded drive against the stated one: size, zero, delay and pace come out, and noise alone moves none of it."""

from __future__ import annotations

import numpy as np
import pytest

from tarsus.identify.drive_check import cut_short, drive_faults, fit_drive, stated_length
from tarsus.model.drive.waveforms import Constant, Poling, RampedSquare, Sampled, Sine, Square, SweptSine, Waveform

RATE = 20e3
REST = 0.01
WAVES = {
    "bounces": (Square(amplitude=4.0, frequency=300.0), 0.2, RATE),
    "square from 0": (Square(amplitude=5.0, frequency=40.0, offset=5.0), 0.3, RATE),
    "slow square": (Square(amplitude=8.0, frequency=5.0), 0.6, RATE),
    "sine": (Sine(amplitude=6.0, frequency=15.0), 0.4, RATE),
    "sine from 0": (Sine(amplitude=3.0, frequency=60.0, offset=3.0), 0.12, RATE),
    "ramps": (RampedSquare(amplitude=8.0, frequency=5.0, duty=0.25), 0.6, RATE),
    "triangle": (RampedSquare(amplitude=8.0, frequency=100.0, duty=1.0), 0.1, RATE),
    "loop": (Sampled(times=(0.0, 0.3, 0.9, 1.4, 1.6), levels=(0.0, 8.0, -8.0, 6.0, 0.0)), 1.8, 1e3),
    "up": (SweptSine(amplitude=0.2, start_frequency=200.0, stop_frequency=7e3, duration=0.5), 0.6, RATE),
    "down": (SweptSine(amplitude=0.2, start_frequency=7e3, stop_frequency=200.0, duration=0.5), 0.6, RATE),
}


def recorded(
    wave: str, gain: float = 1.0, offset: float = 0.0, late: float = 0.0, pace: float = 1.0, noise: float = 0.0
) -> tuple[np.ndarray, float]:
    """Volts that a recorder sees in whole steps of 20 V / 2^16, and its sampling step; late in samples, offset in
    amplitudes, noise in root mean squares."""
    signal, seconds, rate = WAVES[wave]
    step = 1.0 / rate
    time = pace * step * np.arange(round((seconds + REST) * rate / pace)) - REST - late * step
    volts = np.where(time + 1e-9 < 0.0, 0.0, signal.volts(np.maximum(time + 1e-9, 0.0)))
    size = 0.5 * float(np.ptp(volts))
    volts = gain * volts + offset * size + noise * float(np.std(volts)) * _NORMAL[: len(volts)]
    return np.round(volts * 2**16 / 20.0) * 20.0 / 2**16, step


_NORMAL = np.random.default_rng(5).standard_normal(40000)


def faults(wave: str, **changes: float) -> list[str]:
    volts, step = recorded(wave, **changes)
    fit = fit_drive(volts, step, REST, WAVES[wave][0])
    assert fit is not None
    return drive_faults(fit, step, len(volts) * step, REST, False)


ALL_AT_ONCE = {"gain": 0.5, "late": 7.0}
ONE_BY_ONE = [{"gain": 1.2}, {"gain": -1.0}, {"offset": 0.05}, {"late": 10.0}, {"late": -4.0}, {"pace": 1.003}]
STAY = ("bounces", "sine")
"""A square and a smooth wave that are tried with every change alone; every wave with all changes at once."""
SWEPT = ("up", "down")
"""Sweeps, of which a rate three in a thousand off leaves nothing alike: they are refused, and the rate is asked for."""


@pytest.mark.parametrize(
    ("wave", "changes"),
    [*((wave, ALL_AT_ONCE) for wave in WAVES), *((wave, one) for wave in STAY for one in ONE_BY_ONE)],
    ids=str,
)
def test_what_is_wrong_is_measured(wave, changes):
    true = {"gain": 1.0, "offset": 0.0, "late": 0.0, "pace": 1.0} | changes
    volts, step = recorded(wave, **changes)
    fit = fit_drive(volts, step, REST, WAVES[wave][0])
    assert fit is not None
    assert fit.gain == pytest.approx(true["gain"], abs=2e-3)
    assert fit.offset / fit.amplitude == pytest.approx(true["offset"], abs=2e-3)
    assert fit.late / step == pytest.approx(true["late"], abs=0.05 if fit.smooth else 1.5)
    assert fit.pace == pytest.approx(true["pace"], rel=2e-5 if fit.smooth else 4e-4)
    assert len(drive_faults(fit, step, len(volts) * step, REST, False)) == len(changes)


@pytest.mark.parametrize("wave", WAVES)
@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"noise": 0.03},
        {"noise": 0.1},
        {"gain": 1.02, "offset": 0.01, "late": 1.0},
        {"pace": 1.0003},
        {"pace": 0.9997, "noise": 0.03},
    ],
    ids=str,
)
def test_a_drive_as_it_was_meant_is_not_refused(wave, changes):
    assert faults(wave, **changes) == []


@pytest.mark.parametrize(
    ("wave", "pace"),
    [*((wave, pace) for wave in WAVES for pace in (None, 1.25, 0.5)), *((wave, 1.003) for wave in SWEPT)],
)
def test_another_drive_is_refused(wave, pace):
    """Noise, or the one that was meant at a rate that is far off."""
    signal, _, rate = WAVES[wave]
    noise = np.convolve(_NORMAL, np.ones(40), "valid")[:3000]
    volts = noise if pace is None else recorded(wave, pace=pace)[0]
    fit = fit_drive(volts, 1.0 / rate, REST, signal)
    assert fit is not None
    told = drive_faults(fit, 1.0 / rate, len(volts) / rate, REST, False)
    assert any(f"sampling rate of {rate:.6g} Hz right" in one for one in told)
    assert pace is not None or (len(told) == 1 and "not the one that the campaign states" in told[0])


def test_the_size_of_a_sweep_does_not_matter():
    volts, step = recorded("up", gain=1.2)
    fit = fit_drive(volts, step, REST, WAVES["up"][0])
    assert fit is not None and not drive_faults(fit, step, len(volts) * step, REST, True)


def test_a_drive_that_was_meant_to_be_nothing_is_not_compared():
    assert fit_drive(np.ones(100), 1e-3, 0.01, Sine(amplitude=0.0, frequency=5.0)) is None


@pytest.mark.parametrize(
    ("signal", "seconds"),
    [
        (Square(amplitude=1.0, frequency=4.0), 0.25),
        (WAVES["loop"][0], 1.6),
        (WAVES["up"][0], 0.5),
        (Poling(level=10.0, hold=1.0, fall=0.5), 1.5),
        (Constant(level=1.0), 0.0),
    ],
)
def test_a_record_may_end_when_the_drive_has_done_all_it_does(signal: Waveform, seconds: float):
    assert stated_length(signal) == pytest.approx(seconds)
    assert cut_short(seconds + REST, REST, 1e-3, signal) is None
    if seconds:
        assert "is the file cut short?" in str(cut_short(0.9 * seconds + REST, REST, 1e-3, signal))
        assert "the record lasts 1 s, and the rest before the drive" in str(cut_short(1.0, 2.0, 1e-3, signal))


@pytest.mark.parametrize("wave", ["sine", "triangle", "loop", "up", "down"])
def test_a_smooth_drive_that_is_the_stated_one_is_freed_of_its_rounding(wave):
    """Off by a thousandth of its size and delay, it is found to a tenth of a digit, root mean square."""
    volts, step = recorded(wave, gain=1.001, late=0.1)
    fit = fit_drive(volts, step, REST, WAVES[wave][0])
    assert fit is not None
    time = step * np.arange(len(volts)) - REST - 0.1 * step + 1e-9
    true = np.where(time < 0.0, 0.0, 1.001 * WAVES[wave][0].volts(np.maximum(time, 0.0)))
    digit = 20.0 / 2**16
    left = [float(np.sqrt(np.mean((one - true) ** 2))) for one in (fit.unrounded(volts), volts)]
    assert left[0] < 0.1 * digit < 0.2 * digit < left[1]


@pytest.mark.parametrize(
    ("wave", "noise"),
    [("bounces", 0.0), ("square from 0", 0.0), ("slow square", 0.0), ("sine from 0", 0.0), ("sine", 1e-3)],
)
def test_a_drive_that_jumps_or_has_noise_stays_as_recorded(wave, noise):
    volts, step = recorded(wave, gain=1.001, noise=noise)
    fit = fit_drive(volts, step, REST, WAVES[wave][0])
    assert fit is not None
    assert np.array_equal(fit.unrounded(volts), volts)
