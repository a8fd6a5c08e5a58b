"""Waveforms: closed-form stretches against direct formulas, definitions, files, and what is refused."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tarsus.base.spec import validate
from tarsus.model.drive.laws import LinearForce
from tarsus.model.drive.lower import evaluate, lower
from tarsus.model.drive.waveforms import RampedSquare, Sampled, Sine, Square


def test_ramps_of_no_duration_are_the_edges_of_the_square() -> None:
    wave, square = RampedSquare(amplitude=8.0, frequency=5.0, duty=0.0), Square(amplitude=8.0, frequency=5.0)
    t = np.linspace(0.0, 0.39, 200) + 1e-4
    assert np.array_equal(wave.volts(t), square.volts(t))
    assert wave.track().first.tolist() == [8.0, -8.0]


def test_phase_on_an_edge_leaves_no_sliver() -> None:
    for duty in (0.1, 0.3, 0.7):
        wave = Square(amplitude=1.0, frequency=3.0, duty=duty, phase=2.0 * math.pi * duty)
        track = wave.track()
        assert track.first.tolist() == [-1.0, 1.0]


@given(
    phase=st.floats(-20.0, 20.0), offset=st.floats(-5.0, 5.0), frequency=st.floats(0.1, 1e5), duty=st.floats(0.0, 1.0)
)
def test_any_phase_offset_and_duty(phase: float, offset: float, frequency: float, duty: float) -> None:
    law = LinearForce(gain=1.0)
    common = {"amplitude": 8.0, "frequency": frequency, "phase": phase, "offset": offset}
    t = np.linspace(0.0, 2.0 / frequency, 400)
    sine = Sine(**common)
    assert np.abs(evaluate(lower(sine, law)[1], t) - sine.volts(t)).max() <= 1e-12 * 16.0 + 1e-14 * 40
    ramped = RampedSquare(**common, duty=max(duty, 1e-3))
    steep = 4.0 * 8.0 / ramped.duty  # volts per cycle
    error = np.abs(evaluate(lower(ramped, law)[1], t) - ramped.volts(t)).max()
    assert error <= 1e-12 * 16.0 + 2e-15 * steep
    square = Square(**common, duty=duty)
    differ = evaluate(lower(square, law)[1], t) != square.volts(t)
    edges = np.remainder(frequency * t + phase / (2 * math.pi), 1.0)
    near = (edges < 1e-9) | (edges > 1.0 - 1e-9) | (np.abs(edges - duty) < 1e-9)
    assert not np.any(differ & ~near)


SAMPLES = {
    "bare.csv": "0,1\n0.1,-2\n0.25,3.5\n",
    "comment.csv": "# a comment\nt [s]; V\n0;1\n0.1;-2\n\n0.25;3.5\n",
    "units.csv": "time (ms),drive (mV)\n0,1000\n100,-2000\n250,3500\n",
    "beside others.txt": "tip (mm/s)\tdrive (V)\tt (s)\n9\t1\t0\n9\t-2\t0.1\n9\t3.5\t0.25\n",
    "late.csv": "time (s),drive (V)\n5,1\n5.1,-2\n5.25,3.5\n",
    "before a trigger.csv": "time (s),drive (V)\n-0.1,1\n0,-2\n0.15,3.5\n",
}


@pytest.mark.parametrize("name", [*SAMPLES, "named.csv", "record.npz"])
def test_samples_from_a_file(tmp_path: Path, name: str) -> None:
    times, levels = np.array([0.0, 0.1, 0.25]), np.array([1.0, -2.0, 3.5])
    file, columns = tmp_path / name, {}
    if name in SAMPLES:
        file.write_text(SAMPLES[name], encoding="utf-8")
    elif name == "named.csv":
        file.write_text("probe,clock,drive\n9,0,1\n9,0.1,-2\n9,0.25,3.5\n")
        columns = {"time_column": "clock", "value_column": "drive"}
    else:
        np.savez(file, time=times, volts=levels)
    raw = {"kind": "sampled", "file": file.name, **columns}
    wave = validate(Sampled, raw, context={"folder": tmp_path})
    got_times, got_levels = wave.samples()
    assert got_times.tolist() == pytest.approx(times.tolist(), abs=1e-15)
    assert got_levels.tolist() == pytest.approx(levels.tolist())
    again = validate(Sampled, wave.model_dump())  # from any other folder
    assert again == wave
    assert wave.volts(np.array([0.05])).tolist() == pytest.approx([-0.5])
    assert bool(wave.remarks) is (name in ("late.csv", "before a trigger.csv"))


def test_the_clock_of_a_file_does_not_count_unless_its_start_is_given(tmp_path: Path) -> None:
    file = tmp_path / "late.csv"
    file.write_text(SAMPLES["late.csv"])
    said = "late.csv begins at 5 s of its own clock; here its first sample comes at 0 s (start)."
    assert Sampled(file=str(file)).remarks == (said,)
    placed = Sampled(file=str(file), start="2 s")
    assert placed.samples()[0].tolist() == pytest.approx([2.0, 2.1, 2.25])
    assert not placed.remarks and placed.volts(np.array([1.0])) == [1.0]


def test_a_changed_file_is_read_again(tmp_path: Path) -> None:
    import os

    file = tmp_path / "record.csv"
    file.write_text("0,1\n1,2\n")
    wave = Sampled(file=str(file))
    assert wave.samples()[1].tolist() == [1.0, 2.0]
    file.write_text("0,5\n1,6\n")
    os.utime(file, ns=(1, 1))
    assert wave.samples()[1].tolist() == [5.0, 6.0]
