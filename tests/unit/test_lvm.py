"""The reader of LabVIEW files, on the shock records and on broken ones."""

from __future__ import annotations

from pathlib import Path

import pytest

import tarsus as ts
from tarsus.files.lvm import read_lvm
from tarsus.measurement import Channel, Quantity

SHOCK = Path(__file__).parents[1] / "data" / "shock"
BASE = Channel("accelerometer_base", Quantity.ACCELERATION)
COMMAND = Channel("excitation_composite", Quantity.VOLTAGE)


def test_a_shock_record():
    record = read_lvm(SHOCK / "shock_hit_0.5.lvm", [BASE, COMMAND])
    assert record.names == ("accelerometer_base", "excitation_composite")
    assert record.step == pytest.approx(0.605e-3)
    assert record.count == 12375  # the command goes on for longer; accelerations do not
    assert record["accelerometer_base"][:2].tolist() == [0.187271, 0.239985]
    assert record.source == "shock_hit_0.5.lvm"


def changed(tmp_path: Path, old: str, new: str) -> Path:
    lines = (SHOCK / "shock_hit_0.5.lvm").read_text(encoding="utf-8").splitlines()[:40]
    path = tmp_path / "record.lvm"
    path.write_text("\n".join(lines).replace(old, new), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("LabVIEW Measurement", "a table", "is no LabVIEW measurement file"),
        ("Separator,Comma", "Separator,Tab", "expected values separated by commas"),
        (
            "accelerometer_base",
            "accelerometer_bass",
            "no column 'accelerometer_base'; did you mean 'accelerometer_bass'",
        ),
        (
            "0.239985",
            "broken",
            "line 25: column 'accelerometer_base' has 'broken' where a number is expected",
        ),
        (",0.000605,", ",0.000905,", "record.lvm: the sampling is not even"),
        ("0.187271", "nan", "channel 'accelerometer_base' has 1 samples that are no finite number"),
    ],
)
def test_a_broken_file_says_where(tmp_path, old, new, said):
    with pytest.raises(ts.InputError, match=said):
        read_lvm(changed(tmp_path, old, new), [BASE])


def test_a_file_without_samples(tmp_path):
    path = changed(tmp_path, "", "")
    lines = path.read_text(encoding="utf-8").splitlines()
    path.write_text("\n".join(lines[:22]), encoding="utf-8")
    with pytest.raises(ts.InputError, match="ends after its header"):
        read_lvm(path, [BASE])
    with pytest.raises(ts.InputError, match="cannot read"):
        read_lvm(tmp_path / "none.lvm", [BASE])
