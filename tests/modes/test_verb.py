"""The verb: free decays, sweeps and random records of several files, what it writes, and what it refuses."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
import pyuff
from scipy.integrate import cumulative_simpson
from scipy.signal import butter, chirp, resample, sosfilt

import tarsus as ts
from modes.test_modal import POLES, SHAPES, responses
from tarsus.base.errors import InputError
from tarsus.cli.app import run
from tarsus.modes import Frf, ModeVerdict, identify_modes
from tarsus.records.measurement import Channel, FrequencyResponse, Measurement, Quantity

BAND = (100.0, 1000.0)
NAMES = ("a", "b", "c")


def decay(rate: float, length: float, seed: int) -> Measurement:
    """Three modes released together, with noise of a thousandth."""
    random, time = np.random.default_rng(seed), np.arange(int(length * rate)) / rate
    rows = 1e-3 * random.standard_normal((3, len(time)))
    for shape, (f, ratio) in zip(SHAPES, POLES, strict=True):
        w = 2.0 * np.pi * f
        free = np.exp(-ratio * w * time) * np.cos(w * np.sqrt(1.0 - ratio**2) * time + random.uniform(0.0, 6.0))
        rows += shape[:, None] * random.normal(1.0, 0.3) * free
    channels = tuple(Channel(name, Quantity.VELOCITY) for name in NAMES)
    return Measurement(channels, rows, 1.0 / rate, source=f"decay{seed}.csv")


def driven(rate: float, length: float, seed: int, kind: str = "sweep", points: str = "abc") -> Measurement:
    """Velocities under a sweep or noise that ends with the record, four times as finely computed as sampled."""
    random, fine = np.random.default_rng(seed), 4.0 * rate
    time = np.arange(int(length * fine)) / fine
    if kind == "sweep":
        force = chirp(time, 50.0, 0.85 * length, 1200.0) * (time < 0.85 * length)
    else:
        force = sosfilt(butter(8, 0.225, output="sos"), random.standard_normal(len(time)))
    spectrum, s = np.fft.rfft(force, 2 * len(time)), 2.0j * np.pi * np.fft.rfftfreq(2 * len(time), 1.0 / fine)
    rows = np.zeros((3, len(time)))
    for shape, (f, ratio) in zip(SHAPES, POLES, strict=True):
        w = 2.0 * np.pi * f
        one = np.fft.irfft(spectrum * s / (s * s + 2.0 * ratio * w * s + w * w), 2 * len(time))
        rows += shape[:, None] * shape[0] * one[: len(time)]
    rows = rows[:, ::4] + 1e-3 * rows.std() * random.standard_normal(rows[:, ::4].shape)
    channels = (Channel("force", Quantity.FORCE), *(Channel(name, Quantity.VELOCITY) for name in NAMES))
    whole = Measurement(channels, np.concatenate([force[None, ::4], rows]), 1.0 / rate, drive="force")
    return replace(whole.select(["force", *points]), source=f"{kind}{seed}.csv")


def check(fit, frequency: float, damping: float) -> None:
    """All three modes determined, and as near as said."""
    assert [mode.verdict for mode in fit.modes] == [ModeVerdict.DETERMINED] * 3
    assert fit.frequencies == pytest.approx([f for f, _ in POLES], rel=frequency)
    assert fit.damping_ratios == pytest.approx([ratio for _, ratio in POLES], rel=damping)


def test_a_free_decay_however_soon_it_is_cut_off_and_decays_of_different_rates():
    for length in (0.2, 0.1):
        check(ts.modes(decay(5000.0, length, 1), decay=True, band=BAND), 1e-4, 5e-3)
    check(ts.modes(decay(5000.0, 0.2, 1), decay(8000.0, 0.15, 2), decay=True, band=BAND), 2e-4, 0.01)


@pytest.mark.parametrize("step", ["0.000977", "9.77E-4", "9.765625E-4"])
def test_a_step_of_few_digits_widens_the_intervals(tmp_path, step):
    time = np.arange(512) / 1024.0
    rows = np.exp(-0.0119 * 2.0 * np.pi * 40.0 * time) * np.cos(2.0 * np.pi * 40.0 * np.sqrt(1.0 - 0.0119**2) * time)
    head = (
        "LabVIEW Measurement\nX_Columns\tNo\n***End_of_Header***\n\nChannels\t1\nSamples\t512\nY_Unit_Label\tm/s\n"
        f"Delta_X\t{step}\n***End_of_Header***\nX_Value\ttip\n"
    )
    path = tmp_path / "decay.lvm"
    path.write_text(head + "".join(f"\t{one:.7f}\n" for one in rows), encoding="utf-8")
    fit = ts.modes(path, decay=True, band=(25.0, 60.0), order=8)
    (mode,) = fit.modes
    assert mode.verdict is ModeVerdict.DETERMINED
    assert mode.frequency.low < 40.0 < mode.frequency.high
    few = step != "9.765625E-4"
    assert few is (mode.frequency.half_width(40.0) > 5e-4)
    assert few is any("all frequencies may be wrong together by 0.051 %" in said for said in fit.remarks)


def test_a_decay_of_velocities_and_a_displacement():
    record = decay(5000.0, 0.2, 1)
    moved = cumulative_simpson(record["c"], dx=record.step, initial=0.0)
    channels = (*record.channels[:2], Channel("c", Quantity.DISPLACEMENT))
    mixed = replace(record, channels=channels, values=np.array([record["a"], record["b"], moved]))
    fit = ts.modes(mixed, decay=True, band=BAND)
    check(fit, 1e-4, 5e-3)
    plain = ts.modes(record, decay=True, band=BAND)
    assert np.abs(fit.complex_shapes()) == pytest.approx(np.abs(plain.complex_shapes()), abs=0.02)


def test_records_of_one_experiment_at_two_rates():
    slow = driven(4000.0, 1.5, 1)
    others = slow.select(["b", "c"])
    fast = replace(others, values=resample(others.values, 7500, axis=1), step=1.0 / 5000.0, source="fast.csv")
    fit = ts.modes(slow.select(["force", "a"]), fast)
    check(fit, 1e-3, 0.02)
    assert fit.frf.outputs == NAMES


def same_numbers(first, second) -> None:
    """Equal to rounding, in every mode and every residue of a point."""
    assert [m.verdict for m in first.modes] == [m.verdict for m in second.modes]
    places = [second.frf.outputs.index(name) for name in first.frf.outputs]
    for a, b in zip(first.modes, second.modes, strict=True):
        for ours, theirs in ((a.frequency, b.frequency), (a.damping, b.damping)):
            wanted = (theirs.value, theirs.low, theirs.high)
            assert (ours.value, ours.low, ours.high) == pytest.approx(wanted, rel=1e-9)
        assert a.residues == pytest.approx(b.residues[places], rel=1e-7, abs=1e-9 * np.abs(a.residues).max())


def test_the_order_and_names_of_files_and_which_points_share_one_change_nothing():
    files = [driven(4000.0, 1.0, seed, points=point) for seed, point in ((1, "a"), (2, "b"), (3, "c"))]
    fit = ts.modes(*files, band=(110.0, 990.0))
    assert any(mode.verdict is ModeVerdict.DETERMINED for mode in fit.modes)
    same_numbers(fit, ts.modes(*(replace(files[k], source="p") for k in (1, 2, 0)), band=(110.0, 990.0)))
    whole = driven(4000.0, 1.0, 1)
    apart = replace(whole.select(["c"]), drive=None)
    files = [whole.select(["force", "b"]), apart, whole.select(["force", "a"])]
    same_numbers(ts.modes(whole, band=(110.0, 990.0)), ts.modes(*files, band=(110.0, 990.0)))


# Slow: each channel of a response is a file of its own, and each decay an excitation of its own.
@pytest.mark.slow
def test_nor_does_the_order_of_responses_and_decays():
    frf = responses(Quantity.VELOCITY, 0.003)
    channels = (Channel("v", Quantity.VELOCITY),), (Channel("f", Quantity.FORCE),)
    files = [
        FrequencyResponse(*channels, frf.frequency, one[None], None, f"{k}.csv") for k, one in enumerate(frf.values)
    ]
    fit, other = (ts.modes(*(files[k] for k in order), band=(110.0, 990.0)) for order in ((0, 1, 2), (1, 2, 0)))
    same_numbers(fit, other)
    decays = [decay(5000.0, 0.2, seed) for seed in (1, 2)]
    fit, other = (ts.modes(*some, decay=True, band=(110.0, 990.0)) for some in (decays, decays[::-1]))
    same_numbers(fit, replace(other, modes=tuple(replace(m, residues=m.residues[:, [1, 0]]) for m in other.modes)))


# Slow: minutes of noise.
@pytest.mark.slow
def test_a_record_without_a_drive_goes_with_the_one_it_follows():
    first, second = (driven(4000.0, 20.0, seed, "noise") for seed in (1, 2))
    other = replace(second.select(["b", "c"]), drive=None)
    files = (first.select(["force", "a"]), second.select(["force", "a"]), other)
    for turned in (files, files[::-1]):
        check(ts.modes(*turned, band=BAND), 2e-3, 0.15)


def test_a_random_drive_is_cut_into_segments():
    check(ts.modes(driven(4000.0, 15.0, 1, "noise"), band=BAND), 2e-3, 0.15)


def test_a_delay_is_found_and_taken_off():
    lines = np.arange(100.0, 2000.0, 1.0)
    s = 2.0j * np.pi * lines
    own = 2.0 * np.pi * np.array([300.0, 700.0, 1100.0, 1500.0, 1800.0])[:, None]
    values = np.sum(s / (s * s + 0.02 * own * s + own * own), axis=0) * np.exp(-s * 0.12e-3)
    noise = np.random.default_rng(1).standard_normal((2, len(lines))) * 1e-3 * np.abs(values).max()
    frf = Frf(lines, (values + noise[0] + 1.0j * noise[1])[None, None], ("p",), ("f",), Quantity.VELOCITY)
    fit = identify_modes(frf, (110.0, 1990.0), 24)
    assert fit.delay == pytest.approx(0.12e-3, abs=0.02e-3) and "after the drive" in fit.remarks[0]
    assert [mode.verdict for mode in fit.modes] == [ModeVerdict.DETERMINED] * 5


def test_what_it_writes_and_compares(tmp_path, capsys):
    frf = responses(Quantity.VELOCITY, 0.001)
    for k in range(3):
        rows = np.column_stack([frf.frequency, frf.values[k, 0].real, frf.values[k, 0].imag])
        head = "Frequency (Hz),v real (m/s/N),v imag (m/s/N)"
        np.savetxt(tmp_path / f"p{k + 1}.csv", rows, delimiter=",", header=head, comments="", fmt="%.12g")
    files = [str(tmp_path / f"p{k}.csv") for k in (1, 2, 3)]
    out = tmp_path / "found"
    assert run(["modes", *files, "--band", "110Hz:990Hz", "-o", str(out)]) == 0
    assert "determined" in capsys.readouterr().out
    found = json.loads((out / "modes.json").read_text())
    assert [m["frequency_hz"] for m in found["modes"]] == pytest.approx([f for f, _ in POLES], rel=1e-3)
    assert np.array(found["auto_mac"]).shape == (3, 3) and len(found["points"]) == 3
    page = (out / "report.html").read_text()
    assert "3 of 3 modes determined" in page and page.count("<figure") >= 5
    shapes = pyuff.UFF(str(out / "shapes.unv")).read_sets()
    assert [int(one["mode_n"]) for one in shapes] == [1, 2, 3]
    size = 2.0 * np.pi * POLES[0][0]
    assert abs(shapes[0]["eig"]) == pytest.approx(size, rel=1e-3) and max(abs(shapes[0]["r1"])) == pytest.approx(1.0)
    assert "frequency" in (out / "modes.csv").read_text().splitlines()[0]
    assert run(["modes", *files, "--band", "110Hz:990Hz", "--against", str(out / "modes.json"), "--json"]) == 0
    compared = json.loads(capsys.readouterr().out)["compared"]
    assert "MAC" in json.dumps(compared)


def test_what_it_refuses(tmp_path):
    with pytest.raises(InputError, match="name at least one file"):
        ts.modes()
    record = decay(5000.0, 0.2, 1)
    with pytest.raises(InputError, match="no channel is known to be the drive"):
        ts.modes(record)
    with pytest.raises(InputError, match="other channels"):
        ts.modes(record, record.select(["a"]), decay=True)
    one = FrequencyResponse(
        (Channel("v", Quantity.VELOCITY),), (Channel("f", Quantity.FORCE),), np.arange(1.0, 99.0), np.ones((1, 1, 98))
    )
    with pytest.raises(InputError, match="give one kind"):
        ts.modes(record, one)
    with pytest.raises(InputError, match="lines of the files are not the same"):
        ts.modes(one, replace(one, frequency=one.frequency * 1.5))
    other = replace(one, outputs=(Channel("w", Quantity.VELOCITY),), inputs=(Channel("g", Quantity.FORCE),))
    with pytest.raises(InputError, match="is in no file"):
        ts.modes(one, other)
