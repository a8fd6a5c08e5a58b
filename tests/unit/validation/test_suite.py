"""The table of README is that of the suite as it runs today."""

from __future__ import annotations

import pytest

import tarsus as ts
from example_files import load_file
from tarsus.validation import Suite, experiment_names
from unit.doc_pages import ROOT


@pytest.fixture(scope="module")
def suite() -> Suite:
    return ts.validate()


def test_the_kept_results_are_those_of_the_suite(suite):
    """Figures to 0.1 %: machines differ in rounding, and errors of closed forms are rounding alone."""
    figures = load_file(ROOT / "docs" / "figures.py")
    kept = figures.result("validation")
    now = figures.kept_validation(suite.to_dict(), ROOT)
    assert set(now["experiments"]) == set(kept["experiments"]) and now["numbers"] == kept["numbers"]
    for name, one in now["experiments"].items():
        for claim, known in zip(one["claims"], kept["experiments"][name]["claims"], strict=True):
            exact = ("name", "of", "rows", "seen", "outcome")
            assert {key: claim[key] for key in exact} == {key: known[key] for key in exact}
            for key in ("median_error", "bias"):
                assert claim[key] == pytest.approx(known[key], rel=1e-3, abs=1e-7), (name, claim["name"], key)


def test_the_suite_is_whole(suite):
    assert suite.ok and list(suite.validations) == experiment_names()
    assert (
        suite.numbers == sum(len(one.compared) for one in suite.validations.values()) - 20
    )  # those of closed forms
    assert len(suite.table().rows) == sum(len(one.verdicts) for one in suite.validations.values())
