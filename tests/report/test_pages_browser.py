"""Pages of every kind in a browser without a window: looked at on wide and narrow screens, light and dark, and used."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from markupsafe import Markup

from chromium import Chromium, Page
from page_kinds import KINDS
from tarsus.report.pages import page, write_page
from tarsus.report.panels import DrawnLine, TimePanel, panels_html
from tarsus.report.style import INK
from tarsus.tables import Table

WIDTHS = (1400, 420)
TALLEST = {"identify": (5000, 6000)}
TALL = 6000
"""Of a page on a wide screen [px]: seven screens, which one still scrolls through; of an identification on a narrow one
as well, where its sections are folded."""

HERE = Path(__file__).parent
SCRIPTS = "".join((HERE / name).read_text(encoding="utf-8") for name in ("glance.js", "interactions.js"))
INTERACTIONS = 50


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The page of a kind, made when it is first asked for."""
    return cache(lambda kind: KINDS[kind].make(tmp_path_factory.mktemp(kind)))


def looked_at(opened: Page) -> tuple[int, list[str]]:
    """Height of a page as it opens, and what is wrong with it in light and dark."""
    height, faults = opened.run("const height = unfold(); await settled(); return height"), []
    for dark in (False, True):
        opened.darken(dark)
        found = opened.run("return glance()")
        assert found["texts"]
        faults += [f"{'dark' if dark else 'light'}: {fault}" for fault in found["faults"]]
    return height, faults


@pytest.mark.browser
@pytest.mark.parametrize("kind", KINDS)
def test_a_page_is_whole_and_follows_its_controls(kind: str, made: Callable[[str], Path], chromium: Chromium) -> None:
    for width, tallest in zip(WIDTHS, TALLEST.get(kind, (TALL, math.inf)), strict=True):
        with chromium.page(made(kind), width=width, before=SCRIPTS) as opened:
            height, faults = looked_at(opened)
            faults += opened.run("return play()")
            if width == WIDTHS[0]:
                faults += turned(opened)
            assert opened.run(f"return interact({INTERACTIONS}, {width})")
            faults += opened.run("await settled(); return glance().faults")
            assert not faults + opened.faults, f"{kind}, {width} px"
            assert height <= tallest, f"{kind}: {height} px high"


def turned(opened: Page) -> list[str]:
    """What does not follow the sliders of a page's explorers, most of which change the run."""
    faults = []
    for one in opened.run("return turnAll()"):
        faults += one["faults"]
        if 2 * len(one["followed"]) < one["sliders"]:
            faults.append(f"of {one['sliders']} sliders only these change anything: {one['followed']}")
    return faults


def test_every_page_is_in_the_table() -> None:
    """A file that makes a page of sections, the one template with a title: a new one needs a row in `page_kinds`."""
    packages = {"tarsus": "", "tarsus_reproduce": "tarsus_reproduce:"}
    sources = Path(__file__).parents[2] / "src"
    found = {
        f"{packages[file.relative_to(sources).parts[0]]}{file.name}"
        for file in sources.glob("**/*.py")
        if "return sections_page(" in file.read_text(encoding="utf-8")
    }
    assert len(found) > 10 and found == {kind.source for kind in KINDS.values()}
    titled = [file.name for file in sources.glob("**/*.html") if "<h1>" in file.read_text(encoding="utf-8")]
    assert titled == ["sections.html"]


FAULTY = (
    "<h1>Faults</h1><h3>too deep</h3>"
    '<p style="width: 4rem; overflow: hidden; white-space: nowrap">this is cut at its right end</p>'
    '<p style="margin-bottom: -1.2rem">one line</p><p>another line</p>'
    '<p style="color: #999">a faint line</p><p style="width: 2000px; max-width: none">wide</p>'
    '<div><table style="display: block"><caption>the title of a table</caption><tr><td>1</td></tr></table></div>'
    '<svg viewBox="0 0 9 9" width="9"></svg><button></button>'
    '<svg viewBox="0 0 900 90" aria-label="small"><text x="9" y="50" font-size="9">small words</text></svg>'
    "<table><thead><tr><th>value</th></tr></thead><tbody><tr><td> </td></tr></tbody></table>"
    '<canvas aria-label="nothing drawn"></canvas>'
    '<div class="table" style="height: 2rem; overflow: hidden"><table><tr><td>1</td></tr><tr><td>2</td></tr></table>'
    "</div>"
)
"""Faults in text, tables and pictures."""

SAID = (
    "cut: ",
    "over each other: ",
    "faint (2.",
    "px wide in",
    "squeezed: ",
    "no words for a picture",
    "no name",
    "headings: 1,3",
    "noSuchName",
    "console: ['told']",
    "empty table",
    "cut below without a bar",
    "empty picture: nothing drawn",
    "empty figure: nothing",
    "a key of no line: gone",
    "a key without words: hidden",
    "cramped: row",
)
"""How they and those of figures and scripts are told."""


def faulty_charts() -> Markup:
    """A line without numbers, a key whose words are hidden, names of rows that touch."""
    ends = np.array([0.0, 1.0])
    nothing = TimePanel(1.0, lines=[DrawnLine(ends, np.full(2, np.nan), INK, "gone")])
    crowded = TimePanel(1.0, lines=[DrawnLine(ends, 50.0 * ends, INK, "hidden")], names=[f"row {n}" for n in range(50)])
    style = Markup("<style>.wordless .names button span { display: none; }</style>")
    wordless = Markup('<div class="wordless">{}</div>').format(panels_html([crowded], "crowded"))
    return style + panels_html([nothing], "nothing") + wordless


@pytest.mark.browser
def test_faults_are_found(tmp_path: Path, chromium: Chromium) -> None:
    """Each that is looked for, made on purpose."""
    script = "<script>addEventListener('click', () => noSuchName()); setTimeout(() => console.error('told'));</script>"
    file = write_page(page("faults", Markup(FAULTY) + faulty_charts() + Markup(script)), tmp_path / "page.html")
    for width in WIDTHS:
        with chromium.page(file, width=width, before=SCRIPTS) as opened:
            opened.run("document.querySelectorAll('.names button').forEach((key) => { key.hidden = false; })")
            _, faults = looked_at(opened)
            opened.run("document.querySelector('[data-zoom]').click(); await settled()")
            said = "\n".join(faults + opened.faults)
        for word in SAID:
            assert word in said, word
        assert ("tiny" in said) == (width < 1000)


@pytest.mark.browser
def test_an_explorer_that_does_not_follow_is_found(made: Callable[[str], Path], chromium: Chromium) -> None:
    """Series that stay, as where the player fails: the picture's and the figures'."""
    for part, broken in {"film": "player.take", "lines": "charts.take"}.items():
        with chromium.page(made("explorer"), before=SCRIPTS) as opened:
            opened.run(f"document.querySelector('.explore').explorer.{broken} = () => null")
            assert any(f"{part} did not follow" in fault for fault in turned(opened))


@pytest.mark.browser
def test_a_plain_page_has_no_fault(tmp_path: Path, chromium: Chromium) -> None:
    rows = [("robot.structure.frequencies", "6.4 kHz", "a remark that is long enough to be broken " * 3)] * 40
    shown = Table("", ("path", "value", "remark"), rows).html()
    body = f'<h1>Plain</h1><p class="lede">With a table.</p><h2>Table</h2>{shown}'
    file = write_page(page("plain", body), tmp_path / "page.html")
    for width in WIDTHS:
        with chromium.page(file, width=width, before=SCRIPTS) as opened:
            assert looked_at(opened)[1] == [] == opened.faults
