"""Every reader against the public library of its format, on files written with every option of the format.

A row is a `record_case.Case`: a name (which names the file, so that it ends in the format's suffix), a function that
writes the file at a path and returns what it holds (`record_case.Held`: channels by name with SI unit and SI values,
step, start), and the choices that the reader needs. The function writes by hand or by the format's library with one
option of the format set, and reads back by that library: npTDMS, lvm_read, csv, h5py, xarray, scipy or pyuff. What it
returns is what the library says, brought to SI by a factor written there by hand.

Each format has its rows in a module of its own beside `tests/record_case.py`, as a list CASES; to add a format, add
its module to the list below.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import array_files
import lvm_files
import matlab_files
import octave_files
import tdms_files
import text_files
import universal_files
from record_case import Case
from tarsus.records.readers import read_measurement

_FORMATS = (text_files, lvm_files, tdms_files, octave_files, universal_files, array_files, matlab_files)
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


def test_no_two_rows_have_one_name() -> None:
    assert len({case.name for case in CASES}) == len(CASES)
