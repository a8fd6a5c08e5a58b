"""`reproduce cantilever`: rows, summary and files."""

from __future__ import annotations

import csv
import json
import math
from functools import cache
from pathlib import Path

import pytest

EXTRA = "# two more\nfreq_hz,volt_v,wave,peak_exp_um\n20,8,square,210\n30,7,sine,\n"


@pytest.fixture(scope="module")
def rows(tmp_path_factory) -> Path:
    """A file of two more rows."""
    file = tmp_path_factory.mktemp("reproduction") / "rows.csv"
    file.write_text(EXTRA, encoding="utf-8")
    return file


@pytest.fixture(scope="module")
def written(rows, reproduced_once):
    """`written(device)`: reproduced with two more rows: its JSON object, and the folder written to."""
    from contextlib import redirect_stdout
    from io import StringIO

    from tarsus.cli import main

    def reproduced(device: str):
        out, folder = StringIO(), rows.parent / device
        words = ["reproduce", "cantilever", "--device", device, "--rows", str(rows), "--json"]
        with redirect_stdout(out):
            assert main([*words, "-o", str(folder)]) == 0
        return json.loads(out.getvalue()), folder

    return cache(reproduced)


# Slow: all rows of a second device. The first stays.
@pytest.mark.parametrize("device", ["cantilever", pytest.param("cantilever-1", marks=pytest.mark.slow)])
def test_json(written, device):
    result, _ = written(device)
    assert result["device"] == device
    assert len(result["rows"]) == 14
    for row in result["rows"]:
        assert {"freq_hz", "volt_v", "wave", "ours"} <= set(row)
        ours = row["ours"]
        assert set(ours) == {"bounces", "peak_um", "contact_ms"}
        for one in ours.values():
            assert set(one) == {"median", "low", "high"}
            assert 0.0 <= one["low"] <= one["median"] <= one["high"] < math.inf
        assert ours["contact_ms"]["high"] <= 1e3 / row["freq_hz"] * (1.0 + 1e-9)
        assert 0.0 <= row["p_bounce"] <= 1.0
        assert row["p_bounce"] > 0.5 or ours["bounces"]["median"] < 1.0
    packaged, added = result["rows"][:12], result["rows"][12:]
    assert [row["role"] for row in result["rows"]] == ["calibrated on"] * 12 + ["predicted"] * 2
    assert all(row["measured"] and row["source"] for row in packaged)
    assert added[0]["measured"] == {"bounces": None, "peak_um": 210.0, "contact_ms": None}
    assert added[0]["errors"]["ours"]["peak"] == pytest.approx(
        (210 - added[0]["ours"]["peak_um"]["median"]) / 210
    )
    assert added[1]["measured"] is None and added[1]["source"] is None


def test_summary_covers_all_rows_and_each_part(written):
    summary = written("cantilever")[0]["summary"]
    assert (summary["rows"], summary["packaged_rows"]["rows"], summary["added_rows"]["rows"]) == (14, 12, 2)
    assert summary["packaged_rows"]["source"]["peak"]["mean_signed_percent"] == pytest.approx(
        -8.2239, abs=1e-3
    )
    for model in ("source", "ours"):
        for quantity in ("peak", "contact"):
            table = summary["packaged_rows"][model][quantity]
            assert table["mean_absolute_percent"] >= abs(table["mean_signed_percent"])


def test_files(written):
    result, folder = written("cantilever")
    assert "<svg" in (folder / "reproduction.html").read_text(encoding="utf-8")
    assert json.loads((folder / "reproduction.json").read_text(encoding="utf-8")) == result
    with (folder / "reproduction.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 14
    ours = result["rows"][0]["ours"]["peak_um"]
    assert [float(rows[0][f"peak_um_ours{end}"]) for end in ("", "_low", "_high")] == [
        ours[name] for name in ("median", "low", "high")
    ]


def test_tables_for_people(tarsus, rows, reproduced_once):
    result = tarsus("reproduce", "cantilever", "--device", "cantilever", "--rows", rows)
    assert result.code == 0
    assert "5 Hz, 6 V, square" in result.out
    assert "mean error, absolute" in result.out
    assert "mean error, signed" in result.out
