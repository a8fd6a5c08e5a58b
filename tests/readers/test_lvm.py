"""The reader of LabVIEW files, on the shock records and on broken ones."""

from __future__ import annotations

from pathlib import Path

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
    more = read_measurement(
        SHOCK / "shock_hit_0.5.lvm", channels={**CHANNELS, "excitation_vibration": "V"}, axis="time"
    )
    assert more.count == 12375 and more.drive is None
    assert "'excitation_vibration' goes on for 841 samples after the shortest" in "\n".join(more.notes)


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
