"""The reader of tables in text: separators, decimal commas, names, units, complex values."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import tarsus as ts
from tarsus.records.measurement import Quantity
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


@pytest.mark.parametrize("encoding", ["latin-1", "utf-8", "utf-8-sig", "utf-16"])
def test_ascii_of_a_vibrometer(tmp_path, encoding):
    record = read_measurement(write(tmp_path, POLYTEC, encoding))
    assert record.names == ("Velocity", "Reference")
    assert record["Velocity"] == pytest.approx([-15e-6, 20e-6, 40e-6, 10e-6])
    assert record.channel("Velocity").quantity is Quantity.VELOCITY
    assert record.drive == "Reference" and record.step == pytest.approx(1e-3)


@pytest.mark.parametrize(
    "text",
    [
        "t [ms],tip (mm/s),volts [V]\n0,1,2\n0.5,3,4\n1.0,5,7\n",
        "t [ms];tip [mm/s];volts [V]\n0;1;2\n0,5;3;4\n1,0;5;7\n",
        '"t [ms]"\t"tip [mm/s]"\t"volts [V]"\n0\t1\t2\n0.5\t3\t4\n1.0\t5\t7\n',
        "recorded yesterday, 12 V\nt,tip,volts\nms,mm/s,V\n0,1,2,\n0.5,3,4,\n1.0,5,7,\n",
    ],
)
def test_tables(tmp_path, text):
    record = read_measurement(write(tmp_path, text, name="record.csv"))
    assert record.names == ("tip", "volts")
    assert record.step == pytest.approx(0.5e-3)
    assert record["tip"] == pytest.approx([1e-3, 3e-3, 5e-3]) and record["volts"].tolist() == [2.0, 4.0, 7.0]


def test_a_last_line_without_its_end_is_told(tmp_path):
    cut = POLYTEC.rstrip()
    assert "its last line has no line end" in "\n".join(read_measurement(write(tmp_path, cut)).notes)
    fixed = POLYTEC.replace("\t0,5\n", "\t0,500\n").replace("\t1,0\n", "\t1,000\n").replace("\t0,0\n", "\t0,000\n")
    with pytest.raises(ts.InputError, match=r"record.txt is truncated: its last number '-1,0' is cut"):
        read_measurement(write(tmp_path, fixed.rstrip()))


def test_a_table_without_names(tmp_path):
    path = write(tmp_path, "0.0 1.0\n0.1 3.0\n0.2 2.0\n")
    record = read_measurement(path, channels={"column 2": {"unit": "um", "name": "tip"}}, axis="column 1")
    assert record["tip"] == pytest.approx([1e-6, 3e-6, 2e-6]) and record.step == pytest.approx(0.1)


def test_a_rate_in_the_header(tmp_path):
    text = "Sample rate: 2 kHz\nSamples: 3\ntip [m/s];volts [V]\n1;2\n3;4\n5;7\n"
    assert read_measurement(write(tmp_path, text)).step == pytest.approx(0.5e-3)
    with pytest.raises(
        ts.InputError, match=r"record.txt is truncated: channel 'tip' has 3 values where the file announces 4"
    ):
        read_measurement(write(tmp_path, text.replace("Samples: 3", "Samples: 4")))
    timed = "Sample rate: 2 kHz\nt [s];tip [m/s]\n0.000;2\n0.001;4\n0.002;7\n0.003;1\n"
    said = r"\('Sample rate: 2 kHz'\) says one sample every 0\.0005 s .* the column 't' has one every 0\.001"
    with pytest.raises(ts.InputError, match=said):
        read_measurement(write(tmp_path, timed))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("2,000E+01", "NaN", "channel 'Velocity' has 1 gap: 1 samples are no finite number, the first at sample 1"),
        ("2,000E+01", "", "channel 'Velocity' has 1 gap"),
        ("4,000E+01", "4,0x", "line 9: column 'Velocity' has '4,0x' where a number is expected"),
        ("\t1,000E+01\t-1,0\n", "", "record.txt is truncated: its last line 10 has 1 of 3 columns"),
        ("2,000E-03\t4,000E+01\t0,0\n", "", "the sampling is not even"),
        ("3,000E-03", "2,000E-03", "the times do not increase at sample 3"),
        ("[ µm/s ]", "[ furlong ]", "nothing says what channel 'Velocity' measures \\('furlong' is no unit"),
    ],
)
def test_wrong_data_name_file_channel_and_cause(tmp_path, old, new, said):
    with pytest.raises(ts.InputError, match=said):
        read_measurement(write(tmp_path, POLYTEC.replace(old, new)), channels=["Velocity", "Reference"])


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
    with pytest.raises(ts.InputError, match="it holds frequency responses: read them with read_response"):
        read_measurement(REAL / f"pyuff_meas_point_{point}.txt")


def test_a_phase_without_its_unit_is_refused(tmp_path):
    text = "Frequency [Hz],FRF Magnitude [m/s/N],FRF Phase\n1,2,3\n2,3,4\n"
    with pytest.raises(ts.InputError, match=r"record.txt: column 'FRF Phase' is a phase, but nothing says whether"):
        read_response(write(tmp_path, text))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("t [s],tip [m/s]\n0,000,1,5\n0,001,2,5\n0,002,4,5\n", "commas part cells and decimals alike"),
        ("Sample Interval,2e-05,s\nTime,tip\ns,mm/s\n0,1\n1e-5,2\n2e-5,4\n", "one sample every 2e-05 s"),
        ("Time,A\n(ms),(mm/s)\n0,1\n1,\u221e\n2,3\n", "channel 'A' has 1 gap"),
        ("time (s),tip (m/s)\n0,1\n1,9.91E+37\n2,3\n", "channel 'tip' has 1 gap"),
        ("time (s),tip (mhz)\n0,1\n1,2\n2,3\n", "nothing says what channel 'tip \\(mhz\\)' measures"),
    ],
)
def test_what_a_table_leaves_open_is_refused(tmp_path, text, said):
    with pytest.raises(ts.InputError, match=said):
        read_measurement(write(tmp_path, text, name="record.csv"))


def test_one_column_with_decimal_commas(tmp_path):
    text = "Sample rate: 1 kHz\ntip [mm/s]\n0,5\n1,25\n-3,5\n"
    assert read_measurement(write(tmp_path, text))["tip"] == pytest.approx([0.5e-3, 1.25e-3, -3.5e-3])


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
    with pytest.raises(ts.InputError, match="is truncated: its last line 6 has 2 of 3 columns"):
        read_measurement(write(tmp_path, text.removesuffix(",\n") + "\n", name="record.csv"))


def test_marks_of_thousands_that_may_be_decimal_commas_are_refused(tmp_path):
    text = '"t (us)","tip (um/s)"\n"0","1,000"\n"20","1,001"\n"40","1,003"\n'
    with pytest.raises(ts.InputError, match="'1,000' has a decimal comma or one of thousands"):
        read_measurement(write(tmp_path, text, name="record.csv"))


def test_more_rows_than_the_header_announces(tmp_path):
    rows = "".join(f"{i % 3},{i}\n" for i in range(6))
    path = write(tmp_path, "Sample rate: 1 kHz\nSamples: 3\ntip [mm/s],drive [V]\n" + rows, name="record.csv")
    with pytest.raises(ts.InputError, match="holds 2 records, 6 samples in all, though its one header announces 3"):
        read_measurement(path)
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
