"""Volts between samples: corners where they are, memory that turns where the voltage did."""

from __future__ import annotations

import numpy as np
import pytest

from tarsus.files.library import load_scene
from tarsus.identify.volts import Stretches, Volts, jumps_of
from tarsus.model.drive.laws import LinearForce
from tarsus.model.drive.waveforms import RampedSquare, Sine

RATE = 20e3


def samples(wave, seconds: float = 0.1, start: float = 1.3e-5) -> tuple[np.ndarray, np.ndarray]:
    time = start + np.arange(int(seconds * RATE)) / RATE
    return time, np.round(wave.volts(time) * 2**15 / 10.0) * 10.0 / 2**15


@pytest.mark.parametrize(
    "wave", [RampedSquare(amplitude=8.0, frequency=60.0, duty=1.0), Sine(amplitude=5.0, frequency=100.0)]
)
def test_between_samples_the_volts_are_those_of_the_wave(wave):
    time, levels = samples(wave)
    made = Volts.of(levels, 4)
    places = np.interp(np.arange(len(made.fine)) / 4, np.arange(len(time)), time)
    inside = (places > time[12]) & (places < time[-12])
    assert made.fine[inside] == pytest.approx(wave.volts(places[inside]), abs=2e-3)


def test_a_corner_that_no_sample_hit_is_found():
    _, levels = samples(RampedSquare(amplitude=8.0, frequency=60.0, duty=1.0))
    made = Volts.of(levels, 1)
    turns = made.levels[1:-1][np.diff(np.sign(np.diff(made.levels))) != 0.0][2:-2]
    assert np.max(levels) < 7.995
    assert turns == pytest.approx(8.0 * np.sign(turns), abs=1e-3)


def test_memory_is_that_of_the_whole_record():
    drive = load_scene("cantilever").robot.drives["pzt"]
    wave = RampedSquare(amplitude=8.0, frequency=60.0, duty=1.0)
    time, levels = samples(wave, start=0.0)
    made = Volts.of(levels, 3)
    first, count = 700, 40
    dense = np.sort(np.concatenate([np.linspace(0.0, time[first + count - 1], 200_001), time[first : first + count]]))
    whole = drive.law.force(wave.volts(dense), drive.history)
    wanted = np.interp(time[first : first + count], dense, whole)
    force = Stretches([(made, first, count)]).force(drive.law, drive.history)
    assert len(force) == 3 * (count - 1) + 1
    assert force[::3] == pytest.approx(wanted, abs=2e-3 * np.ptp(whole))


@pytest.mark.parametrize(
    ("part", "seen", "jumps"), [(0.08, 1.0, []), (0.12, 1.0, [39]), (0.12, 0.5, [39, 40]), (0.12, 0.05, [40])]
)
def test_a_jump_is_a_tenth_of_the_span_or_more(part, seen, jumps):
    """Of a span of 2 V; a sample lies within the jump where it has seen a share of it."""
    levels = np.concatenate([np.full(40, -1.0), np.full(20, 2.0 * part - 1.0), np.linspace(2.0 * part - 1.0, 1.0, 20)])
    levels[40] = -1.0 + 2.0 * part * seen
    assert jumps_of(levels).tolist() == jumps


@pytest.mark.parametrize("law", ["cantilever", "linear"])
def test_stretches_end_with_their_record(law):
    drive = load_scene("cantilever").robot.drives["pzt"]
    chosen = drive.law if law == "cantilever" else LinearForce(gain=0.1)
    _, levels = samples(Sine(amplitude=5.0, frequency=300.0), 0.01)
    made = Volts.of(levels, 3)
    force = Stretches([(made, 0, len(levels)), (made, len(levels) - 4, 10)]).force(chosen, drive.history)
    whole = made.force(chosen, drive.history)
    assert force == pytest.approx(np.append(whole, whole[-10:]))
