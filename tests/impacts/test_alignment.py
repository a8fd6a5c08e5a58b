"""Alignment, gate and subtraction: on made signals, on the vibrometer's records, and on the shock records."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hexapod_records import measurement
from tarsus.impacts.alignment import align, delayed, residual_gate, subtract
from tarsus.records.readers import read_measurement

SHOCK = Path(__file__).parents[1] / "data" / "shock"
CHANNELS = {"excitation_composite": "V", "accelerometer_base": "m/s^2"}
NAMES = tuple(CHANNELS)


def wave(shift: float, count: int = 1000) -> np.ndarray:
    """Three tones up to 0.3 of the sampling rate, ``shift`` samples late."""
    n = np.arange(count) - shift
    return np.sin(0.05 * n) + 0.7 * np.sin(0.61 * n + 1.0) + 0.4 * np.sin(1.7 * n + 2.0)


@pytest.mark.parametrize("shift", [0.37, -5.2, 41.0])
def test_delay_gain_and_zero_are_found(shift):
    random = np.random.default_rng(1)
    clean = np.array([wave(0.0), 0.6 * wave(300.0)])
    other = np.array([1.02 * wave(-shift) + 0.5, 0.6 * wave(300.0 - shift)])
    record = measurement(*(clean + 0.01 * random.standard_normal(clean.shape)))
    reference = measurement(*(other + 0.01 * random.standard_normal(clean.shape)))
    found = align(record, reference, ["a", "b"], before=1.0, search=60e-5)
    assert found.delay == pytest.approx(-shift * 1e-5, abs=0.01e-5)
    assert found.gain == pytest.approx([1.0 / 1.02, 1.0], abs=6e-3)
    assert found.offset == pytest.approx([-0.5, 0.0], abs=3e-3)
    assert found.noise[1] == pytest.approx(0.01 * np.sqrt(2.0), rel=0.1)
    left = subtract(record, reference, found)
    assert left["b"][100:-100].std() == pytest.approx(0.01 * np.sqrt(2.0), rel=0.1)
    assert left.channel("b").noise == found.noise[1]


def started(shift: float, grows: float, count: int = 6000, slow: float = 1.0) -> np.ndarray:
    """A periodic drive of 330 samples from rest, ``shift`` samples late: what it moves grows over so many samples."""
    late = np.maximum(np.arange(count) - shift, 0.0) / slow
    return (1.0 - np.exp(-late / grows)) * np.sin(2.0 * np.pi * late / 330.0) + 0.3 * np.exp(
        -late / (2.0 * grows)
    ) * np.sin(0.31 * late)


@pytest.mark.parametrize("grows", [300.0, 1000.0, 4000.0])
@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_a_false_period_of_the_drive_is_not_taken(grows, noise):
    """Three periods later the motion that has grown is alike, and where it is weak it does not count: -973 samples at
    2 % residual was taken for 17 at nothing."""
    random = np.random.default_rng(1)
    record, reference = (
        measurement(started(shift, grows) + noise * random.standard_normal(6000)) for shift in (200.0, 183.0)
    )
    found = align(record, reference, ["a"], before=1.0)
    assert found.delay / record.step == pytest.approx(-17.0, abs=0.03)
    assert found.other is None and not residual_gate(found)


def test_ripples_of_noise_about_the_delay_of_a_slow_motion_are_no_second_one():
    noise = 0.02 * np.random.default_rng(1).standard_normal((2, 12000))
    record, reference = (
        measurement(started(shift, 300.0, 12000, 40.0) + one) for shift, one in zip((200.0, 183.0), noise, strict=True)
    )
    found = align(record, reference, ["a"], before=1.0)
    assert found.delay / record.step == pytest.approx(-17.0, abs=1.5) and not residual_gate(found)


def test_a_second_delay_that_fits_as_well_is_refused_with_both():
    """A sine without a beginning: any period will do, the smallest delay is taken, and the gate says so."""
    n = np.arange(6000.0)
    noise = 0.01 * np.random.default_rng(0).standard_normal(6000)
    record, reference = (measurement(np.sin(2.0 * np.pi * (n + late) / 330.0) + noise) for late in (0.0, 17.0))
    found = align(record, reference, ["a"], before=1.0)
    assert found.delay / record.step == pytest.approx(-17.0, abs=0.1)
    verdict = residual_gate(found)
    assert len(verdict) == 1 and found.other is not None
    assert f"by {1e3 * found.other:.4g} ms as by {1e3 * found.delay:.4g} ms" in verdict[0]
    narrow = align(record, reference, ["a"], before=1.0, search=100e-5)
    assert narrow.other is None and not residual_gate(narrow)


def shock(which: str):
    hit, free = (
        read_measurement(SHOCK / f"shock_{kind}_{which}.lvm", channels=CHANNELS, axis="time")
        for kind in ("hit", "free")
    )
    return hit, free, align(hit, free, NAMES, before=3.7, search=0.03)


def test_the_good_shock_pair_aligns_to_a_fraction_of_a_sample():
    hit, free, found = shock("0.5")
    assert found.delay / hit.step == pytest.approx(-5.53, abs=0.02)
    assert found.gain == pytest.approx([1.0, 1.009], abs=2e-3)
    assert found.residual == pytest.approx([0.0021, 0.040], abs=1e-3)
    assert 0.02 < found.overall < 0.04
    assert not residual_gate(found)
    # whole samples leave five times as much of the command, no alignment 10 and 16 %
    before = int(3.7 / hit.step)
    for samples, left in ((6.0, [0.010, 0.040]), (0.0, [0.105, 0.161])):
        for name, share in zip(NAMES, left, strict=True):
            plain = (hit[name] - delayed(free[name], samples))[100 : before - 100]
            assert plain.std() / hit[name][100 : before - 100].std() == pytest.approx(share, abs=3e-3)


def test_the_bad_shock_pair_is_rejected_with_its_reasons():
    verdict = residual_gate(shock("0.7")[2])
    assert len(verdict) == 2
    assert "28.2% of the signal is left after subtraction, above the limit of 10%" in str(verdict)
    assert "the worst channel is 'accelerometer_base' with 39." in str(verdict)
    assert "channel 'accelerometer_base' has a gain of 1.39" in str(verdict)
    base = shock("0.7")
    alone = align(base[0], base[1], NAMES[1:], before=3.7, search=0.03)
    assert alone.overall == pytest.approx(0.38, abs=0.01)
