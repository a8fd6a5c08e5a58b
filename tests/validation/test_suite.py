"""The packaged experiments: their claims, their devices, and README's table, which is that of the suite today."""

from __future__ import annotations

import math

import pytest

import tarsus as ts
from doc_pages import ROOT
from example_files import load_file
from tarsus.base.pythonfile import execute
from tarsus.base.spec import float_paths, get_value
from tarsus.validation import Suite, experiment_names, load_experiment


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
                wanted = math.nan if known[key] is None else known[key]
                assert claim[key] == pytest.approx(wanted, rel=1e-3, abs=1e-7, nan_ok=True), (name, claim["name"], key)


def test_the_suite_is_whole(suite):
    assert suite.ok and list(suite.validations) == experiment_names()
    each = [(one.experiment.claims, row) for one in suite.validations.values() for row in one.compared]
    assert suite.numbers == sum(not claims.measured[row.column].formula for claims, row in each) > 400
    assert len(suite.table().rows) == sum(len(one.verdicts) for one in suite.validations.values())


@pytest.mark.parametrize("name", experiment_names())
def test_every_claim_comes_out_as_it_is_stated(suite, name):
    found = suite.validations[name]
    assert {one.name: one.outcome.value for one in found.verdicts if not one.outcome.expected} == {}
    assert all(one.figures.rows for one in found.verdicts)
    assert found.experiment.measured.cites and found.experiment.claims.source.cite


def test_the_devices_of_layouts_are_those_of_their_files():
    """Numbers that a study computes from print, and those of the device's file, which a reader sees first."""
    comb = load_experiment("gap-closing-actuators")
    row = {"event": "pull_in", "series": "finger_length", "overlap_um": 76.5, "volts": 60.0}
    (made,) = comb.study.case(row, comb.device, 0).scenes(comb.device)
    for path, value in float_paths(comb.device).items():
        assert get_value(made, path) == pytest.approx(value.value, rel=1e-8), path
    film = load_experiment("pvdf-robot")
    structure = film.device.robot.structure
    for name, place in execute(film.study.defined.file, "").standing().items():
        held = structure.links.get(name) or structure.places[name]
        assert (held.x, held.z) == pytest.approx(place, rel=1e-9), name
