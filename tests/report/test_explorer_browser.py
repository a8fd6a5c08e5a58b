"""The explorer in a browser without a window: sliders run the engine in the page, as `simulate` runs the scene."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

import tarsus as ts
from chromium import READY
from tarsus.report.pages import asset

pytestmark = pytest.mark.browser

PROBE = """
const faults = [], found = {}, root = document.querySelector(".explore"),
part = (name) => root.querySelector(`.explore-${name}`);
addEventListener("error", (event) => faults.push(event.message));
window.requestAnimationFrame = () => 0;
const next = () => new Promise((done) => {
  root.addEventListener("shown", ({ detail }) => done(detail), { once: true });
});
const shown = async () => { // the whole run, and not its beginning alone
  let detail = await next();
  while (detail.brief) detail = await next();
  return detail;
};
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
  ready(found);
});
"""


def watched(folder, chromium, explorer, steps: str) -> dict[str, Any]:
    """What steps find in an explorer's page."""
    probe = f"<script>{READY}{PROBE.replace('STEPS', steps)}</script></body>"
    path = folder / "explore.html"
    path.write_text(explorer.html().replace("</body>", probe), encoding="utf-8")
    found = chromium.found_in(path)
    assert found["faults"] == [] and found["requests"] == []
    return found


def same_events(found: dict[str, Any], run: ts.Run) -> np.ndarray:
    """Events of a run, which are those that a page found."""
    wanted = run.motion.log.events
    rows = np.array([np.nan if one is None else one for one in found["events"]], dtype=float)
    rows = rows.reshape(-1, wanted.shape[1])
    np.testing.assert_array_equal(rows[:, 1:3], wanted[:, 1:3])
    np.testing.assert_allclose(rows[:, 0], wanted[:, 0], rtol=0.0, atol=1e-9)
    return wanted


@pytest.fixture(scope="module")
def explorer():
    return ts.explore("cantilever", duration="60 ms")


def test_sliders_run_the_scene_as_simulate_does(tmp_path, chromium, explorer):
    found = watched(
        tmp_path,
        chromium,
        explorer,
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
    )
    run = explorer.run(found["values"])
    assert set(found["values"]) == {"robot.feet.tip.gap", "signals.pzt.amplitude"} and found["back"] == {}
    wanted = same_events(found, run)
    for name, value in found["measures"].items():
        assert run.measures[name].value == pytest.approx(np.nan if value is None else value, rel=1e-7, nan_ok=True), (
            name
        )
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


def test_an_incline_is_turned_and_a_walk_s_cost_is_told(tmp_path, chromium):
    climber = ts.explore(ts.load_scene("millipede", **{"ground.incline": 0.05}), duration="60 ms")
    found = watched(
        tmp_path,
        chromium,
        climber,
        """
        await turn("incline", 350);
        Object.assign(found, { values: explorer.values, events: [...explorer.shown.events],
          measures: explorer.named(explorer.shown.measures) });
        """,
    )
    run = climber.run(found["values"])
    assert set(found["values"]) == {"ground.incline"}
    same_events(found, run)
    for name in ("electrical_energy", "cost_of_transport", "stride"):
        assert found["measures"][name] == pytest.approx(run.measures[name].value, rel=1e-6), name


def test_while_a_slider_moves_the_beginning_of_the_run_is_shown(tmp_path, chromium, explorer):
    """As if the machine were slow: the figures hold the first periods, exactly, the measures wait for the whole."""
    found = watched(
        tmp_path,
        chromium,
        explorer,
        """
        explorer.pace = 1e6;
        explorer.take({}); // a whole run, which is let go
        const input = [...root.querySelectorAll(".explore-slider input")][0], later = next();
        input.value = Number(input.value) + 3;
        input.dispatchEvent(new Event("input"));
        const first = await later;
        found.behind = explorer.turn - first.turn;
        Object.assign(found, { brief: first.brief, end: explorer.shown.end, words: part("part").textContent,
          waits: part("measures").classList.contains("explore-waits"), values: explorer.values,
          time: [...explorer.shown.time], gap: [...explorer.shown.gap[0]] });
        part("freeze").click();
        found.early = explorer.frozen;
        const last = await next();
        Object.assign(found, { last: last.brief, whole: explorer.shown.end, said: part("part").textContent,
          frozen: explorer.frozen.end, measures: explorer.named(explorer.shown.measures) });
        """,
    )
    assert found["behind"] == 0 and found["brief"] and not found["last"]
    assert found["whole"] == found["frozen"] == 0.06
    assert found["end"] == pytest.approx(0.015) and found["waits"] and found["early"] is None
    assert found["words"].startswith("The first 15 ms while the slider moves") and found["said"] == ""
    run = explorer.run(found["values"])
    gap = run.states(np.array(found["time"])).gap[0]
    np.testing.assert_allclose(found["gap"], gap, rtol=0.0, atol=1e-6 * gap.max())
    assert found["measures"]["peak"] == pytest.approx(run.measures["peak"].value, rel=1e-7)


def test_every_control_is_reached_by_keyboard(tmp_path, chromium, explorer):
    """In the order of the page, and the button of a slider takes its value back; keys that the browser itself makes are
    those of its own range inputs and buttons."""
    found = watched(
        tmp_path,
        chromium,
        explorer,
        """
        const all = [...root.querySelectorAll("a[href], button, input, select, [tabindex]")];
        const seen = all.filter((one) => one.checkVisibility());
        found.reached = seen.map((one) => { one.focus(); return document.activeElement === one; });
        found.jumps = seen.filter((one) => one.tabIndex > 0).length;
        await turn("tip gap", 120);
        const input = root.querySelector(".explore-slider input");
        Object.assign(found, { spoken: input.getAttribute("aria-valuetext"),
          written: input.parentNode.querySelector("output").textContent });
        root.querySelector(".explore-slider button").click();
        await shown();
        found.back = explorer.values;
        """,
    )
    assert len(found["reached"]) > 15 and all(found["reached"]) and found["jumps"] == 0
    assert found["spoken"] == found["written"] and found["back"] == {}


def test_what_stops_the_engine_is_told_and_the_page_goes_on(tmp_path, chromium, explorer):
    found = watched(
        tmp_path,
        chromium,
        explorer,
        """
        const asked = { turn: 0, frames: 10, points: 10, seen: [0, 0.01], end: 0.01 };
        explorer.whole.run({ ...asked, row: [["rows.nothing", [0], 1]], place: 0 });
        await rest();
        found.said = part("says").textContent;
        explorer.whole.run({ ...asked, row: [["rows.channels", [0], 99999999n]], place: 99999 });
        await rest();
        await turn("tip gap", 100);
        found.later = explorer.shown.code;
        found.hidden = part("says").hidden;
        """,
    )
    assert found["said"].startswith("The engine stopped: ") and found["later"] == 0 and found["hidden"]


def test_the_widget_of_a_notebook_carries_values_both_ways(tmp_path, chromium, explorer):
    script = asset("widget.js").replace("export default", "const widget =")
    inner = json.dumps(explorer.html()).replace("</", "<" + chr(92) + "/")
    page = f"""<!DOCTYPE html><html lang="en"><title>widget</title><body><div></div><script>
{READY}
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
    first, *_, last = chromium.found_in(path)
    assert first["values"] == {} and last["values"] == {"robot.feet.tip.gap": 5e-5}
    assert last["measures"]["peak"] == pytest.approx(explorer.run(last["values"]).measures["peak"].value, rel=1e-7)
