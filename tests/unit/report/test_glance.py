"""Pages of every kind at a glance, in a browser without a window: on wide and narrow screens, light and dark."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from chromium import found_in
from page_kinds import KINDS, make_page
from tarsus.report.pages import page
from tarsus.tables import Table

pytestmark = pytest.mark.browser

WIDTHS = (1400, 420)
SCHEMES = {"dark": 0, "light": 1}
TALLEST = {"identify": (5000, 6000)}
TALL = 6000
"""Of a page on a wide screen [px]: seven screens, which one still scrolls through; of an identification on a narrow one
as well, where its sections are folded."""

SCRIPT = Path(__file__).with_name("glance.js")
FRAMES = """<!DOCTYPE html><html lang="en"><title>frames</title><body><script>
const found = [];
addEventListener("message", (event) => {{
  found.push(JSON.parse(event.data));
  document.body.dataset.found = JSON.stringify(found);
}});
</script>{frames}</body></html>"""


def glance(text: str, folder: Path, scheme: str) -> list[dict[str, Any]]:
    """What is wrong with a page on each width: faults, height, and whether it was dark."""
    script = f"<script>{SCRIPT.read_text(encoding='utf-8')}</script>"
    assert text.count("<head>") == 1
    (folder / "page.html").write_text(text.replace("<head>", f"<head>{script}"), encoding="utf-8")
    frames = "".join(f'<iframe src="page.html" width="{wide}" height="900"></iframe>' for wide in WIDTHS)
    (folder / "frames.html").write_text(FRAMES.format(frames=frames), encoding="utf-8")
    found = found_in(
        folder / "frames.html", "--window-size=1500,1000", f"--blink-settings=preferredColorScheme={SCHEMES[scheme]}",
        time=8000,
    )  # fmt: skip
    assert {one["width"] for one in found} == set(WIDTHS)
    assert all(one["dark"] == (scheme == "dark") and one["texts"] for one in found)
    return found


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_is_cut_overlaps_or_is_faint(kind: str, tmp_path: Path) -> None:
    text = make_page(kind, tmp_path).read_text(encoding="utf-8")
    for scheme in SCHEMES:
        for found in glance(text, tmp_path, scheme):
            assert not found["faults"], f"{kind}, {found['width']} px, {scheme}"
            limits = dict(zip(WIDTHS, TALLEST.get(kind, (TALL, math.inf)), strict=True))
            assert found["height"] <= limits[found["width"]], f"{kind}: {found['height']} px high"


def test_faults_are_found(tmp_path: Path) -> None:
    """Each fault that is looked for, made on purpose."""
    body = (
        "<h1>Faults</h1><h3>too deep</h3>"
        '<p style="width: 4rem; overflow: hidden; white-space: nowrap">this is cut at its right end</p>'
        '<p style="margin-bottom: -1.2rem">one line</p><p>another line</p>'
        '<p style="color: #999">a faint line</p><p style="width: 2000px; max-width: none">wide</p>'
        '<div><table style="display: block"><caption>the title of a table</caption><tr><td>1</td></tr></table></div>'
        '<svg viewBox="0 0 9 9" width="9"></svg><button></button>'
        '<svg viewBox="0 0 900 90" aria-label="small"><text x="9" y="50" font-size="9">small words</text></svg>'
        "<script>noSuchName();</script>"
    )  # fmt: skip
    for found in glance(page("faults", body), tmp_path, "light"):
        said = "\n".join(found["faults"])
        for word in ("cut: ", "over each other: ", "faint (2.", "px wide in", "squeezed: ", "no words for a picture",
                     "no name", "headings: 1,3", "noSuchName"):  # fmt: skip
            assert word in said, word
        assert ("tiny" in said) == (found["width"] < 1000)


def test_a_plain_page_has_no_fault(tmp_path: Path) -> None:
    rows = [("robot.structure.frequencies", "6.4 kHz", "a remark that is long enough to be broken " * 3)] * 40
    shown = Table("", ("path", "value", "remark"), rows).html()
    body = f'<h1>Plain</h1><p class="lede">With a table.</p><h2>Table</h2>{shown}'
    for scheme in SCHEMES:
        assert not [
            fault for found in glance(page("plain", body), tmp_path, scheme) for fault in found["faults"]
        ]
