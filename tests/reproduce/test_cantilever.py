"""The reproduction's arithmetic, checked on the source's own model, whose errors the source prints."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import replace

import numpy as np
import pytest

import tarsus as ts
from tarsus.calibrate.prediction import Discrepancy
from tarsus.calibrate.skill import naive_errors
from tarsus_reproduce.cantilever import PERIODS, reproduce_cantilever
from tarsus_reproduce.compared import merits_of
from tarsus_reproduce.ensembles import device_ensemble, packaged_ensemble, packaged_errors
from tarsus_reproduce.rows import CANTILEVER, PrintedRow, packaged_rows

BOUNCES, PEAK, CONTACT = CANTILEVER.quantities


def of_source(one):
    """Numbers of Table A.1 with those of the source's model."""
    return [(row.seen("measured", one), row.seen("source", one)) for row in packaged_rows(CANTILEVER)]


def test_errors_are_those_printed_in_table_a1():
    printed = {  # (peak, contact) in percent as printed, but for two signs of peaks (see the errata page)
        (5, 6, "square"): (-13, 1),
        (5, 8, "square"): (-25, -2),
        (5, 8, "sine"): (7, 12),
        (15, 6, "square"): (8, 0),
        (15, 6, "sine"): (8, 70),
        (15, 8, "square"): (-24, -3),
        (50, 6, "square"): (-32, 47),
        (50, 6, "sine"): (-21, 67),
        (50, 8, "sine"): (8, 21),
        (100, 6, "sine"): (15, 78),
        (100, 8, "square"): (-36, -35),
        (100, 8, "sine"): (9, -13),
    }
    for row in packaged_rows(CANTILEVER):
        for one, percent in zip((PEAK, CONTACT), printed[(row.freq_hz, row.volt_v, row.wave)], strict=True):
            error = one.error(row.seen("measured", one), row.seen("source", one))
            assert 100 * error == pytest.approx(percent, abs=1.01)


def test_summary_of_the_sources_model_on_the_packaged_rows():
    bounces, peak, contact = (merits_of(one, of_source(one)) for one in CANTILEVER.quantities)
    assert (bounces["existence_right"], bounces["close"], bounces["cases"]) == (12, 8, 12)
    assert bounces["mean_absolute_error"] == pytest.approx(4.5 / 12)
    assert (peak["close"], peak["cases"]) == (10, 12)
    assert (contact["close"], contact["cases"]) == (7, 12)
    assert peak["mean_error"] == pytest.approx(-0.082239, abs=1e-5)
    assert contact["mean_error"] == pytest.approx(0.202814, abs=1e-5)
    assert peak["mean_absolute_error"] > abs(peak["mean_error"])


def test_counts_need_half_a_bounce_and_empty_cells_do_not_count():
    bounces = merits_of(BOUNCES, [(1.0, 1.4), (0.0, 0.6), (1.5, 1.0), (None, 3.0)])
    peak = merits_of(PEAK, [(None, None)])
    assert (bounces["cases"], bounces["close"], bounces["existence_right"]) == (3, 1, 2)
    assert (peak["cases"], peak["mean_error"]) == (0, None)


def test_contact_where_none_was_measured_is_a_miss_and_not_excluded():
    contact = merits_of(CONTACT, [(0, 5), (10, 8), (0, 0)])
    assert (contact["cases"], contact["in_means"], contact["close"]) == (3, 2, 2)
    assert contact["mean_absolute_error"] == pytest.approx(0.1)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """The best device on all rows, and on two of a file: one that is the first packaged row with another peak."""
    rows = tmp_path_factory.mktemp("rows") / "mine.csv"
    rows.write_text("5,6,square,2,3,211,100,97,98\n100,6,square\n", encoding="utf-8")
    return reproduce_cantilever("cantilever", rows=rows)


def test_rows_of_a_file_are_predicted_and_a_changed_number_changes_what_is_said(found):
    data = found.to_dict()
    assert found.ok and [row["role"] for row in data["rows"]] == ["calibrated on"] * 12 + ["predicted"] * 2
    first, mine, bare = data["rows"][0], data["rows"][12], data["rows"][13]
    assert mine["ours"] == first["ours"], "the same drive"
    assert mine["errors"]["ours"]["peak_um"] == pytest.approx(1.0 - first["ours"]["peak_um"]["median"] / 100.0)
    assert bare["measured"] is None and bare["errors"]["ours"]["peak_um"] is None
    shown = next(table for table in found.table().parts if table.title.startswith("Table A.1"))
    held = {(row[0], row[2]): row[-1] for row in shown.rows if row[0]}
    assert ("5 Hz, 6 V, square *", "bounces per period") in held
    peaks = [(row[3], row[-1]) for row in shown.rows if row[2] == "peak after break-off"]
    assert peaks[12] == (pytest.approx(100e-6), False) and peaks[13] == (None, None)
    summary = data["summary"]
    assert (summary["of the table"]["rows"], summary["predicted"]["rows"]) == (12, 2)
    for name, rows in (("peak_um", 12), ("contact_ms", 11)):  # a contact measured as 0 has no relative error
        assert summary["of the table"]["ours"][name]["in_means"] == rows


def test_skill_is_that_against_predictors_that_know_the_other_rows_alone(found):
    """By hand: of the peaks of Table A.1 and of the file's row, the mean of the others, the nearest, a power law."""
    data = found.to_dict()
    rows = [row for row in data["rows"] if row["measured"]]
    peaks = np.array([row["measured"]["peak_um"] for row in rows])
    conditions = [{name: row[name] for name in ("wave", "volt_v", "freq_hz")} for row in rows]
    least = min(naive_errors(peaks, conditions).values())
    found_error = np.mean([abs(row["errors"]["ours"]["peak_um"]) for row in rows])
    assert data["summary"]["all rows"]["ours"]["peak_um"]["skill"] == pytest.approx(1.0 - found_error / least)
    alone = data["summary"]["predicted"]["ours"]["peak_um"]["skill"]
    assert alone < data["summary"]["calibrated on"]["ours"]["peak_um"]["skill"]
    assert data["summary"]["predicted"]["source"]["contact_ms"]["skill"] is None, "the nearest row has the same contact"


def test_the_file_has_a_line_for_every_number_with_ends_of_the_intervals(found):
    rows = list(csv.DictReader(io.StringIO(found.csv())))
    assert len(rows) == 14 * 4
    peaks = [row for row in rows if row["quantity"] == "peak after break-off"]
    for row, plain in zip(peaks, found.to_dict()["rows"], strict=True):
        ends = [1e6 * float(row[name]) for name in ("Tarsus", "80 % interval from", "80 % interval to")]
        assert ends == pytest.approx([plain["ours"]["peak_um"][name] for name in ("median", "low", "high")])
    assert peaks[13]["measured"] == "" and peaks[13]["case"] and peaks[13]["unit"] == "m"


def first_members(whole, count: int):
    """The first members of the heaviest hypothesis alone."""
    best = whole.ensembles[int(np.argmax(whole.weights))]
    share = best.weights[:count] / best.weights[:count].sum()
    own = replace(best, points=best.points[:count], weights=share)
    return replace(whole, ensembles=(own,), weights=np.ones(1))


def test_the_packaged_ensemble_predicts_with_wider_intervals_than_a_member_alone():
    whole = packaged_ensemble("cantilever")
    assert [one.weights.sum() for one in whole.ensembles] == [pytest.approx(1.0, abs=1e-14)]
    nothing = np.zeros(3)
    alone = replace(first_members(whole, 1), discrepancy=Discrepancy(nothing, nothing))
    case = PrintedRow("square", 6.0, 100.0, origin="rows.csv")
    many, one = PERIODS.row(whole, case), PERIODS.row(alone, case)
    assert not many.problems and many.role == "predicted"
    for name in ("peak_um", "contact_ms"):
        found, own = (row.ours[name] for row in (many, one))
        assert found.high - found.low > own.high - own.low
        assert found.low <= found.median <= found.high and math.isfinite(found.median)


def test_rows_that_no_calibrated_device_was_fitted_to_are_predicted():
    whole = packaged_ensemble("cantilever")
    row = packaged_rows(CANTILEVER)[0]
    assert PERIODS.row(whole, row).role == "calibrated on"
    assert PERIODS.row(whole, replace(row, measured=None)).role == "predicted"
    assert PERIODS.row(whole, replace(row, origin="mine.csv")).role == "predicted"
    bare = ts.with_values(ts.load_scene("cantilever"), {"provenance": {}})
    assert PERIODS.row(device_ensemble("cantilever", bare, PERIODS.driven), row).role == "predicted"


@pytest.mark.slow  # all rows with all members; one row stays in the default lane
def test_the_packaged_ensemble_agrees_by_drive_periods_as_its_calibration_says_by_windows():
    table = reproduce_cantilever().to_dict()["summary"]["all rows"]["ours"]
    told = packaged_errors("cantilever")["training"]["measures"]
    for one in CANTILEVER.quantities[1:]:
        own = told[one.studied]["mean_relative_error"]
        assert table[one.key]["mean_absolute_error"] == pytest.approx(own, abs=0.03)
