"""Pages of reproductions: one for every kind of row, and the index; whole, and without anything from outside."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache

import pytest

import tarsus as ts
from html_page import Page
from reproduce.coarse_studies import FEW, ringing
from tarsus.calibrate.compared import NumberRow, numbers_table
from tarsus.tables import Section
from tarsus_reproduce.cantilever import reproduce_cantilever
from tarsus_reproduce.ensembles import packaged_errors
from tarsus_reproduce.index import index_html
from tarsus_reproduce.millipede import judge_scene
from tarsus_reproduce.millipede_tables import millipede_reproduction
from tarsus_reproduce.packaged import experiments
from tarsus_reproduce.reproduction import FigureCall, Reproduction
from tarsus_reproduce.robot_tables import reproduce_robot
from tarsus_reproduce.verb import reproduce


@pytest.fixture(scope="module")
def one_of() -> Callable[[str], Reproduction]:
    """A small one of each kind by its name, made when it is asked for."""
    made = {
        "cantilever": reproduce_cantilever,
        "hexapod": lambda: reproduce_robot("hexapod", seeds=2),
        "quadruped": lambda: reproduce_robot("quadruped"),
        "millipede": lambda: millipede_reproduction((judge_scene("ringing", ringing(), coarse=FEW, duration=0.04),)),
    }
    return cache(lambda name: made[name]())


@pytest.fixture(scope="module")
def found(one_of) -> dict[str, Reproduction]:
    return {name: one_of(name) for name in ("cantilever", "hexapod", "quadruped", "millipede")}


def row(measured: float | None, median: float, low: float, high: float, unit: str = "m") -> NumberRow:
    return NumberRow("case", "predicted", "peak", unit, measured, None, (median, low, high))


def test_a_number_is_held_by_its_interval_and_marked_where_it_is_far_off():
    near, far, none = row(1.0, 1.2, 0.9, 1.5), row(1.0, 2.0, 1.5, 3.0), row(None, 2.0, 1.0, 3.0)
    assert [one.held for one in (near, far, none)] == [True, False, None]
    counts = [row(0.0, median, 0.0, 1.0, "1") for median in (0.4, 0.6)]
    assert [one.notable for one in (near, far, none, *counts)] == [False, True, False, False, True]
    table = numbers_table("rows", [near, far, none])
    assert [line[-2:] for line in table.rows] == [(pytest.approx(-0.2), True), (-1.0, False), (None, None)]
    assert {line for line, _ in table.flagged} == {1}


def calls(part: object) -> int:
    """How many figures a part holds."""
    inner = part.parts if isinstance(part, Section) else part if isinstance(part, list | tuple) else ()
    return isinstance(part, FigureCall) + sum(map(calls, inner))


SLOW = [pytest.param(name, marks=pytest.mark.slow) for name in ("hexapod", "quadruped", "millipede")]  # 5 s each


@pytest.mark.parametrize("name", ["cantilever", *SLOW])
def test_every_section_and_figure_is_there_in_order_and_nothing_comes_from_outside(one_of, name):
    one = one_of(name)
    text = one.html()
    page = Page(text)
    positions = [page.text.index(section.heading) for section in one.sections]
    assert positions == sorted(positions)
    figures = [int(n) for n in re.findall(r"<b>Figure (\d+)\.</b>", text)]
    assert figures == list(range(1, calls(one.sections) + 1)) and figures
    plain = page.text.replace("\N{NO-BREAK SPACE}", " ").replace("µ", "u")
    for table in one.table().parts:
        assert all(note.replace("µ", "u") in plain for note in table.notes), table.title
    assert not re.search(r"\bnan\b", plain)
    assert not {"link", "img"} & set(page.tags)
    for tag, name, value in page.attributes:
        assert (tag, name) != ("script", "src") and (name not in ("src", "href") or value.startswith("#"))
    assert not re.findall(r"url\((?!#)", text) and len(text.encode()) < 1_500_000


def test_the_packaged_ensemble_shows_rows_excluded_beside_those_calibrated_on():
    told = packaged_errors("cantilever")
    (shown,) = [one for one in reproduce_cantilever().table().parts if "calibration" in one.title]
    found = {row[:2]: dict(zip((c.name for c in shown.columns), row, strict=True)) for row in shown.rows}
    for part, words in (("training", "training"), ("left_out", "excluded")):
        error = told[part]["measures"]["peak"]["mean_relative_error"]
        assert found["peak", words]["mean relative error"] == error and found["peak", words]["skill"] is not None
    assert set(told["notes"]) <= set(shown.notes)


@pytest.mark.slow
def test_no_run_of_these_devices_creates_energy_and_a_map_that_could_is_announced(found, tmp_path):
    for name in ("hexapod", "quadruped"):
        shares = [row[-1] for table in found[name].table().parts for row in table.rows if row[0] == "as run"]
        assert shares == [0.0] and not found[name].problems and not found[name].cautions
    scene = ts.load_scene("hexapod", **{"ground.impact": {"kind": "dominant_mode", "passive": False}})
    ts.write_scene(scene, tmp_path / "bad.toml")
    bad = reproduce_robot("hexapod", str(tmp_path / "bad.toml"), seeds=1)
    assert "can create energy" in bad.cautions[0] and bad.cautions[0] in bad.table().text()


def test_the_index_links_pages_and_says_what_cannot_be_matched():
    names = list(experiments())[1:4]
    text = index_html(dict.fromkeys(names, "Device so and so"))
    assert re.findall(r'href="([^"#]+)"', text) == [f"{name}/reproduction.html" for name in names]
    page = Page(text)
    assert all(sentence in page.text for name in names for sentence in experiments()[name].unmatched)


@pytest.mark.parametrize(
    ("name", "words", "said"),
    [
        ("cantilevre", {}, "did you mean 'cantilever'"),
        ("cantilever", {"seeds": 3}, "seeds: is of hexapod and quadruped, not of cantilever"),
        ("hexapod", {"seeds": 0}, "from 1 to"),
        ("millipede", {"rows": "rows.csv"}, "rows: is of cantilever"),
        ("millipede", {"seeds": 3}, "not of millipede"),
        ("cantilever", {"device": "hexapod"}, "has no point 'tip', 'center'"),
    ],
)
def test_what_does_not_go_together_is_refused(name, words, said):
    with pytest.raises(ts.InputError, match=re.escape(said)):
        reproduce(name, **words)
