"""Panels over time: what uPlot is given to draw, and that a browser draws, zooms and darkens it."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chromium import READY, Chromium
from packed_series import unpacked
from tarsus.report.pages import page
from tarsus.report.panels import POINTS, Bars, DrawnLine, Level, Sign, TimePanel, Window, panels_html
from tarsus.report.style import BLUE, GREEN, INK, level_limits, thinned


def spec(panels: Sequence[TimePanel], window: Window | None = None, unit: str = "") -> dict[str, Any]:
    """What the script is given."""
    text = panels_html(panels, "what is seen", window, across="", unit=unit)
    found = re.search(r'class="charts-data">(.*?)</script>', text, re.DOTALL)
    assert found
    return json.loads(found[1])


def one_panel(*lines: DrawnLine, **others: Any) -> TimePanel:
    return TimePanel(1.0, lines=lines, **others)


def times(found: dict[str, Any], panel: int = 0) -> np.ndarray:
    data = found["x"][found["panels"][panel]["x"]]["data"]
    return np.frombuffer(base64.b64decode(data), dtype="<f4")


def line(found: dict[str, Any], panel: int = 0, row: int = 0) -> np.ndarray:
    return unpacked(found["panels"][panel]["series"][row]["values"], 1, gaps=True)[0]


def test_lines_come_as_they_are_with_their_gaps() -> None:
    x = np.linspace(0.0, 2.0, 301)
    y = np.where(x < 1.0, np.sin(20.0 * x), np.nan)
    panels = [one_panel(DrawnLine(x, y, BLUE, "a <b>"))]
    found = spec(panels)
    np.testing.assert_allclose(times(found), x, rtol=1e-7)
    np.testing.assert_allclose(line(found), y, atol=2.0 / 65533)
    assert found["window"] == [0.0, 2.0] and found["panels"][0]["series"][0]["stroke"] == "c-blue"
    assert "a &lt;b&gt;" in panels_html(panels, "what is seen")


def test_panels_share_times_and_lines_of_other_times_are_read_between() -> None:
    x = np.linspace(0.0, 1.0, 11)
    upper, falling = one_panel(DrawnLine(x, x, BLUE)), DrawnLine(x, -x, GREEN)
    assert len(spec([upper, one_panel(falling)])["x"]) == 1
    found = spec([upper, one_panel(falling, DrawnLine(x[::2] + 0.05, 2.0 * x[::2], INK))])
    assert len(found["x"]) == 2 and len(times(found, 1)) == 17
    np.testing.assert_allclose(line(found, 1, 0), -np.minimum(times(found, 1), 1.0), atol=1e-4)


def test_long_series_keep_their_peaks() -> None:
    x = np.linspace(0.0, 1.0, 200_001)
    rows = np.stack([np.sin(40.0 * x), np.cos(7.0 * x)])
    rows[0, 123_457], rows[0, 55_555] = 9.0, -7.0
    rows[1, 1000:9000] = np.nan
    times_, thin = thinned(x, rows, 600)
    assert thin.shape == (2, 600) == (2, len(times_)) and np.all(np.diff(times_) > 0)
    assert (times_[0], times_[-1], thin[0].max(), thin[0].min()) == (0.0, 1.0, 9.0, -7.0)
    assert np.isnan(thin[1]).any() and np.nanmax(thin[1]) == 1.0
    rising = thinned(x, x[None, :], 600)[1][0]
    assert np.all(np.diff(rising) >= 0.0), "extremes come in the order that the series goes"
    assert len(times(spec([one_panel(DrawnLine(x, x, BLUE))]))) == POINTS


def test_rows_shading_and_levels_are_told() -> None:
    rows = one_panel(
        shaded=[(0.5, 0.75), (4.5, 5.0), (1.0, 1.0)],
        bars=[Bars([(1.0, 3.0), (5.0, 6.0)], -0.35, 0.35, INK)],
        levels=[Level(2.0, GREEN, (5, 3))],
        signs=[Sign("stuck", area=True)],
        limits=(1.5, -0.5),
        names=("L1", "R1"),
    )
    (panel,) = spec([rows], (0.0, 4.0))["panels"]
    assert panel["bars"] == [{"color": "ink", "low": -0.35, "high": 0.35, "spans": [[1.0, 3.0]]}], "what is seen"
    assert panel["shaded"] == [[0.5, 0.75], [1.0, pytest.approx(1.0 + 4.0 / 1500.0)]], "no contact is too short to see"
    assert panel["names"] == ["L1", "R1"]
    assert panel["limits"] == [1.5, -0.5]
    assert panel["levels"] == [{"at": 2.0, "color": "c-green", "dash": [5.25, 3.15]}]
    assert "stuck" in panels_html([rows], "what is seen", (0.0, 4.0))


PROBE = """
const found = {}, faults = [], root = document.documentElement;
addEventListener("error", (event) => faults.push(event.message));
function look() {
  const { built } = document.querySelector(".charts");
  const press = (name) => document.querySelector(`[data-zoom="${name}"]`).click();
  const scale = () => built.plots.map((plot) => [plot.scales.x.min, plot.scales.x.max]);
  const point = (x) => built.plots.forEach((plot) => plot.setCursor({ left: plot.valToPos(x, "x"), top: 9 }));
  const read = () => [...document.querySelectorAll(".names output")].map((one) => one.textContent);
  const drawn = (color) => {
    const { canvas } = built.plots[0].ctx;
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    for (let i = 0; i < data.length; i += 4) if (`${data.slice(i, i + 4)}` === `${color},255`) return true;
    return false;
  };
  const steps = [
    () => { found.whole = scale(); found.light = drawn("0,114,178"); document.getElementById("theme").click(); },
    () => { found.dark = drawn("74,168,228"); found.theme = root.dataset.theme; press("in"); },
    () => { found.near = scale(); press("on"); },
    () => { found.on = scale(); press("all"); document.querySelector("button[data-lines]").click(); },
    () => { found.down = built.plots[1].valToPos(1, "y") > built.plots[1].valToPos(0, "y"); },
    () => { found.again = scale(); found.hidden = !built.plots[0].series[1].show; point(1.02); },
    () => { found.read = read(); },
    () => {
      found.faults = faults;
      found.requests = performance.getEntriesByType("resource").length;
      ready(found);
    },
  ];
  steps.forEach((step, i) => setTimeout(step, 100 * (i + 1)));
}
addEventListener("load", look);
"""


@pytest.mark.browser
def test_a_browser_draws_zooms_and_darkens(tmp_path: Path, chromium: Chromium) -> None:
    x = np.linspace(0.0, 8.0, 400)
    sine = DrawnLine(x, np.sin(x), BLUE, "sine", 4.0)
    panels = [one_panel(sine), one_panel(sine, limits=(1.5, -1.5))]  # the second counts downward
    shown = panels_html(panels, "a sine", across="", unit="")
    text = page("charts", f"<h1>Charts</h1>{shown}").replace("</head>", f"<script>{READY}{PROBE}</script></head>")
    path = tmp_path / "charts.html"
    path.write_text(text, encoding="utf-8")
    found = chromium.found_in(path)
    assert found["faults"] == [] and found["requests"] == 0
    assert found["whole"] == found["again"] == [[0, 8]] * 2
    assert found["near"] == [[2, 6]] * 2 and found["on"] == [[4, 8]] * 2
    assert float(found["read"][0]) == pytest.approx(np.sin(1.02), abs=0.01)
    assert found["light"] and found["dark"] and found["theme"] == "dark" and found["hidden"]
    assert found["down"]


def test_what_is_one_to_rounding_is_a_level_line():
    level = 0.667 + 1e-13 * np.arange(20.0)
    low, high = level_limits(level) or (0.0, 0.0)
    assert low < 0.64 and high > 0.69
    assert level_limits(level, level + 1e-6) is None and level_limits(np.zeros(3)) is None
    lines = [DrawnLine(np.arange(20.0), level, BLUE)]
    assert spec([one_panel(*lines)])["panels"][0]["limits"] == pytest.approx((low, high))
    assert spec([one_panel(*lines, limits=(0.0, None))])["panels"][0]["limits"] == [0.0, None]


def test_axes_stand_under_a_prefix_of_what_is_seen():
    x = np.linspace(0.0, 5e-3, 51)
    heights = DrawnLine(x, np.where(x < 1e-3, 9.0, 3e-6 * x / x[-1]), BLUE)
    panels = [TimePanel(1.0, "height", "m", [heights], levels=[Level(1e-6, INK)], bars=[Bars([], 0.0, 3e-6, INK)])]
    window = (2e-3, 4e-3)
    found, text = spec(panels, window, "s"), panels_html(panels, "what is seen", window)
    (panel,) = found["panels"]
    assert found["window"] == [2.0, 4.0] and panel["levels"][0]["at"] == pytest.approx(1.0)
    assert panel["bars"][0]["high"] == pytest.approx(3.0)
    assert "height (µm)" in text and "time (ms)" in text
    assert times(found)[[0, -1]] == pytest.approx([2.0, 4.0])
    assert line(found).max() == pytest.approx(2.4, abs=1e-3)


def test_lines_of_one_name_are_one_to_a_reader():
    x = np.linspace(0.0, 1.0, 3)
    lines = [DrawnLine(x, k * x, BLUE, name) for k, name in enumerate(("upward", "friction", "upward"))]
    text = panels_html([one_panel(*lines)], "what is seen", (0.0, 1.0))
    names = re.findall(r'data-lines="([\d ]+)" aria-label="([\w ]+)"', text)
    assert names == [("1 3", "upward"), ("2", "friction")]


def test_prefixes_are_changed_in_what_is_read_and_not_in_data():
    text = '{"note": "5 um", "text": "<div class=\\"charts\\">"}'
    data = f'<script type="application/json">{text}</script>'
    whole = page("a page", f"<h2>Gaps of 5 um</h2><p>70 um</p>{data}<p>3 uN</p>")
    assert data in whole and "Gaps of 5 µm" in whole and "<p>70 µm</p>" in whole and "<p>3 µN</p>" in whole
    assert "uPlot" not in whole  # no chart, so no program for charts
    assert "uPlot" in page("charts", '<div class="charts"></div>')
