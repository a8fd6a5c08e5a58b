"""The animation in a browser without a window."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from chromium import READY, Chromium
from tarsus.report.pages import page
from tarsus.report.player import walk_figure
from tarsus.tables.numbers import amount
from walking_devices import walk

pytestmark = pytest.mark.browser

PROBE = """
const found = {}, faults = [];
addEventListener("error", (event) => faults.push(event.message));
const root = document.querySelector(".walk"), part = (name) => root.querySelector(`.walk-$${name}`);
const clock = () => part("clock").textContent;
const ink = (canvas) => {
  const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
  let sum = 0;
  for (let i = 0; i < data.length; i += 4) sum = (sum * 31 + data[i] + data[i + 1] + data[i + 2] + data[i + 3]) | 0;
  return sum;
};
const turns = [];
window.requestAnimationFrame = (turn) => turns.push(turn);
const tick = (ms) => turns.splice(0).forEach((turn) => turn(ms));
const press = (target, key) =>
  target.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true }));
const move = (frame) => { part("time").value = frame; part("time").dispatchEvent(new Event("input")); };
$steps
found.faults = faults;
found.requests = performance.getEntriesByType("resource").length;
ready(found);
"""


@pytest.fixture(scope="module")
def watch(tmp_path_factory: pytest.TempPathFactory, chromium: Chromium) -> Callable[[int, str], dict[str, Any]]:
    """Open the page of a walk of so many legs, take some steps in it, and return what they found."""
    folder = tmp_path_factory.mktemp("walk")

    def go(legs: int, steps: str) -> dict[str, Any]:
        probe = READY + PROBE.replace("$$", "$").replace("$steps", steps)
        text = page("walk", walk_figure(walk(legs)).picture).replace("</body>", f"<script>{probe}</script></body>")
        path = folder / f"walk{legs}.html"
        path.write_text(text, encoding="utf-8")
        return chromium.found_in(path)

    return go


def test_it_plays_pauses_and_shows_what_the_motion_says(watch: Callable[[int, str], dict[str, Any]]) -> None:
    found = watch(
        6,
        """
        found.live = root.classList.contains("live") && !part("live").hidden;
        found.start = clock();
        found.frames = Number(part("time").max) + 1;
        found.speed = Number(part("speed").value);
        const before = ink(part("stage"));
        part("play").click();
        found.label = part("play").getAttribute("aria-label");
        for (let ms = 300; ms <= 1300; ms += 20) tick(ms);
        press(part("time"), " ");
        found.paused = part("play").getAttribute("aria-label");
        found.played = clock();
        found.moved = ink(part("stage")) !== before;
        for (let ms = 1320; ms <= 1600; ms += 20) tick(ms);
        found.held = clock();
        move(550);
        found.at550 = clock();
        found.spoken = part("time").getAttribute("aria-valuetext");
        found.says = part("says").textContent;
        part("next").click();
        found.next = clock();
        part("back").click();
        part("back").click();
        found.back = clock();
        """,
    )
    motion = walk(6).thinned(found["frames"])
    times = [amount(float(motion.time[i]), "s", 4) for i in range(found["frames"])]
    assert found["live"]
    assert found["start"] == times[0] == "0 s"
    assert found["speed"] == pytest.approx(0.01), "a drive period of 20 ms in two seconds"
    assert (found["label"], found["paused"]) == ("Pause", "Play")
    assert float(found["played"].split()[0]) == pytest.approx(10.0, abs=0.11), "a second of watching, to a frame"
    assert found["moved"] and found["held"] == found["played"]
    assert (found["back"], found["at550"], found["next"]) == (times[549], times[550], times[551])
    assert found["spoken"] == found["at550"]
    surge = amount(float(motion.body["surge"][550]), "m", 3)
    stuck = " ".join(name for leg, name in enumerate(motion.legs) if motion.state[leg, 550] == 1)
    assert found["says"].startswith(f"Travel {surge}, height ") and stuck and f", {stuck} stuck" in found["says"]
    assert found["faults"] == [] and found["requests"] == 0


def test_choices_change_the_picture_and_a_click_on_a_figure_moves_the_time(
    watch: Callable[[int, str], dict[str, Any]],
) -> None:
    found = watch(
        30,
        """
        move(321);
        const pictures = [ink(part("stage"))];
        const choose = (name, change) => {
          change(part(name));
          part(name).dispatchEvent(new Event("change"));
          pictures.push(ink(part("stage")));
        };
        choose("up", (select) => (select.selectedIndex += 1));
        choose("along", (select) => (select.selectedIndex += 1));
        choose("forces", (box) => (box.checked = false));
        choose("follow", (box) => (box.checked = false));
        found.pictures = pictures;
        found.factors = [...part("up").options].map((one) => Number(one.value));
        const marks = [];
        addEventListener("walktime", ({ detail }) => marks.push(detail));
        dispatchEvent(new CustomEvent("seek", { detail: 9 }));
        found.end = clock();
        [found.mark] = marks;
        part("play").click();
        for (let ms = 0; ms <= 300; ms += 20) tick(ms);
        found.again = parseFloat(clock());
        found.playing = part("play").getAttribute("aria-label");
        """,
    )
    assert len(set(found["pictures"])) == 5
    assert found["factors"] == sorted(found["factors"]) and found["factors"][0] >= 1
    assert found["end"] == "200 ms" and found["mark"] == pytest.approx(0.2), "no later than it ends"
    assert found["again"] == pytest.approx(3.0, abs=0.2) and found["playing"] == "Pause", "from the start again"
    assert found["faults"] == [] and found["requests"] == 0
