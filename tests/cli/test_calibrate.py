"""`tarsus calibrate`: tables, JSON, report, resuming, and what it refuses."""

from __future__ import annotations

import json

import pytest

from calibrate.toys import ball_study


@pytest.fixture
def study(tmp_path):
    return ball_study(tmp_path, "50,1.5,14\n90,1,30\n120,,\n", generations=0, leave_out=True)


def test_a_calibration_prints_its_tables_and_goes_on_in_its_folder(tarsus, study, tmp_path, opened):
    out = tmp_path / "out"
    first = tarsus("calibrate", study, "-o", out)
    assert first.code == 0, first.err
    assert "ball: " in first.out and "hypotheses kept" in first.out and "ground" not in first.err
    assert {"branch-1.toml", "calibration.json", "mixture.json", "report.html"} <= {p.name for p in out.iterdir()}
    assert {"push", "e"} <= set(first.out.split())
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Calibration: ball" in page and "http://" not in page.replace("http://www.w3.org", "")
    table = json.loads((out / "calibration.json").read_text(encoding="utf-8"))
    assert [row["fitted"] for row in table["rows"]] == [True, True, False]
    assert set(table["rows"][0]["left_out"]) == {"rate", "height"}
    shown = opened(
        out, "fitted calibration", "device files: branch-1.toml", f"`tarsus report {out}`", "hypotheses kept"
    )
    assert shown | table == shown and opened(tmp_path, "folder of results")["folders"] == {"out": shown["is"]}
    again = tarsus("calibrate", study, "-o", out, "--resume", "--json")
    assert again.code == 0 and again.json() == table
    refused = tarsus("calibrate", study, "-o", out)
    assert refused.code == 2 and "--resume" in refused.sentences[0]
    begun = tarsus("calibrate", study, "-o", out, "--overwrite", "--json")
    assert begun.code == 0 and begun.json() == table
    other = tarsus("calibrate", study, "-o", out, "--resume", "--seed", "9")
    assert other.code == 2 and "another calibration" in other.sentences[0]


def test_a_study_that_is_none_is_refused_before_anything_is_written(tarsus, tmp_path):
    (tmp_path / "empty.py").write_text("def changes(unknowns, row):\n    return {}\n", encoding="utf-8")
    result = tarsus("calibrate", tmp_path / "empty.py", "-o", tmp_path / "out")
    assert result.code == 2 and not (tmp_path / "out").exists()
    said = " ".join(result.sentences)
    for word in ("table", "device", "conditions", "measures", "unknowns", "sampling"):
        assert word in said
