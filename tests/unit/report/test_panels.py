"""Panels drawn as SVG: where things lie, what numbers the axes show, what is named above."""

from __future__ import annotations

import math
import re
from xml.etree import ElementTree

import numpy as np
import pytest

from tarsus.report.panels import Drawing, Panel, stack

SVG = "{http://www.w3.org/2000/svg}"


def elements(drawing: Drawing, kind: str) -> list[ElementTree.Element]:
    return list(ElementTree.fromstring(drawing.svg("a drawing")).iter(SVG + kind))


def words(drawing: Drawing) -> list[str]:
    return [one.text or "" for one in elements(drawing, "text")]


def one(width: float = 2.0, height: float = 1.0) -> tuple[Drawing, Panel]:
    """A bare panel of some inches, half an inch from the upper left corner of its sheet."""
    drawing = Drawing(width + 1.0, height + 1.0)
    return drawing, drawing.add(0.5, 0.5, width, height, bare=True)


def path(drawing: Drawing) -> str:
    (found,) = elements(drawing, "path")
    return found.attrib["d"]


def test_points_lie_where_their_numbers_say() -> None:
    drawing, panel = one()
    panel.set_xlim(0.0, 10.0)
    panel.set_ylim(-1.0, 1.0)
    panel.plot([0.0, 5.0, 10.0], [-1.0, 0.0, 1.0], color="red")
    assert path(drawing) == "M36 108 108 72 180 36"  # 0.5 in = 36 pt, and down the page is downward


def test_a_line_is_broken_where_it_is_not_known_and_level_stretches_keep_their_ends() -> None:
    drawing, panel = one()
    panel.set_xlim(0.0, 8.0)
    panel.set_ylim(0.0, 1.0)
    panel.plot(np.arange(9.0), [0.0, 0.0, 0.0, 0.0, math.nan, 1.0, 1.0, 1.0, 0.0], color="red")
    assert path(drawing) == "M36 108 90 108M126 36 162 36 180 108"


def test_a_level_line_runs_from_end_to_end_and_shading_from_bottom_to_top() -> None:
    drawing, panel = one()
    panel.set_xlim(0.0, 1.0)
    panel.set_ylim(0.0, 4.0)
    panel.axhline(1.0, color="red", lw=1.0)
    panel.axvspan(0.25, 0.75, color="blue")
    assert path(drawing) == "M36 90 180 90"
    frame, bar = elements(drawing, "rect")
    assert frame.attrib == {"x": "36.00", "y": "36.00", "width": "144.00", "height": "72.00"}
    assert bar.attrib == {"x": "72.00", "y": "36.00", "width": "72.00", "height": "72.00", "fill": "blue"}


def test_limits_leave_room_about_the_lines() -> None:
    _, panel = one()
    assert panel.get_ylim() == (-0.05, 1.05)
    panel.plot([0.0, 1.0], [2.0, 4.0], color="red")
    assert panel.get_ylim() == pytest.approx((1.9, 4.1))
    panel.set_ylim(bottom=0.0)
    assert panel.get_ylim() == pytest.approx((0.0, 4.1))


@pytest.mark.parametrize(
    ("limits", "most", "shown"),
    [
        ((-9.9, 9.9), 3, ["−8", "0", "8"]),
        ((-210.0, 250.0), 6, ["−160", "−80", "0", "80", "160", "240"]),
        ((0.0, 0.038), 4, ["0.00", "0.01", "0.02", "0.03"]),
        ((1e4, 4e4), 3, ["10000", "20000", "30000", "40000"]),
        ((0.4, 1.1), 6, ["0.45", "0.60", "0.75", "0.90", "1.05"]),
        ((3.0, -1.0), 4, ["−1", "0", "1", "2", "3"]),
    ],
)
def test_axes_show_round_numbers(limits: tuple[float, float], most: int, shown: list[str]) -> None:
    drawing, (panel,) = stack([1.0])
    panel.lowest = False
    panel.set_ylim(*limits)
    panel.few_ticks(most)
    assert words(drawing) == shown


def test_panels_of_a_stack_share_their_time_and_the_lowest_shows_it() -> None:
    drawing, (upper, lower) = stack([1.0, 1.0])
    for panel in (upper, lower):
        panel.set_yticks([], [])
        panel.plot([2.0, 4.0], [0.0, 1.0], color="red")
    lower.set_xlim(2.0, 4.0)
    lower.set_xlabel("time (s)")
    assert [one for one in words(drawing) if one != "time (s)"] == [
        "2.00",
        "2.25",
        "2.50",
        "2.75",
        "3.00",
        "3.25",
        "3.50",
        "3.75",
        "4.00",
    ]
    lines = [one.attrib["d"] for one in elements(drawing, "path") if one.attrib["stroke"] == "red"]
    left = [re.findall(r"[\d.]+", line)[0::2] for line in lines]
    assert left[0] == left[1]


def test_names_stand_above_in_rows_and_are_escaped() -> None:
    drawing, (panel,) = stack([1.0], legend_rows=2)
    panel.lowest = False
    panel.set_yticks([0.0], ["<tip>"])
    for name in ("a<b", "_hidden", "second", "third"):
        panel.plot([0.0, 1.0], [0.0, 1.0], color="red", label=name)
    panel.legend(2, contact="grey", ground=True)
    assert words(drawing) == ["<tip>", "a<b", "second", "third", "contact", "ground"]
    rows = [float(one.attrib["y"]) for one in elements(drawing, "text")[1:]]
    assert rows[0] == rows[1] < rows[2] == rows[3] < rows[4] < 0.5 * 72.0


def test_marks_polygons_and_words_lie_about_their_points() -> None:
    drawing, panel = one()
    panel.set_xlim(0.0, 2.0)
    panel.set_ylim(0.0, 1.0)
    panel.marker(1.0, 0.5, "o", size=4.0, fill="white", edge="red", zorder=1.0)
    panel.polygon(np.array([[0.0, 0.0], [2.0, 0.0], [1.0, 1.0]]), fill="blue", edge="red", lw=0.5, zorder=0.0)
    panel.text(2.0, 0.5, "here", color="red", halo=True)
    (circle,) = elements(drawing, "circle")
    assert (circle.attrib["cx"], circle.attrib["cy"], circle.attrib["r"]) == ("108.0", "72.0", "2")
    assert path(drawing) == "M36 108 180 108 108 36Z"
    (word,) = elements(drawing, "text")
    assert (word.attrib["x"], word.attrib["paint-order"]) == ("180.0", "stroke")


def test_ids_are_of_the_content() -> None:
    texts = []
    for level in (1.0, 1.0, 2.0):
        drawing, panel = one()
        panel.plot([0.0, 0.5], [0.0, level], color="red")
        panel.set_ylim(0.0, 4.0)
        texts.append(drawing.svg("a drawing"))
    ids = [re.findall(r'id="([^"]+)"', text)[0] for text in texts]
    assert texts[0] == texts[1] and ids[0] != ids[2]
    assert all(f"url(#{name})" in text for name, text in zip(ids, texts, strict=True))
