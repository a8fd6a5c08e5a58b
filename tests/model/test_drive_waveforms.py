"""Waveforms: closed-form stretches against direct formulas, definitions, files, and what is refused."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drive_cases import WAVEFORMS
from tarsus.base.errors import InputError
from tarsus.base.spec import validate
from tarsus.model.drive.laws import LinearForce
from tarsus.model.drive.lower import evaluate, lower
from tarsus.model.drive.waveforms import RampedSquare, Sampled, Sine, Square
from tarsus.model.drive.waveforms.sampled import Interpolation


def test_ramped_square_as_defined() -> None:
    """25 % at 5 Hz: 25 ms ramps centred on the edges of the square wave, 75 ms plateaus; 0 is the square."""
    wave = RampedSquare(amplitude=8.0, frequency=5.0, duty=0.25)
    t = np.array([0.0, 0.00625, 0.0125, 0.05, 0.0875, 0.1, 0.1125, 0.15, 0.1875, 0.2])
    np.testing.assert_allclose(wave.volts(t), [0.0, 4.0, 8.0, 8.0, 8.0, 0.0, -8.0, -8.0, -8.0, 0.0], atol=1e-12)
    _, pieces = lower(wave, LinearForce(gain=1.0))
    np.testing.assert_allclose(np.diff(pieces.start), [0.0125, 0.075, 0.025, 0.075, 0.0125], rtol=1e-12)
    assert pieces.kink.tolist() == [False, True, True, True, True]
    assert np.ptp(wave.volts(np.linspace(0.0125, 0.0874, 50))) == 0.0
    square = Square(amplitude=8.0, frequency=5.0)
    t = np.linspace(0.0, 0.39, 200) + 1e-4
    assert np.array_equal(wave.model_copy(update={"duty": 0.0}).volts(t), square.volts(t))
    flat = RampedSquare(amplitude=8.0, frequency=5.0, duty=0.0).track()
    assert flat.first.tolist() == [8.0, -8.0]


def test_square_starts_with_the_upper_level_and_keeps_its_duty() -> None:
    _, pieces = lower(Square(amplitude=8.0, frequency=50.0, duty=0.25), LinearForce(gain=1.0))
    assert pieces.coef[:, 0].tolist() == [8.0, -8.0]
    np.testing.assert_allclose(pieces.start, [0.0, 0.005, 0.02], rtol=1e-15)
    assert pieces.kink.all()
    assert pieces.loop == 0
    for duty, level in ((0.0, -8.0), (1.0, 8.0)):
        _, flat = lower(Square(amplitude=8.0, frequency=50.0, duty=duty), LinearForce(gain=1.0))
        assert np.array_equal(evaluate(flat, np.linspace(0, 1, 77)), np.full(77, level))


def test_phase_on_an_edge_leaves_no_sliver() -> None:
    for duty in (0.1, 0.3, 0.7):
        wave = Square(amplitude=1.0, frequency=3.0, duty=duty, phase=2.0 * math.pi * duty)
        track = wave.track()
        assert track.first.tolist() == [-1.0, 1.0]


def test_values_are_held_after_the_end() -> None:
    assert evaluate(lower(WAVEFORMS["ramp"], LinearForce(gain=1.0))[1], 1e3) == 8.0
    assert evaluate(lower(WAVEFORMS["poling"], LinearForce(gain=1.0))[1], [0.2, 0.35, 9.0]).tolist() == (
        pytest.approx([10.0, 5.0, 0.0], abs=1e-13)
    )
    chirp = WAVEFORMS["chirp"]
    last = evaluate(lower(chirp, LinearForce(gain=1.0))[1], 7.0)
    assert last == pytest.approx(float(chirp.volts(np.array(0.5))), abs=1e-11)
    with pytest.raises(InputError, match="not negative"):
        evaluate(lower(chirp, LinearForce(gain=1.0))[1], -1.0)


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


def test_natural_spline_is_scipys() -> None:
    from scipy.interpolate import CubicSpline

    rng = np.random.default_rng(3)
    times = np.cumsum(rng.uniform(0.5, 2.0, 60)) * 1e-3
    levels = rng.normal(size=60)
    wave = Sampled(times=tuple(times), levels=tuple(levels), interpolation=Interpolation.CUBIC)
    t = np.linspace(times[0], times[-1], 5000)
    wanted = CubicSpline(times, levels, bc_type="natural")(t)
    np.testing.assert_allclose(wave.volts(t), wanted, rtol=0, atol=1e-12)
    pieces = lower(wave, LinearForce(gain=1.0))[1]
    np.testing.assert_allclose(evaluate(pieces, t), wanted, rtol=0, atol=1e-12)


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
