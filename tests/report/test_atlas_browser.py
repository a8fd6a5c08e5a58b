"""The page of an atlas in a browser without a window: what it says, names and shows, and how much of it there is."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tarsus as ts
from chromium import READY, Chromium
from packed_series import unpacked
from tarsus.atlas.cells import MEASURES
from tarsus.atlas.classes import words
from tarsus.atlas.quadtree import Quadtree
from tarsus.atlas.result import Atlas
from tarsus.report.atlas_page import atlas_html, page_data

PROBE = """
const found = {}, faults = [];
addEventListener("error", (event) => faults.push(event.message));
const map = document.querySelector(".atlas-map"), part = (name) => document.querySelector(`.atlas-${name}`);
const ink = (canvas = map) => {
  const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
  let sum = 0;
  for (let i = 0; i < data.length; i += 4) sum = (sum * 31 + data[i] + 3 * data[i + 1] + 7 * data[i + 2]) | 0;
  return sum;
};
const at = (type, x, y, more = {}) => {
  const box = map.getBoundingClientRect(), w = box.width - 74, h = box.height - 46;
  const [clientX, clientY] = [box.left + 62 + x * w, box.top + 8 + (1 - y) * h];
  map.dispatchEvent(new PointerEvent(type, { clientX, clientY, pointerId: 1, bubbles: true, ...more }));
};
map.setPointerCapture = () => {};
const press = (key) => map.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true }));
addEventListener("load", () => setTimeout(() => {
  STEPS
  found.faults = faults;
  found.requests = performance.getEntriesByType("resource").length;
  ready(found);
}, 50));
"""

STEPS = """
  const before = ink();
  at("pointermove", 0.5, 0.25);
  found.says = part("says").textContent;
  at("pointerdown", 0.5, 0.25); at("pointerup", 0.5, 0.25);
  found.run = part("run").textContent;
  press("ArrowRight");
  found.next = part("says").textContent;
  press("Enter");
  found.second = part("run").textContent;
  const marked = ink();
  press("+"); found.zoomed = ink() !== marked;
  press("0"); found.again = ink() === marked;
  at("pointerdown", 0.5, 0.5); press("+"); at("pointermove", 0.3, 0.5); at("pointerup", 0.3, 0.5);
  found.panned = ink() !== marked; press("0");
  const what = part("what");
  found.shown = [...what.options].map((one) => one.text);
  what.value = "0"; what.dispatchEvent(new Event("change"));
  found.other = ink() !== marked;
  found.legend = part("legend").textContent;
"""


@pytest.fixture(scope="module")
def beam() -> Atlas:
    gap, volts = ("robot.feet.tip.gap", "80 um", "90 um"), ("signals.pzt.amplitude", "4 V", "6 V")
    return ts.atlas("cantilever", x=gap, y=volts, depth=4, coarse=2)


def opened(text: str, folder: Path, steps: str, chromium: Chromium) -> dict[str, Any]:
    """What a page says after some steps in it."""
    probe = READY + PROBE.replace("STEPS", steps)
    text = text.replace("</body>", f"<script>{probe}</script></body>")
    (folder / "atlas.html").write_text(text, encoding="utf-8")
    found = chromium.found_in(folder / "atlas.html", width=1200)
    assert found["faults"] == [] and found["requests"] == 0
    return found


def test_a_page_holds_what_the_atlas_does(beam):
    data = page_data(beam)
    json.dumps(data, allow_nan=False)
    order = beam.grid.source[beam.grid.known]
    for one in data["measures"]:
        name = one["name"].replace(" ", "_")
        kept, own = unpacked(one, 1, gaps=True)[0], beam.measures[name][order]
        assert np.nanmax(np.abs(kept - own)) <= 2e-5 * np.nanmax(np.abs(own)), name
        assert np.array_equal(np.isnan(kept), np.isnan(own))


@pytest.mark.browser
def test_it_says_names_zooms_and_changes(beam, tmp_path, chromium):
    found = opened(atlas_html(beam), tmp_path, STEPS, chromium)
    for key, at in (("says", (8, 4)), ("next", (9, 4))):
        code = int(beam.grid.code[at])
        gap, volts = beam.x.at(at[0] / 16), beam.y.at(at[1] / 16)
        said = f"robot.feet.tip.gap {gap * 1e6:.4g} µm, signals.pzt.amplitude {volts:.4g} V: {words(code)}"
        assert found[key].startswith(said)
    for key, at in (("run", 8), ("second", 9)):
        line = re.fullmatch(
            r"tarsus simulate scene\.toml --set robot\.feet\.tip\.gap=(\S+) --set signals\.pzt\.amplitude=(\S+)"
            r" --duration \S+s",
            found[key],
        )
        assert line and float(line[1]) == pytest.approx(float(beam.x.at(at / 16)), rel=1e-14) and line[2] == "4.5"
    assert found["zoomed"] and found["again"] and found["panned"] and found["other"]
    assert found["shown"][:2] == ["classes", "bounces"] and "touchdowns per drive period" in found["legend"]


@pytest.mark.browser
def test_a_large_page_is_below_4_mb_and_a_larger_one_has_fewer_points(beam, tmp_path, chromium):
    """A map of 1025 points each way of which 90,000 are run, twice as many as of a beam's; and one with 460,000."""
    for rings, most in ((5, 150_000), (40, 600_000)):

        def ask(points, rings=rings):
            return (np.hypot(*(points.T / 1024 - 0.5)) * rings).astype(np.int16) % 3 * 16 + 17

        grid = Quadtree.refined(10, 7, ask)
        assert 70_000 < len(grid.points) < most
        code = grid.code[grid.points[:, 0], grid.points[:, 1]]
        noise = np.random.default_rng(0).random(len(code))
        measures = {name: noise for name in MEASURES if name != "motions"}
        large = Atlas(beam.scene, beam.x, beam.y, 1, grid, code, code[:, None], measures)
        text = atlas_html(large)
        assert len(text.encode()) <= 4_000_000
        steps = 'at("pointermove", 0.25, 0.5); found.says = part("says").textContent;'
        found = opened(text, tmp_path, steps, chromium)
        assert words(int(grid.code[256, 512])) in found["says"] and "touchdown speed" in found["says"]
