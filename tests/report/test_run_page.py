"""The report: one readable, self-contained page that shows what the run holds."""

from __future__ import annotations

import dataclasses
import json
import re

import numpy as np
import pytest

import tarsus as ts
from html_page import Page, alone
from packed_series import unpacked
from scene_files import scene as scene_of
from tarsus.base.errors import InputError
from tarsus.measure import CautionKind
from tarsus.model.scene import Provenance, Source
from tarsus.model.values import ValueRow, grouped
from tarsus.report import write_report
from tarsus.report.figures import ledger, turns_of
from tarsus.report.run_page import MOST_EVENTS, report_html
from tarsus.report.series import contact_intervals, drive_period, last_turns, series_of
from tarsus.solve.codes import EVENT_TYPE
from tarsus.tables.numbers import amount


@pytest.fixture(scope="module")
def scene() -> ts.Scene:
    """The cantilever, with characters of markup in its texts."""
    made = ts.load_scene("cantilever")
    note = Provenance(source=Source.PRINTED, note="section 2.2, <laser vibrometer> & network analyser")
    return ts.with_values(
        made,
        {
            "provenance": {**made.provenance, "robot.structure.frequencies": note},
            "citations": ("J. Ryou, K. R. Oldham: contact dynamics of <micro> robots",),
        },
    )


@pytest.fixture(scope="module")
def run(scene: ts.Scene) -> ts.Run:
    return ts.simulate(scene, 0.09)


@pytest.fixture(scope="module")
def companion(scene: ts.Scene) -> ts.Run:
    return ts.simulate(ts.with_values(scene, {"ground.adhesion": None}), 0.09)


@pytest.fixture(scope="module")
def page_text(run: ts.Run, companion: ts.Run) -> str:
    return report_html(run, companion)


@pytest.fixture(scope="module")
def page(page_text: str) -> Page:
    assert len(page_text.encode()) < 1_500_000
    return alone(page_text)


def test_the_page_says_what_was_run_and_what_came_of_it(run: ts.Run, page_text: str, page: Page) -> None:
    assert run.code.value in page.text and 'class="verdict failed"' not in page_text
    assert "square, amplitude 8 V, frequency 50 Hz" in page.text
    assert re.search(rf"90 ms simulated, computed in [\d.]+ m?s; {len(run.events)} contact events", page.text)
    headings = ["Motion", "Measures", "Forces", "Energy", "Events", "Values of this run"]
    positions = [page.text.index(f" {heading} ") for heading in headings]
    assert positions == sorted(positions)
    assert page.tags.count("figure") == page.tags.count("figcaption") == 7
    for label in ("displacement (µm)", "drive (V)", "time (ms)", "energy since start (nJ)", "without adhesion"):
        assert label in page.text
    assert "total time per drive period with zero gap" in page.text
    assert f" contact duration {amount(run.measures['contact_duration'].value, 's')} " in page.text
    assert "nan" not in page.text.lower().replace("nanometre", "")
    assert "<laser" not in page_text and "<micro>" not in page_text
    assert "<laser vibrometer> & network analyser" in page.text
    assert "contact dynamics of <micro> robots" in page.text


def test_a_failed_run_says_so_lists_its_first_events_and_what_its_measures_count() -> None:
    failed = ts.simulate(scene_of("vibrating_table"), 800.0, ts.Accuracy(steps=2000))
    failed_text = report_html(failed)
    assert 'class="verdict failed"' in failed_text
    rows = failed_text.partition(">Events<")[2]
    assert rows.count(">bounce</td>") == np.count_nonzero(failed.events["kind"][:MOST_EVENTS] == 1)
    more = len(failed.events) - MOST_EVENTS
    assert more > 0 and f"The first {MOST_EVENTS} are listed; {more} more are in events.csv." in failed_text
    text = Page(failed_text).text
    assert CautionKind.COUNTED_LOW in {one.kind for one in failed.measures.warnings}
    for one in failed.measures.warnings:
        assert f"Note: {one}".replace(" um", " µm") in text
    assert "flights above 100 nm, after contacts below 500 µs" in text
    assert "names that begin with max, total or longest are of the whole run" in text


def test_pages_of_several_feet_and_of_none() -> None:
    text = Page(report_html(ts.simulate(scene_of("three_feet"), 0.03))).text
    assert " contact " in text and all(f"Forces that act on foot {foot}" in text for foot in "abc")
    above = {"robot.feet.tip.gap": 1e-3, "ground.film": None, "ground.adhesion": None}
    high = ts.simulate(ts.load_scene("cantilever", **above), 0.045)
    assert "No foot touched the ground." in Page(report_html(high)).text
    structure = ts.Modal(frequencies=(1e2,), damping_ratios=(0.1,), modal_masses=(1e-6,), shapes={"a": (1.0,)})
    start = ts.Initial(displacement=(1e-6,))
    bare = ts.Scene(name="bare", robot=ts.Robot(structure=structure), initial=start, duration=0.02)
    assert "Kinetic and elastic" in Page(report_html(ts.simulate(bare))).text


def test_drive_periods_lie_over_each_other_where_there_are_some(scene: ts.Scene, run: ts.Run, page: Page) -> None:
    text = Page(report_html(ts.simulate(scene, 0.012))).text
    assert "over one drive period" not in text and "last 2 drive periods" not in text
    assert "over one drive period (20 ms): the last 4 of them" in page.text
    series = series_of(run)
    heights = [height for _, height in turns_of(series, 0)]
    assert len(heights) == 4 and np.ptp(heights[-1]) > 100e-6
    seen = series["gap"][0][series.inside((0.06, 0.08))]
    ends = (heights[-1].min(), heights[-1].max())
    assert ends == pytest.approx((seen.min(), seen.max()), abs=0.01 * np.ptp(seen))


def test_equal_runs_give_equal_pages(run: ts.Run, companion: ts.Run, page_text: str) -> None:
    assert report_html(run, companion) == page_text


def test_a_stored_run_is_reported_and_its_account_shows_no_number_below_its_rounding(run: ts.Run, tmp_path) -> None:
    stored = ts.load_run(run.write(tmp_path / "run"))
    text = write_report(stored, tmp_path / "report.html").read_text(encoding="utf-8")
    assert run.code.value in text and "computed in" not in text
    with pytest.raises(InputError, match="folder"):
        write_report(stored, tmp_path)
    found = dataclasses.replace(stored.ledger, work_in=1e-9, adhesion=8.623e-39, friction=2e-14)
    table = report_html(ts.Run.of(dataclasses.replace(stored.arrays(), ledger=found))).partition("in numbers")[2]
    for name, energy in (("lost to adhesion", "0 J"), ("lost to friction", "20 fJ")):
        assert re.findall(rf'<td>{name}</td><td class="n">([^<]*)', table) == [energy]


def test_contact_intervals_follow_the_events() -> None:
    rows = [(0.0, 0, 5), (0.1, 0, 3), (0.15, 1, 2), (0.2, 0, 1), (0.3, 0, 2), (0.4, 0, 3), (0.5, 0, 4)]
    events = np.zeros(len(rows), EVENT_TYPE)
    events["time"], events["foot"], events["kind"] = zip(*rows, strict=True)
    assert contact_intervals(events, 0, 0.9) == [(0.0, 0.1), (0.3, 0.4), (0.5, 0.9)]
    assert contact_intervals(events, 1, 0.9) == [(0.15, 0.9)]
    assert contact_intervals(events[:0], 0, 0.9) == []


def test_windows_end_at_whole_periods(run: ts.Run) -> None:
    series = series_of(run)
    assert series.period == drive_period(run.scene) == pytest.approx(0.02)
    assert series.last_periods(2) == pytest.approx((0.04, 0.08))
    assert series.last_periods(10) == series.whole
    part = series.inside((0.04, 0.08))
    assert series.time[part][0] <= 0.04 and series.time[part][-1] >= 0.08


def test_the_last_turns_are_as_many_as_are_asked_for(run: ts.Run) -> None:
    found = last_turns(run, 3, 100).time
    assert (found[0], found[-1], len(found)) == pytest.approx((0.02, 0.08, 301))


def test_curves_of_the_account_are_what_is_stored_and_what_is_lost(run: ts.Run) -> None:
    series = series_of(run)
    panel = json.loads(re.search(r'charts-data">(.*?)</script>', ledger(series).picture)[1])["panels"][0]
    lines = [unpacked(one["values"], 1, gaps=True)[0] * panel["step"] for one in panel["series"]]
    stored = series["kinetic_energy"] + series["elastic_energy"]
    assert lines[1].max() == pytest.approx(stored.max(), rel=1e-3)
    assert lines[-1][-1] == pytest.approx(-run.ledger.laws["film"], rel=0.02) and lines[-1][-1] > 0.0


def test_equal_members_are_shown_once() -> None:
    def row(path: str, value: str, number: float = 0.0) -> ValueRow:
        return ValueRow(path, value, "printed", "a note", "", (number,), "m")

    names = [f"L{i}" for i in range(1, 9)]
    rows = [row("ground.gap", "1 m")]
    for i, name in enumerate(names):
        rows += [row(f"legs.{name}.mass", "1 mg"), row(f"legs.{name}.y", "1 m" if i < 5 else "2 m")]
        rows += [row(f"legs.{name}.x", f"{i} m", float(i)), row(f"legs.{name}.load.{name}_hip", "3 m")]
    shown = {(one.path, one.of): one.value for one in grouped(rows)}
    assert shown == {
        ("ground.gap", ""): "1 m",
        ("legs.*.mass", "all 8"): "1 mg",
        ("legs.*.y", "L1, L2, … L5 (5 of 8)"): "1 m",
        ("legs.*.y", "L6, L7, L8 (3 of 8)"): "2 m",
        ("legs.*.x", "all 8"): "8 values, 0 m to 7 m",
        ("legs.*.load.*_hip", "all 8"): "3 m",
    }
    assert grouped(rows[:5]) == rows[:5], "a single member stays as it is"
