"""Pictures drawn as SVG: where things lie, and that their colours are the page's."""

from __future__ import annotations

import math
import re
from xml.etree import ElementTree

import numpy as np

from tarsus.report.drawing import Drawing, Panel
from tarsus.report.style import INK

SVG = "{http://www.w3.org/2000/svg}"


def elements(drawing: Drawing, kind: str) -> list[ElementTree.Element]:
    return list(ElementTree.fromstring(drawing.svg("a drawing")).iter(SVG + kind))


def one(width: float = 2.0, height: float = 1.0) -> tuple[Drawing, Panel]:
    """A bare panel of some inches, half an inch from the upper left corner of its sheet."""
    drawing = Drawing(width + 1.0, height + 1.0)
    return drawing, drawing.add(0.5, 0.5, width, height)


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


def test_a_level_line_runs_from_end_to_end() -> None:
    drawing, panel = one()
    panel.set_xlim(0.0, 1.0)
    panel.set_ylim(0.0, 4.0)
    panel.axhline(1.0, color="red", lw=1.0)
    assert path(drawing) == "M36 90 180 90"
    (frame,) = elements(drawing, "rect")
    assert frame.attrib == {"x": "36.00", "y": "36.00", "width": "144.00", "height": "72.00"}


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


def test_colours_are_those_of_the_page_and_its_own_where_it_stands_alone() -> None:
    drawing, panel = one()
    panel.plot([0.0, 1.0], [0.0, 1.0], color=INK)
    panel.marker(1.0, 0.5, "o", size=4.0, fill="#ffffff", edge="#123456", zorder=1.0)
    text = drawing.svg("a drawing")
    assert f'stroke="var(--ink, {INK})"' in text and 'fill="var(--paper, #ffffff)" stroke="#123456"' in text
