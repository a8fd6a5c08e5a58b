"""What is read of a file, whatever its format: format by content, units, drive, clipping, notes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import wavfile

from tarsus.formats.axes import even
from tarsus.formats.declared import declared
from tarsus.formats.numerals import column_step
from tarsus.formats.packing import unpacked
from tarsus.formats.unit_names import frequency_factor, ratio_of, scaled, time_factor
from tarsus.records.clipping import clipped_samples, heaped_samples
from tarsus.records.measurement import Quantity
from tarsus.records.readers import read_measurement

N = np.arange(2000)


def table(tmp_path: Path, **columns: np.ndarray) -> Path:
    path = tmp_path / "record.csv"
    names = ["t [s]", *columns]
    rows = np.column_stack([1e-3 * np.arange(len(next(iter(columns.values())))), *columns.values()])
    np.savetxt(path, rows, delimiter=",", header=",".join(names), comments="", fmt="%.9g")
    return path


@pytest.mark.parametrize(
    ("text", "quantity", "factor"),
    [
        ("[ µm/s ]", Quantity.VELOCITY, 1e-6),
        ("mm/sec", Quantity.VELOCITY, 1e-3),
        ("m/s²", Quantity.ACCELERATION, 1.0),
        ("m/s2", Quantity.ACCELERATION, 1.0),
        ("g", Quantity.ACCELERATION, 9.80665),
        ("Volts", Quantity.VOLTAGE, 1.0),
        ("mN", Quantity.FORCE, 1e-3),
        ("nm", Quantity.DISPLACEMENT, 1e-9),
        ("rad", Quantity.ANGLE, 1.0),
        ("°", Quantity.ANGLE, np.pi / 180.0),
        ("mrad/s", Quantity.ANGULAR_VELOCITY, 1e-3),
        ("deg/s", Quantity.ANGULAR_VELOCITY, np.pi / 180.0),
        ("mA", Quantity.CURRENT, 1e-3),
        ("ampere", Quantity.CURRENT, 1.0),
    ],
)
def test_units_as_instruments_write_them(text, quantity, factor):
    found = scaled(text)
    assert found is not None and found.quantity is quantity
    assert found.factor == pytest.approx(factor)


def test_units_of_axes_and_ratios():
    found = ratio_of("[ mm/s / mV ]")
    assert found is not None
    assert (found[0].quantity, found[1].quantity) == (Quantity.VELOCITY, Quantity.VOLTAGE)
    assert found[0].factor / found[1].factor == pytest.approx(1.0)
    assert time_factor("[ ms ]") == pytest.approx(1e-3) and frequency_factor("kHz") == pytest.approx(1e3)
    assert time_factor("m") is None and scaled("kg") is None and scaled("") is None and ratio_of("m/s") is None


def test_rates_and_roundings_are_those_of_what_is_written():
    assert declared("the header", "sample rate [kHz]", 5.0).step == pytest.approx(2e-4)
    assert unpacked(np.array([0, 10, 0, 20], np.int16), {"scale_factor": 1e-3}).resolution == pytest.approx(5e-4)
    assert column_step([["0.5"], ["12.25"], ["100"]], 0, False) == pytest.approx(0.1), "four digits of the largest"
    times = np.round(np.arange(50) * 0.3333, 2)
    assert even("a file", times, 0.01).rounding == pytest.approx(0.01 / times[-1]), "of the whole, not of a step"


def test_clipping_is_told_from_the_samples():
    wave = np.sin(0.0123 * N) + 0.3 * np.sin(0.31 * N)
    assert clipped_samples(wave) == 0
    beyond = np.count_nonzero(wave <= -0.9)
    assert beyond - 10 < clipped_samples(np.clip(wave, -0.9, 2.0)) <= beyond  # runs of two are not counted
    # crests that are rounded to the steps of a converter are no clipping, at any number of bits
    for bits in (6, 8, 12, 16):
        digit = 2.0 / 2**bits
        for pace in (0.001, 0.01, 0.1):
            assert clipped_samples(digit * np.round(np.sin(pace * N) / digit)) == 0
    assert clipped_samples(np.zeros(10)) == 0
    assert clipped_samples(np.array([0.0, 0.01, 1.0, 1.0, 1.0, 0.0, -1.0])) == 3
    ramp = np.append(np.arange(100.0), np.full(50, 99.0))
    assert heaped_samples(ramp) == (51, 99.0) and heaped_samples(-ramp) == (51, -99.0)
    noisy = np.clip(wave + np.random.default_rng(3).normal(size=len(N)) * 0.01, None, 1.0)
    assert clipped_samples(np.round(noisy / 1e-3) * 1e-3) > 100


def test_the_drive(tmp_path):
    wave = np.sin(0.05 * N)
    path = table(tmp_path, **{"tip [m/s]": wave, "a [V]": wave, "b [V]": 0 * wave})
    undecided = read_measurement(path)
    assert undecided.drive is None
    notes = "\n".join(undecided.notes)
    assert "no channel is known to be the drive" in notes and "channel 'b' is 0 V throughout" in notes
    assert read_measurement(path, drive="a").drive == "a"
    assert read_measurement(path, channels={"tip": {}}, drive="a").names == ("tip", "a")  # who names it asks for it
    assert read_measurement(path, channels={"tip": {}, "a": {"name": "left"}}, drive="a").drive == "left"


@pytest.mark.parametrize("kind", [np.uint8, np.int16, np.int32, np.float32])
def test_a_sound_file_is_in_shares_of_full_scale_and_its_unit_is_chosen(tmp_path, kind):
    shares = np.stack([np.sin(0.1 * N), 0.5 * np.cos(0.1 * N)], axis=1)[:2000]
    if np.dtype(kind).kind == "f":
        samples, finest = shares.astype(kind), 1e-7
    else:
        scale = 2 ** (8 * np.dtype(kind).itemsize - 1)
        level = scale if kind is np.uint8 else 0
        samples = (np.round(0.99 * shares * scale) + level).astype(kind)
        shares, finest = 0.99 * shares, 0.5 / scale
    path = tmp_path / "leg.wav"
    wavfile.write(path, 48000, samples)
    record = read_measurement(path, channels={"1": {"unit": "mm/s", "factor": 2.5}, "2": "V"}, drive="2")
    assert record.step == 1 / 48000 and record.drive == "2"
    assert record.values == pytest.approx(shares.T * [[2.5e-3], [1.0]], abs=1.1 * finest)


def test_a_clipped_channel_is_accepted_as_chosen(tmp_path):
    wave = np.sin(0.05 * N)
    path = table(tmp_path, **{"tip [mm/s]": np.clip(wave, -0.8, 0.8), "drive [V]": np.sign(wave)})
    accepted = read_measurement(path, channels={"tip": {"accept_clipped": True}, "drive": {}})
    assert "channel 'tip' is clipped" in "\n".join(accepted.notes) and accepted.drive == "drive"
