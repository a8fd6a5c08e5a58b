"""TDMS files that are cut, or hold channels that cannot be read."""

from __future__ import annotations

import pytest

import tarsus as ts
from tarsus.records.readers import read_measurement
from tdms_files import CASES

WHOLE = {case.name: case.write for case in CASES}


@pytest.mark.parametrize("name", ["writer.tdms", "five segments.tdms", "big endian.tdms", "interleaved.tdms"])
@pytest.mark.parametrize("left", [0.3, 0.7, 0.97, -1])
def test_a_file_that_is_cut_says_so(tmp_path, capfd, name, left):
    path = tmp_path / name
    WHOLE[name](path)
    content = path.read_bytes()
    path.write_bytes(content[: left if left < 0 else int(left * len(content))])
    with pytest.raises(ts.InputError, match="is truncated"):
        read_measurement(path)
    assert capfd.readouterr().err == ""


def test_a_cut_header_of_a_further_segment_is_told(tmp_path):
    path = tmp_path / "record.tdms"
    WHOLE["big endian.tdms"](path)
    content = path.read_bytes()
    for more in (10, 28, 90):
        path.write_bytes(content + content[:more])
        with pytest.raises(ts.InputError, match="is truncated: its last segment does not end"):
            read_measurement(path)


def test_an_index_file_of_another_record_beside_it_does_not_count(tmp_path):
    path = tmp_path / "record.tdms"
    WHOLE["writer.tdms"](path)
    (tmp_path / "record.tdms_index").write_bytes(b"TDSh" + path.read_bytes()[4:90])
    assert read_measurement(path).count == 32
