"""How long an explorer takes from a slider to what is drawn, in Chromium without a window.

    python benchmarks/explorer.py [DEVICE ...]

Every number below is of 60 moves of one slider of the ground, or of the drive, in the page as it is written, on this
machine's clock: from the input event to when the moving picture and all figures are drawn, those out of sight too.
Every frame is looked at: its picture and figures are the run that the engine made of the slider's number. `whole` is
the time from the same event to the measures and figures of the whole run, where the slider rests then.
"""

import os
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

import tarsus as ts
from chromium import Chromium  # pyright: ignore[reportMissingImports]

DEVICES = ("cantilever", "millipede", "hexapod", "millipede-30")
MOVES = 60
CONTENT = Path(__file__).parents[1] / "tests" / "unit" / "report" / "interactions.js"
"""Functions that say what an explorer shows, and whether it is what its engine ran."""
SCRIPT = """
const root = document.querySelector(".explore"), { explorer } = root;
const next = () => new Promise((done) => root.addEventListener("shown", ({ detail }) => done(detail), { once: true }));
const shown = async () => { // of where the sliders are now, and not of where they were
  let detail = await next();
  while (detail.turn !== explorer.turn) detail = await next();
  return detail;
};
const passed = (ms) => new Promise((done) => setTimeout(done, ms));
await settled();
const out = { moves: [], rests: [], faults: [], followed: 0 };
explorer.charts.plots.forEach((_, i) => { explorer.charts.inSight[i] = true; }); // as on a screen that holds all
const chosen = [(one) => !one.stops, (one) => one.stops].map((of) => explorer.turnable.find(of)).filter(Boolean);
const turn = async (one, place) => {
  const begun = performance.now();
  one.input.value = place;
  one.input.dispatchEvent(new Event("input"));
  const detail = await shown();
  await null; // figures are drawn in a microtask
  await null;
  return { wall: performance.now() - begun, worker: detail.took };
};
let before = shownBy(explorer);
for (let n = 0; n < MOVES; n++) {
  const one = chosen[n % chosen.length], place = Math.round(one.most * (0.2 + 0.6 * ((n * 7) % MOVES) / MOVES));
  out.moves.push(await turn(one, place === Number(one.input.value) ? place + 1 : place));
  const after = shownBy(explorer);
  out.followed += after.film !== before.film;
  out.faults.push(...differences(explorer));
  before = after;
  await passed(8);
}
for (let n = 0; n < 6; n++) {
  const begun = performance.now();
  await turn(chosen[0], Math.round(chosen[0].most * (0.2 + 0.1 * n)));
  while (explorer.busy) { await shown(); await null; await null; }
  out.rests.push(performance.now() - begun);
  out.faults.push(...differences(explorer));
  await passed(100);
}
return out;
"""


def measured(name: str, folder: Path) -> dict:
    """Times of an explorer's moves [ms], of frames that were looked at: each is the run that its slider asked for."""
    file = folder / f"{name}.html"
    ts.explore(name, file, duration="0.2 s")
    with (
        Chromium(folder / "profile") as browser,
        browser.page(file, before=CONTENT.read_text(encoding="utf-8")) as opened,
    ):
        found = opened.run(SCRIPT.replace("MOVES", str(MOVES)))
        faults = found["faults"] + opened.faults
    assert not faults, faults[:5]
    assert found["followed"] >= 0.9 * MOVES, f"{found['followed']} of {MOVES} moves changed the picture"
    return found


def main() -> None:
    print(f"load {os.getloadavg()[0]:.1f}")
    with tempfile.TemporaryDirectory() as folder:
        for name in sys.argv[1:] or DEVICES:
            found = measured(name, Path(folder))
            wall, worker = (np.array([one[key] for one in found["moves"]]) for key in ("wall", "worker"))
            print(
                f"{name:13} move to frames: median {np.median(wall):.0f} ms, 95 % {np.percentile(wall, 95):.0f} ms; "
                f"in the worker {np.median(worker):.0f} ({np.percentile(worker, 95):.0f}); whole run drawn after "
                f"{np.median(found['rests']):.0f} ms; {found['followed']} of {MOVES} frames differ from the one before"
            )


if __name__ == "__main__":
    main()
