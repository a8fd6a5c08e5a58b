"""`tarsus validate`: exit codes, files, and what is refused."""

from __future__ import annotations

import pytest

from validation.folders import drop_folder


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


def test_an_experiment_is_shown_and_checked(tarsus, tmp_path):
    folder = drop_folder(tmp_path / "drop")
    assert tarsus("show", folder).code == 0
    assert "is a good experiment" in tarsus("check", folder).out
    drop_folder(folder, study=("def case(", "def cases("))
    result = tarsus("check", folder)
    assert result.code == 2 and "defines no function case(row, device)" in result.sentences[0]
