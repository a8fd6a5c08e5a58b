"""The reader of tables in text: separators, decimal commas, names, units, complex values."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from readers.test_lvm import HEADER
from tarsus.records.readers import read_measurement, read_response

REAL = Path(__file__).parents[1] / "data" / "real"

POLYTEC = """Source File Name:\tleg.pvd
Point Index:\t3\t[x = 0\ty = 0\tz = 0]
Signal:\tTime - Vib - Velocity (Größe)

Time\tVelocity\tReference
[ s ]\t[ µm/s ]\t[ V ]
0,000E+00\t-1,500E+01\t0,5
1,000E-03\t2,000E+01\t1,0
2,000E-03\t4,000E+01\t0,0
3,000E-03\t1,000E+01\t-1,0
"""


def write(tmp_path: Path, text: str, encoding: str = "utf-8", name: str = "record.txt") -> Path:
    path = tmp_path / name
    path.write_text(text, encoding=encoding)
    return path


@pytest.mark.parametrize(
    ("names", "units", "cells"),
    [
        ("Frequency\tFRF Real\tFRF Imaginary\tCoherence", "[ Hz ]\t[ m/s / N ]\t[ m/s / N ]\t[ - ]", "{re}\t{im}"),
        ("Frequency\tFRF Magnitude\tFRF Phase\tCoherence", "[ Hz ]\t[ m/s / N ]\t[ deg ]\t[ - ]", "{mag}\t{deg}"),
        ("Frequency\tFRF\tCoherence", "[ Hz ]\t[ m/s / N ]\t[ - ]", "({re}+{im}j)"),
    ],
)
def test_complex_responses(tmp_path, names, units, cells):
    values = np.array([1.0 + 2.0j, 3.0 + 4.0j, 0.5 + 0.5j])
    rows = [
        f"{f}\t{cells.format(re=v.real, im=v.imag, mag=abs(v), deg=np.degrees(np.angle(v)))}\t0.9"
        for f, v in zip((10.0, 10.5, 11.0), values, strict=True)
    ]
    path = write(tmp_path, "\n".join([names, units, *rows]) + "\n")
    response = read_response(path, channels={"FRF": {"coherence": "Coherence"}})
    assert response.values[0, 0] == pytest.approx(values)
    assert response.frequency.tolist() == [10.0, 10.5, 11.0]
    assert response.unit == (("m/s / N",),)
    assert response.coherence is not None and response.coherence[0, 0].tolist() == [0.9] * 3


# The last number of the third has fewer digits than any other of its file, and no line end: its bracket shows it whole.
@pytest.mark.parametrize(
    ("point", "last"),
    [(1, -0.5379717710776415 + 0.011383919080682809j), (3, 0.7207020447316804 - 0.00887084871009875j)],
)
def test_one_complex_number_a_line(point, last):
    response = read_response(
        REAL / f"pyuff_meas_point_{point}.txt",
        channels={"column 1": {"unit": "m/s^2/N", "point": "1"}},
        frequency_step=1.0,
    )
    assert response.values.shape == (1, 1, 1001) and response.frequency[-1] == 1000.0
    assert response.values[0, 0, -1] == last


def lvm(rows: str, columns: str = "No") -> str:
    return HEADER.format(columns=columns, decimal=".") + "X_Value\tdrive\ttip\n" + rows


MULTI = """LabVIEW Measurement\t
Separator\tTab
X_Columns\tMulti
***End_of_Header***\t
\t
Channels\t2\t\t\t\t
Samples\t4\t\t4\t
Y_Unit_Label\tg\t\tm/s^2\t
X_Dimension\tTime\t\tTime\t
Delta_X\t0.25\t\t0.25\t
***End_of_Header***\t\t\t\t
X_Value\tax\tX_Value\tay\tComment
"""
SIX = "".join(f"\t{i % 3}.5\t{i}.0\n" for i in range(6))
THREES, MM = [0.5, 1.5, 2.5], 1e-3 * np.arange(6)
GO_ON = "announces 3 samples, and 6 follow, whose times go on"
NAMED = {"channels": {"column 2": {"unit": "um", "name": "tip"}}, "axis": "column 1"}
READ: dict[str, tuple[str, dict[str, Any], dict[str, Any], tuple[str, ...]]] = {
    "no last end.txt": (
        POLYTEC.rstrip(),
        {},
        {"Velocity": np.array([-15.0, 20.0, 40.0, 10.0]) * 1e-6, "Reference": [0.5, 1.0, 0.0, -1.0]},
        ("its last line has no line end",),
    ),
    "no names.txt": ("0.0 1.0\n0.1 3.0\n0.2 2.0\n", NAMED, {"tip": [1e-6, 3e-6, 2e-6]}, ()),
    "columns of no use.csv": (
        "Index,Time (s),tip (mm/s),Marker\n0,0.0,1,\n1,0.1,2,\n2,0.2,4,\n",
        {},
        {"tip": [1e-3, 2e-3, 4e-3]},
        ("'Index' counts the samples: not used", "'Marker' holds no numbers: not used"),
    ),
    "a column that ends early.csv": (
        "time (s),tip (mm/s),drive (V)\n0.0,1,1\n0.1,2,2\n0.2,4,1\n0.3,3,\n0.4,1,\n",
        {},
        {"tip": [1e-3, 2e-3, 4e-3], "drive": [1.0, 2.0, 1.0]},
        ("'tip' goes on for 2 samples",),
    ),
    "second of two records.csv": (
        "Sample rate: 1 kHz\nSamples: 3\ntip [mm/s],drive [V]\n" + "".join(f"{i % 3},{i}\n" for i in range(6)),
        {"record": 2},
        {"tip": MM[:3], "drive": [3.0, 4.0, 5.0]},
        (),
    ),
    "words below.csv": (
        "t (s),tip (mm/s)\n0.0,1\n0.1,2\n0.2,4\n\nMean,2.33\nEnd of file\n",
        {},
        {"tip": [1e-3, 2e-3, 4e-3]},
        ("not used: its last lines, from 'Mean,2.33' on",),
    ),
    "two of one name.csv": (
        "t (s),a (V),a (V)\n0,1,2\n1,2,3\n2,4,1\n",
        {},
        {"a": [1.0, 2.0, 4.0], "a (column 3)": [2.0, 3.0, 1.0]},
        (),
    ),
    "empty lines.csv": ("t (s),x (mm)\n\n0.0,1\n\n0.1,3\n\n0.2,2\n\n", {}, {"x": [1e-3, 3e-3, 2e-3]}, ()),
    "joined.lvm": (lvm(SIX), {"record": 0}, {"drive": THREES * 2, "tip": MM}, ("2 records are joined, as chosen",)),
    "more rows than announced.lvm": (
        lvm("".join(f"{i / 1000}\t{i % 3}.5\t{i}.0\n" for i in range(6)), "One"),
        {},
        {"drive": THREES * 2, "tip": MM},
        (f"{GO_ON}: all are used",),
    ),
    "an empty cell for every column of times.lvm": (
        MULTI + "".join(f"{i / 4:.6f}\t{i % 3:.6f}\t{i / 4:.6f}\t{i % 2:.6f}\n" for i in range(4)),
        {},
        {"ax": 9.80665 * np.array([0.0, 1.0, 2.0, 0.0]), "ay": [0.0, 1.0, 0.0, 1.0]},
        (),
    ),
}
"""By the file's name: its text, what is chosen, what it holds in SI units, and what is noted."""


@pytest.mark.parametrize("name", READ)
def test_what_is_read_of_a_text_and_what_is_noted(tmp_path, name):
    text, choices, channels, notes = READ[name]
    record = read_measurement(write(tmp_path, text, name=name), **choices)
    assert record.names == tuple(channels)
    for channel, values in channels.items():
        assert record[channel] == pytest.approx(values)
    for note in notes:
        assert note in "\n".join(record.notes)
