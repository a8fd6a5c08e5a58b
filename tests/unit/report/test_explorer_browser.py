"""The explorer in a browser without a window: sliders run the engine in the page, as `simulate` runs the scene."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

import tarsus as ts
from chromium import HOLD, found_in
from tarsus.report.pages import asset

pytestmark = pytest.mark.browser

PROBE = """
const faults = [], found = {}, root = document.querySelector(".explore"),
part = (name) => root.querySelector(`.explore-${name}`);
addEventListener("error", (event) => faults.push(event.message));
window.requestAnimationFrame = () => 0;
const shown = () => new Promise((done) => root.addEventListener("shown", ({ detail }) => done(detail), { once: true }));
addEventListener("DOMContentLoaded", async () => {
  await shown();
  const explorer = root.explorer, rest = () => new Promise((done) => setTimeout(done, 300));
  const turn = async (name, place) => {
    const input = [...root.querySelectorAll(".explore-slider input")].find((one) =>
    one.getAttribute("aria-label") === name);
    input.value = place;
    const later = shown();
    input.dispatchEvent(new Event("input"));
    await later;
  };
  STEPS
  await rest();
  found.faults = faults;
  found.requests = performance.getEntriesByType("resource").map((one) => one.name).filter((name) =>
  !name.startsWith("blob:"));
  found.wide = document.documentElement.scrollWidth - innerWidth;
  ready(found);
});
"""


def watched(folder, explorer, steps: str, *options: str) -> dict[str, Any]:
    """What steps find in an explorer's page."""
    probe = f"<script>{HOLD}{PROBE.replace('STEPS', steps)}</script></body>"
    path = folder / "explore.html"
    path.write_text(explorer.html().replace("</body>", probe), encoding="utf-8")
    found = found_in(path, *options, time=None)
    assert found["faults"] == [] and found["requests"] == []
    return found


@pytest.fixture(scope="module")
def explorer():
    return ts.explore("cantilever", duration="60 ms")


def test_sliders_run_the_scene_as_simulate_does(tmp_path, explorer):
    found = watched(
        tmp_path, explorer,
        """
        part("freeze").click();
        await turn("tip gap", 120);
        await turn("pzt amplitude", 4);
        await rest();
        Object.assign(found, { values: explorer.values, events: [...explorer.shown.events], measures:
        explorer.named(explorer.shown.measures),
          gap: [...explorer.shown.gap[0]], time: [...explorer.shown.time], line: explorer.line(),
          python: explorer.python(),
          heads: [...part("measures").querySelectorAll("th")].map((one) => one.textContent),
          tally: part("tally").textContent });
        part("line").click();
        found.copied = part("copied").textContent;
        part("reset").click();
        await shown();
        found.back = explorer.values;
        """,
    )  # fmt: skip
    run = explorer.run(found["values"])
    assert set(found["values"]) == {"robot.feet.tip.gap", "signals.pzt.amplitude"} and found["back"] == {}
    wanted = run.motion.log.events
    rows = np.array([np.nan if one is None else one for one in found["events"]], dtype=float).reshape(
        -1, wanted.shape[1]
    )
    np.testing.assert_array_equal(rows[:, 1:3], wanted[:, 1:3])
    np.testing.assert_allclose(rows[:, 0], wanted[:, 0], rtol=0.0, atol=1e-9)
    for name, value in found["measures"].items():
        assert run.measures[name].value == pytest.approx(
            np.nan if value is None else value, rel=1e-7, nan_ok=True
        ), name
    gap = run.states(np.array(found["time"])).gap[0]
    np.testing.assert_allclose(found["gap"], gap, rtol=0.0, atol=1e-6 * gap.max())
    assert found["heads"] == ["measure", "value", "spread", "A", "change from A"]
    assert "(A: " in found["tally"] and found["copied"] == found["line"]
    scope: dict[str, Any] = {}
    exec(found["python"].replace("print(", "("), scope)
    np.testing.assert_array_equal(scope["run"].motion.log.events, wanted)
    words = [word.removeprefix('"') for word in found["line"].split("--set ")[1:]]
    changes = {path: text.strip().strip('"') for path, _, text in (word.partition("=") for word in words)}
    again = ts.simulate(ts.load_scene("cantilever", **{path: text for path, text in changes.items()}), 0.06)
    np.testing.assert_array_equal(again.motion.log.events, wanted)


def test_what_stops_the_engine_is_told_and_the_page_goes_on(tmp_path, explorer):
    found = watched(
        tmp_path, explorer,
        """
        explorer.busy = true;
        explorer.worker.postMessage({ row: [["rows.nothing", [0], 1]], place: 0, frames: 10, points: 10,
        seen: [0, 0.01] });
        await rest();
        found.said = part("says").textContent;
        explorer.worker.postMessage({ row: [["rows.channels", [0], 99999999n]], place: 99999, frames: 10,
        points: 10, seen: [0, 0.01] });
        await rest();
        await turn("tip gap", 100);
        found.later = explorer.shown.code;
        found.hidden = part("says").hidden;
        """,
    )  # fmt: skip
    assert found["said"].startswith("The engine stopped: ") and found["later"] == 0 and found["hidden"]


def test_it_fits_a_phone(tmp_path, explorer):
    found = watched(tmp_path, explorer, "await turn('tip gap', 90);", "--window-size=420,900")
    assert found["wide"] <= 0


def test_the_widget_of_a_notebook_carries_values_both_ways(tmp_path, explorer):
    script = asset("widget.js").replace("export default", "const widget =")
    inner = json.dumps(explorer.html()).replace("</", "<" + chr(92) + "/")
    page = f"""<!DOCTYPE html><html lang="en"><title>widget</title><body><div></div><script>
{HOLD}
{script}
const state = {{ page: {inner}, values: {{}}, measures: {{}} }}, told = [];
const model = {{ get: (name) => state[name], set: (name, value) => {{ state[name] = value; }}, off: () => null,
  on: (_, call) => {{ model.call = call; }},
  save_changes: () => {{
    told.push({{ values: state.values, measures: state.measures }});
    if (told.length === 1) {{ state.values = {{ "robot.feet.tip.gap": 5e-5 }}; model.call(); }}
    if (state.values["robot.feet.tip.gap"] && told.length > 1) ready(told);
  }} }};
widget.render({{ model, el: document.querySelector("div") }});
</script></body></html>"""
    path = tmp_path / "widget.html"
    path.write_text(page, encoding="utf-8")
    first, *_, last = found_in(path, time=None)
    assert first["values"] == {} and last["values"] == {"robot.feet.tip.gap": 5e-5}
    assert last["measures"]["peak"] == pytest.approx(
        explorer.run(last["values"]).measures["peak"].value, rel=1e-7
    )
