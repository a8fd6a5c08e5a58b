"""The states of a foot as a picture, and that the one in the documentation is what the engine's table says."""

from __future__ import annotations

import re
import runpy
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

from tarsus.report.flowchart import BOTTOM, BOX_HEIGHT, TOP, flowchart

DOCS = Path(__file__).parents[3] / "docs"

NAMES = {0: "up", 1: "left & low", 2: "middle", 3: "right"}
TABLE = (
    (0, 0, "hop", "v+ < 0"),
    (0, 1, "fall", "f_a <= mu N"),
    (0, 1, "drop", "second of a pair"),
    (1, 0, "rise", "always"),
    (2, 3, "go", "x"),
    (3, 2, "come", "y"),
    (2, 2, "stay", "z"),
)


def texts(svg: str) -> list[str]:
    return [
        "".join(node.itertext())
        for node in ElementTree.fromstring(svg).iter("{http://www.w3.org/2000/svg}text")
    ]


def test_the_committed_picture_is_what_the_engine_s_table_draws() -> None:
    drawing = runpy.run_path(str(DOCS / "draw_flowchart.py"))["drawing"]
    committed = (DOCS / "flowchart.svg").read_text(encoding="utf-8")
    assert committed == drawing(), "run `python docs/draw_flowchart.py`"


def test_the_engine_s_table_names_every_state_and_repeats_no_change() -> None:
    from tarsus.base.events import TRANSITIONS, FootState

    changes = [(before, after, event) for before, after, event, _ in TRANSITIONS]
    assert len(set(changes)) == len(changes)
    assert {state for before, after, *_ in TRANSITIONS for state in (before, after)} == set(FootState)


def test_every_state_event_and_condition_is_written() -> None:
    shown = texts(flowchart(TABLE, NAMES))
    assert [name for name in shown if name in NAMES.values()] == list(NAMES.values())
    for _, _, event, _ in TABLE:
        assert shown.count(event) == 2, "once on its arrow, once below"
    assert "fa\u200b ≤ μ N" in shown
    assert "v+ < 0" in shown
    for number in range(1, len(TABLE) + 1):
        assert shown.count(str(number)) == 2


def test_one_arrow_for_changes_between_the_same_states() -> None:
    svg = flowchart(TABLE, NAMES)
    assert svg.count('class="arrow"') == len({(before, after) for before, after, *_ in TABLE})


def test_arrows_between_boxes_end_at_their_edges() -> None:
    svg = flowchart(((0, 1, "fall", ""), (1, 0, "rise", "")), {0: "up", 1: "down"})
    ends = re.findall(r'd="M([\d.]+) ([\d.]+)L([\d.]+) ([\d.]+)"', svg)
    (x0, y0, x1, y1), (u0, v0, u1, v1) = (tuple(map(float, end)) for end in ends)
    assert (y0, y1) == (TOP + BOX_HEIGHT / 2, BOTTOM - BOX_HEIGHT / 2) == (v1, v0)
    assert x0 == x1 and u0 == u1 and x0 != u0, "there and back side by side"


def test_a_state_without_a_name_is_refused() -> None:
    with pytest.raises(KeyError, match="7"):
        flowchart(((0, 7, "away", ""),), {0: "here"})
