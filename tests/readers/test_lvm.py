"""The reader of LabVIEW files, on the shock records and on broken ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tarsus.records.measurement import Quantity
from tarsus.records.readers import read_measurement

SHOCK = Path(__file__).parents[1] / "data" / "shock"
CHANNELS = {"accelerometer_base": "m/s^2", "excitation_composite": "V"}


def test_a_shock_record():
    record = read_measurement(SHOCK / "shock_hit_0.5.lvm", channels=CHANNELS, axis="time")
    assert record.names == ("accelerometer_base", "excitation_composite")
    assert record.step == pytest.approx(0.605e-3)
    assert record.count == 12375  # the command goes on for longer; accelerations do not
    assert record["accelerometer_base"][:2].tolist() == [0.187271, 0.239985]
    assert record.channel("accelerometer_base").quantity is Quantity.ACCELERATION
    assert record.source == "shock_hit_0.5.lvm"
    assert record.drive == "excitation_composite"
    assert read_measurement(SHOCK / "shock_hit_0.5.lvm", channels=CHANNELS, step="0.6 ms").step == 0.6e-3
    notes = "\n".join(record.notes)
    assert "taken in m/s^2 as chosen; the file says 's'" in notes
    assert "the header says one sample every 0.000586 s for 'accelerometer_base'" in notes
    assert "not chosen: 'excitation_vibration', 'excitation_shock', 'accelerometer_board'" in notes


def test_columns_that_go_on_are_told():
    record = read_measurement(
        SHOCK / "shock_hit_0.5.lvm", channels={**CHANNELS, "excitation_vibration": "V"}, axis="time"
    )
    assert record.count == 12375 and record.drive is None
    assert "'excitation_vibration' goes on for 841 samples after the shortest" in "\n".join(record.notes)


def changed(tmp_path: Path, old: str, new: str) -> Path:
    lines = (SHOCK / "shock_hit_0.5.lvm").read_text(encoding="utf-8").splitlines()[:40]
    text = "\n".join(lines).replace("Samples,12376,13216,13216,12375,12375,12375", "Samples" + 6 * ",17")
    path = tmp_path / "record.lvm"
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path


HEADER = """LabVIEW Measurement\t
Separator\tTab
Decimal_Separator\t{decimal}
X_Columns\t{columns}
***End_of_Header***\t
\t
Channels\t2\t\t
Samples\t3\t3\t
Y_Unit_Label\tVolts\tmm/s\t
X_Dimension\tTime\tTime\t
Delta_X\t1{decimal}000000E-3\t1{decimal}000000E-3\t
***End_of_Header***\t\t
"""


def test_more_samples_than_announced_are_further_records(tmp_path):
    head = HEADER.format(columns="No", decimal=".") + "X_Value\tdrive\ttip\n"
    rows = "".join(f"\t{i % 3}.5\t{i}.0\n" for i in range(6))
    path = tmp_path / "record.lvm"
    path.write_text(head + rows, encoding="utf-8")
    assert read_measurement(path, record=2)["tip"] == pytest.approx([3e-3, 4e-3, 5e-3])
    joined = read_measurement(path, record=0)
    assert joined.count == 6 and "2 records are joined, as chosen" in "\n".join(joined.notes)
    timed = HEADER.format(columns="One", decimal=".") + "X_Value\tdrive\ttip\n"
    path.write_text(timed + "".join(f"{i / 1000}\t{i % 3}.5\t{i}.0\n" for i in range(6)), encoding="utf-8")
    notes = "\n".join(read_measurement(path).notes)
    assert "announces 3 samples, and 6 follow, whose times go on: all are used" in notes


def test_a_header_with_an_empty_cell_for_every_column_of_times(tmp_path):
    head = (
        "LabVIEW Measurement\t\nSeparator\tTab\nX_Columns\tMulti\n***End_of_Header***\t\n\t\nChannels\t2\t\t\t\t\n"
        "Samples\t4\t\t4\t\nY_Unit_Label\tg\t\tm/s^2\t\nX_Dimension\tTime\t\tTime\t\nDelta_X\t0.25\t\t0.25\t\n"
        "***End_of_Header***\t\t\t\t\nX_Value\tax\tX_Value\tay\tComment\n"
    )
    rows = "".join(f"{0.25 * i:.6f}\t{i % 3:.6f}\t{0.25 * i:.6f}\t{i % 2:.6f}\n" for i in range(4))
    path = tmp_path / "multi.lvm"
    path.write_text(head + rows, encoding="utf-8")
    record = read_measurement(path)
    assert record.names == ("ax", "ay") and record.step == pytest.approx(0.25)
    assert record["ax"] == pytest.approx(9.80665 * np.array([0.0, 1.0, 2.0, 0.0]))
    assert record["ay"] == pytest.approx([0.0, 1.0, 0.0, 1.0])
