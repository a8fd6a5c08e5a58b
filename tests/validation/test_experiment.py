"""An experiment's folder: one's own, the packaged ones, and what is wrong with a folder."""

from __future__ import annotations

import csv
import io

import pytest

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.base.spec import float_paths
from tarsus.validation import experiment_names, load_experiment
from tarsus.validation.measured import RowCells
from tarsus.validation.verdict import ClaimOutcome
from validation.folders import drop_folder


def test_a_folder_of_ones_own(tmp_path):
    found = ts.validate(drop_folder(tmp_path / "drop"))
    assert found.ok and [one.outcome for one in found.verdicts] == [ClaimOutcome.HOLDS, ClaimOutcome.FAILS_AS_KNOWN]
    times = [one.computed for one in found.compared]
    assert times == pytest.approx([(2.0 * h / 9.81) ** 0.5 for h in (0.2, 0.45, 0.8)], rel=1e-12)
    assert found.compared[1].measured == pytest.approx(0.3028)  # the mean of two readings
    assert found.compared[0].spread == pytest.approx(1e-3)
    assert [one.row["who"] for one in found.outside()] == ["bob"]
    first = next(csv.DictReader(io.StringIO(found.csv())))
    assert first["unit"] == "s" and float(first["computed_si"]) == times[0]
    assert found.to_dict()["claims"][1]["outcome"] == "fails, as known"
    assert "time of fall" in str(found)


def test_without_a_band_no_number_is_outside(tmp_path):
    closes = ("within = { error = 0.001, share = 1.0 }", "closes = 1.0")
    assert ts.validate(drop_folder(tmp_path / "drop", claims=closes)).outside() == []


def test_a_row_is_added_to_the_table_without_columns_that_it_lacks(tmp_path):
    added = ("80,440,1,bob", "80,440,1,bob\n125,504.8")
    found = ts.validate(drop_folder(tmp_path / "drop", measured=added))
    assert len(found.compared) == 4 and abs(found.compared[3].error) < 1e-3 and found.compared[3].spread is None


@pytest.mark.parametrize(
    ("changes", "problems"),
    [
        ({"measured": ("# A. Author, drops, 2026\n", "")}, ["must cite"]),
        ({"measured": ("80,440", "80,fast")}, ["line 5: 'time_ms' should be a number, got 'fast'"]),
        ({"measured": ("time_ms", "time_us")}, ["no column 'time_ms'"]),
        ({"claims": ('who == "ann"', 'whom == "ann"')}, ["claims.ann.rows", "no column 'whom'"]),
        ({"claims": ('unit = "ms"', 'unit = "furlong"')}, ["unknown unit 'furlong'"]),
        ({"claims": ("[claims.ann]", '[parameters]\nfitted = ["ground.film.x"]\n[claims.ann]')}, ["parameters.fitted"]),
        ({"claims": ("[claims.ann]", '[claims.ann]\nof = "speed"')}, ["'speed' is no measured column"]),
        ({"claims": ("median_error = 0.01", 'mean_deviation = "1 mm"')}, ["claims.bob.mean_deviation", "a time"]),
        ({"claims": ("median_error = 0.01\n", "")}, ["claims.bob", "claims nothing"]),
        ({"study": ("def case(", "def cases(")}, ["defines no function case(row, device)"]),
        ({"study": ("gap = ", "gap = no_name * ")}, ["measured.csv, line 3", "study.py, line 6", "NameError"]),
        ({"study": ("robot.feet.ball.gap", "robot.feet.bal.gap")}, ["measured.csv, line 3", "bal"]),
        ({"study": ('"time_ms"', '"time_s"')}, ["reads 'time_s', which is no measured column"]),
        ({"study": ('touchdown(run, "ball")', 'touchdown(run, "bell")')}, ["measured.csv, line 3", "no foot 'bell'"]),
        ({"study": ("return RowCase", "return tuple")}, ["measured.csv, line 3"]),
        ({"study": ("import touchdown", "import touchdwn")}, ["study.py, line 1", "ImportError"]),
    ],
)
def test_what_is_wrong_with_a_folder(tmp_path, changes, problems):
    with pytest.raises(InputError) as caught:
        ts.validate(drop_folder(tmp_path / "drop", **changes))
    for said in problems:
        assert said in str(caught.value)


@pytest.mark.parametrize(("name", "said"), [("ball-dorp", "ball-drop"), ("", "valid names are 'ball-bounces'")])
def test_no_such_experiment(tmp_path, name, said):
    with pytest.raises(InputError, match=said):
        load_experiment(name or tmp_path)


@pytest.mark.parametrize(("name", "count"), [("mems-switch", 5), ("ball-drop", 40)])
def test_packaged_experiments_that_take_no_time(name, count):
    """All of them are in the lane of heavy tests."""
    found = ts.validate(name)
    assert found.ok and len(found.compared) == count and all(one.figures.rows for one in found.verdicts)


@pytest.mark.parametrize("name", experiment_names())
def test_every_number_of_a_packaged_device_says_where_it_comes_from(name):
    device = load_experiment(name).device
    assert [path for path in float_paths(device) if device.origin(path) is None] == []


def test_at_most_three_numbers_are_fitted_in_all():
    assert sum(len(load_experiment(name).claims.parameters.fitted) for name in experiment_names()) <= 3


@pytest.mark.parametrize(
    ("name", "row", "said"),
    [
        ("gap-closing-actuators", {"event": "pull_in"}, "the row has nothing in 'volts'"),
        ("gap-closing-actuators", {"event": "pullin", "volts": 40.0}, "no 'pullin'; did you mean 'pull_in'?"),
        ("gap-closing-actuators", {"event": "release", "medium": "oil"}, "no 'oil'; valid names are 'air', 'water'"),
        ("gap-closing-actuators", {"event": "release", "layout": "fwan"}, "no 'fwan'; did you mean 'fawn'?"),
        ("gap-closing-actuators", {"event": "release", "support_width_drawn_um": 0.5}, "etching takes 0.8 um"),
        ("hamr-e", {"pose": "wall", "pads": 2.0, "used_V": 250.0}, "'pads': there is no '2'"),
        ("impact-transport", {"trial": 1.5}, "paths.csv has no trial 1.5"),
        ("ball-on-table", {"restitution": 0.3, "acceleration_g": 0.5}, "it takes 1.69 g"),
    ],
)
def test_a_row_beyond_an_experiment_is_a_sentence(name, row, said):
    one = load_experiment(name)
    with pytest.raises(InputError, match=r"measured\.csv, line 9: ") as caught:
        one.study.case(RowCells(row), one.device, 9).scenes(one.device)
    assert said in str(caught.value)
