"""`reproduce cantilever`: rows, summary and files."""

from __future__ import annotations

import csv
import json
import math

import pytest

EXTRA = "# two more\nfreq_hz,volt_v,wave,peak_exp_um\n20,8,square,210\n30,7,sine,\n"


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    """Both devices validated with two more rows: their JSON objects, and the folder written to."""
    from contextlib import redirect_stdout
    from io import StringIO

    from tarsus.cli import main

    folder = tmp_path_factory.mktemp("validation")
    rows = folder / "rows.csv"
    rows.write_text(EXTRA, encoding="utf-8")
    found = {}
    for device in ("cantilever", "cantilever-1"):
        out = StringIO()
        words = ["reproduce", "cantilever", "--device", device, "--rows", str(rows), "--json"]
        with redirect_stdout(out):
            assert main([*words, "-o", str(folder / device)]) == 0
        found[device] = json.loads(out.getvalue())
    return found, folder


@pytest.mark.parametrize("device", ["cantilever", "cantilever-1"])
def test_json(both, device):
    found, _ = both
    result = found[device]
    assert result["device"] == device
    assert len(result["rows"]) == 14
    for row in result["rows"]:
        assert {"freq_hz", "volt_v", "wave", "ours"} <= set(row)
        ours = row["ours"]
        assert set(ours) == {"bounces", "peak_um", "contact_ms"}
        assert all(math.isfinite(value) and value >= 0.0 for value in ours.values())
        assert ours["contact_ms"] <= 1e3 / row["freq_hz"] * (1.0 + 1e-9)
    packaged, added = result["rows"][:12], result["rows"][12:]
    assert all(row["measured"] and row["source"] for row in packaged)
    assert added[0]["measured"] == {"bounces": None, "peak_um": 210.0, "contact_ms": None}
    assert added[0]["errors"]["ours"]["peak"] == pytest.approx((210 - added[0]["ours"]["peak_um"]) / 210)
    assert added[1]["measured"] is None and added[1]["source"] is None


def test_summary_covers_all_rows_and_each_part(both):
    found, _ = both
    summary = found["cantilever"]["summary"]
    assert (summary["rows"], summary["packaged_rows"]["rows"], summary["added_rows"]["rows"]) == (14, 12, 2)
    assert summary["packaged_rows"]["source"]["peak"]["mean_signed_percent"] == pytest.approx(
        -8.2239, abs=1e-3
    )
    for model in ("source", "ours"):
        for quantity in ("peak", "contact"):
            table = summary["packaged_rows"][model][quantity]
            assert table["mean_absolute_percent"] >= abs(table["mean_signed_percent"])


def test_files(both):
    found, folder = both
    assert "<svg" in (folder / "cantilever" / "validation.html").read_text(encoding="utf-8")
    written = json.loads((folder / "cantilever" / "validation.json").read_text(encoding="utf-8"))
    assert written == found["cantilever"]
    with (folder / "cantilever" / "validation.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 14
    assert float(rows[0]["peak_um_ours"]) == found["cantilever"]["rows"][0]["ours"]["peak_um"]


def test_tables_for_people(tarsus):
    result = tarsus("reproduce", "cantilever")
    assert result.code == 0
    assert "5 Hz, 6 V, square" in result.out
    assert "mean error, absolute" in result.out
    assert "mean error, signed" in result.out
