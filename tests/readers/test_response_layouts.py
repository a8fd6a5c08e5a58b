"""Responses as other programs lay them out: in two series, tables, cells, decibels, and with a bad line at 0 Hz."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.io import savemat

import tarsus as ts
from tarsus.records.readers import read_measurement, read_response

LINES = 0.5 * np.arange(60)
W = 2.0 * np.pi * LINES
H = np.array([-(W**2) / ((2.0 * np.pi * f) ** 2 - W**2 + 8.0j * W) for f in (9.0, 16.0)])
UNIT = "m/s^2/N"


def mat(tmp_path: Path, **content: object) -> Path:
    path = tmp_path / "response.mat"
    savemat(path, content)
    return path


def csv(tmp_path: Path, names: str, *columns: np.ndarray) -> Path:
    path = tmp_path / "response.csv"
    rows = [",".join(f"{cell:.9g}" for cell in row) for row in zip(*columns, strict=True)]
    path.write_text("\n".join([names, *rows]) + "\n", encoding="utf-8")
    return path


def test_two_real_series_are_one_response_as_is_said(tmp_path):
    path = mat(tmp_path, f=LINES, Hre=H[0].real, Him=H[0].imag, mag=np.abs(H[0]), phase=np.angle(H[0], deg=True))
    table = csv(tmp_path, "a,b,c", LINES, H[0].real, H[0].imag)
    for file, channels, axis in (
        (path, {"Hre": {"unit": UNIT, "imaginary": "Him"}}, None),
        (path, {"mag": {"unit": UNIT, "phase": "phase", "phase_unit": "deg"}}, None),
        (table, {"b": {"unit": UNIT, "imaginary": "c"}}, "a"),
    ):
        read = read_response(file, channels=channels, axis=axis)
        assert read.values[0, 0] == pytest.approx(H[0]) and read.frequency == pytest.approx(LINES)


@pytest.mark.parametrize(
    ("names", "channels"),
    [
        ("f (Hz),Magnitude (dB),Phase (deg)", {"Magnitude": UNIT}),
        ("f [Hz],Amplitude [dB re 1 m/s^2/N],Phase [deg]", {}),
        ("f_Hz,H_dB,H_phase_deg", {"H": UNIT}),
    ],
)
def test_decibels_are_never_taken_as_amplitudes(tmp_path, names, channels):
    path = csv(tmp_path, names, LINES[1:], 20.0 * np.log10(np.abs(H[0, 1:])), np.angle(H[0, 1:], deg=True))
    read = read_response(path, channels=channels)
    assert read.values[0, 0] == pytest.approx(H[0, 1:], rel=1e-6)


@pytest.mark.parametrize(
    "names",
    [
        "Frequenz [Hz],Realteil [m/s^2/N],Imagin\N{LATIN SMALL LETTER A WITH DIAERESIS}rteil [m/s^2/N]",
        "Fr\N{LATIN SMALL LETTER E WITH ACUTE}quence (Hz),Partie r\N{LATIN SMALL LETTER E WITH ACUTE}elle (m/s^2/N),"
        "Partie imaginaire (m/s^2/N)",
        "f_Hz,H1_re [m/s^2/N],H1_im [m/s^2/N]",
        "# f_Hz,H1_re [m/s^2/N],H1_im [m/s^2/N]",
        "Frequency,H1 Velocity,H1 Velocity\n,Real,Imaginary\n[ Hz ],[ m/s^2/N ],[ m/s^2/N ]",
    ],
)
def test_headers_in_other_words(tmp_path, names):
    read = read_response(csv(tmp_path, names, LINES, H[0].real, H[0].imag))
    assert read.values[0, 0] == pytest.approx(H[0], rel=1e-6)
    assert read.outputs[0].name in ("Realteil", "Partie r\N{LATIN SMALL LETTER E WITH ACUTE}elle", "H1", "H1 Velocity")


def test_a_response_that_nothing_is_said_of_is_left_out_with_a_note(tmp_path):
    names = "Frequency (Hz),Re(H1) (m/s^2/N),Im(H1) (m/s^2/N),Re(H2),Im(H2)"
    read = read_response(csv(tmp_path, names, LINES, H[0].real, H[0].imag, H[1].real, H[1].imag))
    assert read.values.shape == (1, 1, 60)
    assert "response.csv: nothing says of the response 'H2' its input: not used" in read.notes


def test_a_response_that_is_there_in_two_forms_counts_once(tmp_path):
    size, angle = 20.0 * np.log10(np.abs(H[0, 1:])), np.angle(H[0, 1:], deg=True)
    path = csv(tmp_path, "f_Hz,H1_re,H1_im,H1_dB,H1_phase_deg", LINES[1:], H[0, 1:].real, H[0, 1:].imag, size, angle)
    assert read_response(path, channels={"H1": UNIT}).values.shape == (1, 1, 59)


def test_a_table_or_cells_chosen_as_a_whole(tmp_path):
    cells = np.empty((1, 2), dtype=object)
    cells[0, 0], cells[0, 1] = H
    for whole in (H, H.T, cells, H[:, None, :]):
        read = read_response(mat(tmp_path, freq=LINES, FRF=whole), channels={"FRF": UNIT})
        assert [one.name for one in read.outputs] == ["FRF/1", "FRF/2"]
        assert read.values[:, 0] == pytest.approx(H)


def test_the_frequencies_of_the_logger_of_cambridge(tmp_path):
    path = mat(tmp_path, yspec=H.T, freq=60.0, npts=np.uint16(120), tfun=1, dt2=np.array([0, 2, 0]))
    read = read_response(path, channels={"yspec": UNIT})
    assert read.values.shape == (2, 1, 60) and read.frequency == pytest.approx(LINES)


def test_a_bad_number_at_zero_is_left_out(tmp_path):
    path = mat(tmp_path, f=LINES, H=np.where(LINES == 0.0, np.nan, H[0]), coh=np.ones(60))
    read = read_response(path, channels={"H": {"unit": UNIT, "coherence": "coh"}})
    assert read.frequency == pytest.approx(LINES[1:]) and read.values[0, 0] == pytest.approx(H[0, 1:])
    assert read.coherence is not None and read.coherence.shape == (1, 1, 59)
    assert any("no finite number at 0 Hz" in note for note in read.notes)
    assert not any("not used: 'H'" in note for note in read.notes)


def test_an_axis_in_radians_a_second(tmp_path):
    path = mat(tmp_path, w=W, H=H[0])
    read = read_response(path, channels={"H": UNIT}, axis="w", axis_unit="rad/s")
    assert read.frequency == pytest.approx(LINES)


def test_rates_in_attributes_and_times_beside_the_channels(tmp_path):
    path = tmp_path / "runs.h5"
    with h5py.File(path, "w") as file:
        for run in ("a", "b"):
            file[f"{run}/time"] = 0.01 * np.arange(60)
            file[f"{run}/tip"] = H.real[0]
            file[f"{run}/tip"].attrs["units"] = "m/s^2"
        file["own"] = H.real[0]
        file["own"].attrs.update({"units": "m/s^2", "sample_rate": 100.0})
    with pytest.raises(ts.InputError, match="'a/time' and 'b/time' may each be the axis"):
        read_measurement(path)
    assert read_measurement(path, channels=["b/tip"]).step == pytest.approx(0.01)


@pytest.mark.parametrize(
    ("unit", "factor"),
    [("g/lbf", 9.80665 / 4.4482216), ("in/s^2/lbf", 0.0254 / 4.4482216), ("(1/N)*(m/s^2)", 1.0), ("1/kg", 1.0)],
)
def test_units_of_accelerances(tmp_path, unit, factor):
    read = read_response(mat(tmp_path, f=LINES, H=H[0]), channels={"H": unit})
    assert read.outputs[0].quantity.unit == "m/s^2" and read.inputs[0].quantity.unit == "N"
    assert read.values[0, 0] == pytest.approx(factor * H[0])
