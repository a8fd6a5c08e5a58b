"""`tarsus validate`: exit codes, files, and what is refused."""

from __future__ import annotations

import json

import pytest

from validation.folders import drop_folder


def test_a_folder_with_its_files(tarsus, tmp_path):
    words = ("validate", drop_folder(tmp_path / "drop"), "-o", tmp_path / "out")
    result = tarsus(*words)
    assert result.code == 0 and "fails, as known" in result.out
    found = json.loads((tmp_path / "out" / "validation.json").read_text(encoding="utf-8"))
    assert [one["outcome"] for one in found["claims"]] == ["holds", "fails, as known"]
    assert (tmp_path / "out" / "validation.csv").read_text(encoding="utf-8").count("\n") == 4
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "Rows outside the bands" in page and "height cm 80, bob" in page
    shown = tarsus("show", tmp_path / "out")
    assert shown.code == 0 and "a validation" in shown.out


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("error = 0.001", "error = 0.00001"), "'ann' fails"),
        (("median_error = 0.01", "median_error = 0.5"), "'bob' holds, though it is known to fail"),
    ],
)
def test_a_claim_that_comes_out_otherwise_is_a_failure(tarsus, tmp_path, change, said):
    result = tarsus("validate", drop_folder(tmp_path / "drop", claims=change))
    assert result.code == 1
    assert [one for one in result.sentences if said in one]


def test_a_claim_without_rows_is_said(tarsus, tmp_path):
    result = tarsus("validate", drop_folder(tmp_path / "drop", claims=('who == "bob"', 'who == "eve"')))
    assert result.code == 0 and any("selects no rows and is not judged" in one for one in result.sentences)


@pytest.mark.parametrize("words", [(), ("ball-drop", "--all")])
def test_one_experiment_or_all(tarsus, words):
    result = tarsus("validate", *words)
    assert result.code == 2 and "name an experiment (ball-bounces, ball-drop" in result.sentences[0]


def test_an_experiment_is_shown_and_checked(tarsus, tmp_path):
    folder = drop_folder(tmp_path / "drop")
    assert tarsus("show", folder).code == 0
    assert "is a good experiment" in tarsus("check", folder).out
    drop_folder(folder, study=("def case(", "def cases("))
    result = tarsus("check", folder)
    assert result.code == 2 and "defines no function case(row, device)" in result.sentences[0]
