"""Every reader against the public library of its format, on files written with every option of the format.

A row is a `record_case.Case`: a name (which names the file, so that it ends in the format's suffix), a function that
writes the file at a path and returns what it holds (`record_case.Held`: channels by name with SI unit and SI values,
step, start), and the choices that the reader needs. The function writes by hand or by the format's library with one
option of the format set, and reads back by that library: npTDMS, lvm_read, csv, h5py, xarray, scipy, pyuff or wave.
What it returns is what the library says, brought to SI by a factor written there by hand.

Each format has its rows in a module of its own beside `tests/record_case.py`, as a list CASES; to add a format, add
its module to the list below.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import pyuff

import array_files
import lvm_files
import matlab_files
import octave_files
import sound_files
import tdms_files
import text_files
import universal_files
from record_case import Case
from tarsus.formats.content import formats
from tarsus.records.readers import read_measurement, read_response

_FORMATS = (text_files, lvm_files, tdms_files, octave_files, universal_files, array_files, matlab_files, sound_files)
CASES = [case for one in _FORMATS for case in one.CASES]


@pytest.mark.parametrize("case", CASES, ids=[case.name for case in CASES])
def test_a_file_is_read_as_its_own_library_reads_it(tmp_path: Path, case: Case) -> None:
    path = tmp_path / case.name
    held = case.write(path)
    record = read_measurement(path, **case.choices)
    assert list(record.names) == list(held.channels)
    for name, (unit, values) in held.channels.items():
        assert record.channel(name).quantity.unit == unit
        scale = np.abs(values).max()
        np.testing.assert_allclose(record[name], values, rtol=held.digits, atol=held.digits * scale, err_msg=name)
    assert record.step == pytest.approx(held.step, rel=1e-9)
    assert record.start == pytest.approx(held.start, abs=1e-6 * held.step)


@pytest.mark.parametrize("order", ["", "<", ">"], ids=["text", "little", "big"])
@pytest.mark.parametrize("double", [False, True])
@pytest.mark.parametrize("uneven", [False, True])
@pytest.mark.parametrize("real", [False, True])
def test_frequency_responses_of_universal_files(
    tmp_path: Path, order: str, double: bool, uneven: bool, real: bool
) -> None:
    values = universal_files.TIP + (0.0 if real else 1j * universal_files.DRIVE)
    values = values if real else np.asarray(values, dtype=complex)
    path = tmp_path / "frf.uff"
    path.write_bytes(
        universal_files.function58(
            values, 3, -2, label="mm/s", double=double, uneven=uneven, order=order, reference=(5, 3)
        )
    )
    read, held = read_response(path), pyuff.UFF(str(path)).read_sets()
    assert isinstance(held, dict)
    assert [one.name for one in read.outputs] == ["3-Y"] and [one.name for one in read.inputs] == ["5+Z"]
    assert read.unit == (("m/s / N",),)
    np.testing.assert_allclose(read.values[0, 0], 1e-3 * held["data"], rtol=1e-12)
    np.testing.assert_allclose(read.frequency, held["x"], rtol=1e-12, atol=1e-15)


def test_every_format_has_a_row() -> None:
    """By the first of its suffixes, one that has any."""
    written = {Path(case.name).suffix for case in CASES}
    assert {one.suffixes[0] for one in formats() if one.suffixes} <= written


def test_no_two_rows_have_one_name() -> None:
    assert len({case.name for case in CASES}) == len(CASES)
