"""The reader of tables in text: separators, decimal commas, names, units, complex values."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

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


def test_a_last_line_without_its_end_is_told(tmp_path):
    cut = POLYTEC.rstrip()
    assert "its last line has no line end" in "\n".join(read_measurement(write(tmp_path, cut)).notes)


def test_a_table_without_names(tmp_path):
    path = write(tmp_path, "0.0 1.0\n0.1 3.0\n0.2 2.0\n")
    record = read_measurement(path, channels={"column 2": {"unit": "um", "name": "tip"}}, axis="column 1")
    assert record["tip"] == pytest.approx([1e-6, 3e-6, 2e-6]) and record.step == pytest.approx(0.1)


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


def test_a_column_that_counts_and_one_without_numbers_are_told(tmp_path):
    text = "Index,Time (s),tip (mm/s),Marker\n0,0.0,1,\n1,0.1,2,\n2,0.2,4,\n"
    record = read_measurement(write(tmp_path, text, name="record.csv"))
    assert record.names == ("tip",) and record.step == pytest.approx(0.1)
    notes = "\n".join(record.notes)
    assert "'Index' counts the samples: not used" in notes and "'Marker' holds no numbers: not used" in notes


def test_a_column_that_ends_early_is_no_cut_file(tmp_path):
    text = "time (s),tip (mm/s),drive (V)\n0.0,1,1\n0.1,2,2\n0.2,4,1\n0.3,3,\n0.4,1,\n"
    record = read_measurement(write(tmp_path, text, name="record.csv"))
    assert record.count == 3 and "'tip' goes on for 2 samples" in "\n".join(record.notes)


def test_more_rows_than_the_header_announces(tmp_path):
    rows = "".join(f"{i % 3},{i}\n" for i in range(6))
    path = write(tmp_path, "Sample rate: 1 kHz\nSamples: 3\ntip [mm/s],drive [V]\n" + rows, name="record.csv")
    assert read_measurement(path, record=2)["drive"].tolist() == [3.0, 4.0, 5.0]
    timed = "Samples: 3\nt [s],tip [mm/s]\n" + "".join(f"0.{i},{i % 3}\n" for i in range(6))
    record = read_measurement(write(tmp_path, timed, name="timed.csv"))
    assert record.count == 6 and "announces 3 samples, and 6 follow, whose times go on" in "\n".join(record.notes)


def test_words_below_the_numbers_are_no_cut_line(tmp_path):
    text = "t (s),tip (mm/s)\n0.0,1\n0.1,2\n0.2,4\n\nMean,2.33\nEnd of file\n"
    record = read_measurement(write(tmp_path, text, name="record.csv"))
    assert record.count == 3 and "not used: its last lines, from 'Mean,2.33' on" in "\n".join(record.notes)


def test_two_columns_of_one_name_are_told_apart(tmp_path):
    record = read_measurement(write(tmp_path, "t (s),a (V),a (V)\n0,1,2\n1,2,3\n2,4,1\n", name="record.csv"))
    assert record.names == ("a", "a (column 3)") and record["a (column 3)"].tolist() == [2.0, 3.0, 1.0]
