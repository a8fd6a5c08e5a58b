"""The animation of a robot's points: its data, and that a browser plays it."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tarsus as ts
from chromium import READY, Chromium
from laboratory import LABORATORY
from tarsus.report.packing import unpacked
from tarsus.report.pages import page
from tarsus.report.points import FRAMES, points_section
from tarsus.report.series import series_of


def section(name: str | Path) -> tuple[Any, str]:
    run: Any = ts.simulate(ts.load_scene(name), 0.04)
    series = series_of(run)
    return series, points_section(run, series, series.whole, 3)


def data(text: str) -> dict[str, Any]:
    found = re.search(r'class="points-data">(.*?)</script>', text, re.DOTALL)
    assert found
    return json.loads(found[1])


def test_it_shows_the_run() -> None:
    series, text = section(LABORATORY)
    found = data(text)
    assert found["beam"] and found["names"] == list(series.points) and "Figure 3." in text
    tip = unpacked(found["y"][found["names"].index("tip")], 1)[0]
    assert len(tip) <= FRAMES
    exact = np.interp(
        np.linspace(0.0, 0.04, len(tip)), series.time, series["displacement"][series.points.index("tip")]
    )
    np.testing.assert_allclose(tip, exact, atol=np.ptp(exact) / 60000)
    (foot,) = found["feet"]
    assert foot["level"] == pytest.approx(-70e-6) and len(foot["held"]) > 2
    assert found["across"] == pytest.approx([375 / 825, 1.0]) or found["across"] == pytest.approx(
        [1.0, 375 / 825]
    )


def test_robots_that_are_no_beam_have_their_points_side_by_side() -> None:
    _, text = section("hexapod")
    found = data(text)
    assert not found["beam"] and len(found["names"]) == 6
    assert found["across"] == pytest.approx([i / 7 for i in range(1, 7)])


PROBE = """
const found = {}, faults = [], turns = [];
addEventListener("error", (event) => faults.push(event.message));
window.requestAnimationFrame = (turn) => turns.push(turn);
addEventListener("load", () => setTimeout(() => {
  const root = document.querySelector(".points"), clock = () => root.querySelector("output").textContent;
  const press = () => root.querySelector("button").click(), tick = (ms) => turns.splice(0).forEach((turn) => turn(ms));
  found.still = clock();
  press(); tick(0); tick(6000);
  found.half = clock();
  press();
  found.label = root.querySelector("button").textContent;
  tick(9000);
  found.paused = clock();
  const slider = root.querySelector("input");
  slider.value = slider.max; slider.dispatchEvent(new Event("input"));
  found.end = clock();
  found.faults = faults;
  ready(found);
}, 100));
"""


@pytest.mark.browser
def test_a_browser_plays_it(tmp_path: Path, chromium: Chromium) -> None:
    path = tmp_path / "points.html"
    whole = page("points", section(LABORATORY)[1]).replace("</head>", f"<script>{READY}{PROBE}</script></head>")
    path.write_text(whole, encoding="utf-8")
    found = chromium.found_in(path)
    assert found["faults"] == [] and found["still"] == "0.00 ms" and found["end"] == "40.00 ms"
    assert float(found["half"].split()[0]) == pytest.approx(20.0, abs=0.2)
    assert found["paused"] == found["half"] and found["label"] == "Play"
