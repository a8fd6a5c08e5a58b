"""The page of a sweep: what it says of measures, swept values and failed runs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import tarsus as ts
from html_page import Page
from tarsus.report.style import scale_of
from tarsus.report.sweep_page import _failures, _median_run, sweep_html
from tarsus.study.axes import Grid, Linspace, Logspace
from tarsus.study.collecting import collected_variables
from tarsus.study.summary import read_scored
from tarsus.study.sweep import Sweep
from tarsus.study.workunit import OUTCOMES

GAP, FILM = "robot.feet.tip.gap", "ground.film.coefficient"
CODES = list(OUTCOMES)


def made(folder: Path, codes: list[str]) -> tuple[Sweep, Path]:
    """A sweep over a grid of 3 x 4 with measures that are known, as its collected file."""
    from tarsus.files.series import write_netcdf

    sweep = Sweep(
        name="a <sweep>",
        scene=ts.load_scene("cantilever"),
        duration=0.05,
        measures=("bounces", "contact_duration"),
        design=Grid(),
        vary={GAP: Linspace(start=50e-6, stop=70e-6, count=3), FILM: Logspace(start=1e-22, stop=1e-19, count=4)},
    )
    points = sweep.points()
    code = np.array([CODES.index(one) for one in codes], dtype=np.int8)
    value = np.column_stack([np.rint(1e5 * points[GAP]), 1e-3 * np.log10(points[FILM] / 1e-23)])
    value[code != CODES.index("DONE")] = np.nan
    arrays = {"code": code, "value": value, "spread": 0.0 * value, "per_foot": value[:, :, None]}
    file = folder / "sweep.nc"
    write_netcdf(collected_variables(sweep, points, arrays), {"title": "a sweep"}, file)
    return sweep, file


def test_measures_come_with_their_range_and_where_it_ends(tmp_path: Path) -> None:
    sweep, file = made(tmp_path, ["DONE"] * 12)
    text = sweep_html(sweep, file)
    page = Page(text)
    assert "Sweep: a <sweep>" in page.text and "All runs reached their end." in page.text
    assert "bounces 12 5 6 7 tip.gap 50 µm" in page.text
    assert "contact duration 12 1 ms 2.5 ms 4 ms" in page.text
    assert page.tags.count("figure") == 4, "two measures, each a map and against the swept values"
    assert "3 values from 50 µm to 70 µm" in page.text and "The line joins the median run of each value." in page.text
    assert "Runs that failed" not in page.text
    assert ">5.5</text>" not in text and text.count(">6</text>") == 3, "bounces are whole"
    assert text.count(">robot.feet.tip.gap (µm)</text>") == 4, "axes of maps have prefixes as all others"


@pytest.mark.slow
def test_settled_motions_come_with_what_is_between_their_starts(tmp_path: Path) -> None:
    from tarsus.files.series import write_netcdf

    scene, rate = ts.load_scene("millipede"), "ground.adhesion.rate"
    sweep = Sweep(name="walk", scene=scene, measures=("stride",), vary={rate: [1e-6, 2e-6, 3e-6]})
    value = np.array([[1e-6], [2e-6], [np.nan]])
    arrays = {
        "code": np.array([0, 0, CODES.index("STALLED")], dtype=np.int8),
        "value": value,
        "spread": 0.0 * value,
        "per_foot": np.repeat(value[:, :, None], 2, axis=2),
        "over_starts": 0.1 * value,
        "settled": np.array([1.0, 0.5, 0.75]),
    }
    write_netcdf(collected_variables(sweep, sweep.points(), arrays), {"title": "a walk"}, tmp_path / "sweep.nc")
    text = Page(sweep_html(sweep, tmp_path / "sweep.nc")).text
    assert "3 runs of millipede: settled motion, runs of 1 s from 4 starts." in text
    assert "stride 2 1 µm 1.5 µm 2 µm 150 nm adhesion.rate 1 µN/s" in text
    assert (
        "75 % of the starts repeat" in text
        and "starts repeat" not in Page(sweep_html(*made(tmp_path, ["DONE"] * 12))).text
    )


@pytest.mark.slow
def test_failed_runs_are_counted_listed_and_left_out(tmp_path: Path) -> None:
    page = Page(sweep_html(*made(tmp_path, ["REFUSED", *["DONE"] * 10, "STALLED"])))
    assert "2 of 12 runs did not reach their end." in page.text and "Runs that failed" in page.text
    assert page.text.count(OUTCOMES["REFUSED"]) == 2 and page.text.count(OUTCOMES["STALLED"]) == 2
    assert "bounces 10 5 6 7" in page.text and "nan" not in page.text.lower().replace("nanom", "")
    assert "bounces 0 – – –" in Page(sweep_html(*made(tmp_path, ["REFUSED"] * 12))).text


def test_of_very_many_runs_some_are_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tarsus.report.sweep_page.MOST_RUNS", 5)
    sweep, file = made(tmp_path, ["DONE"] * 12)
    text = Page(sweep_html(sweep, file)).text
    assert "This page is made of one run in 3; all are in sweep.nc." in text and "bounces 4 5" in text
    table = _failures(read_scored(*made(tmp_path, [*["DONE"] * 6, "STALLED", *["DONE"] * 5]), 3), {GAP: "m", FILM: "1"})
    assert [row[0] for row in table.parts[0].rows] == [6]


def test_a_line_joins_runs() -> None:
    assert _median_run(np.array([0.0, 0.0, 10.0, 10.0])) == 0.0, "a mean of 5 is no run"
    assert np.isnan(_median_run(np.zeros(0)))


def test_a_grid_of_two_values_is_a_map(tmp_path: Path) -> None:
    found = read_scored(*made(tmp_path, ["DONE"] * 11 + ["STALLED"]))
    shown = found.maps["bounces"]
    assert shown.dims == (FILM, GAP), "the first one across"
    np.testing.assert_allclose(shown.sel({GAP: 60e-6}, method="nearest"), 6.0)
    assert np.isnan(shown.values[-1, -1]) and np.isfinite(shown.values).sum() == 11


def test_values_that_no_prefix_reaches_are_drawn_in_a_power_of_ten() -> None:
    scale = scale_of("N m^2 s", np.array([1e-22, 9e-21]))
    assert (scale.step, scale.label) == (pytest.approx(1e-21), "10⁻²¹ N m² s")
    assert scale_of("m", np.array([7e-5])).label == "µm" and scale_of("1", np.array([0.3])).label == ""
