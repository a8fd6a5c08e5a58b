"""How long an explorer takes from a slider to what is drawn, in Chromium without a window.

    python benchmarks/explorer.py [DEVICE ...]

Every number below is of 60 moves of one slider of the ground, or of the drive, in the page as it is written, on this
machine's clock: from the input event to when the moving picture and all figures are drawn. `whole` is the time from the
same event to the measures and figures of the whole run, where the slider rests then.
"""

import json
import os
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

import tarsus as ts
from chromium import READY, Chromium  # pyright: ignore[reportMissingImports]

DEVICES = ("cantilever", "millipede", "hexapod", "millipede-30")
MOVES = 60
SCRIPT = """
const root = document.querySelector(".explore"), faults = [];
addEventListener("error", (event) => faults.push(event.message));
const shown = () => new Promise((done) => root.addEventListener("shown", ({ detail }) => done(detail), { once: true }));
const passed = (ms) => new Promise((done) => setTimeout(done, ms));
addEventListener("DOMContentLoaded", async () => {
  await shown();
  await passed(400);
  const turnable = root.explorer.turnable, out = { moves: [], rests: [], faults };
  const chosen = [turnable.find((one) => !one.stops), turnable.find((one) => one.stops)].filter(Boolean);
  const turn = async (one, place) => {
    const begun = performance.now();
    one.input.value = place;
    one.input.dispatchEvent(new Event("input"));
    const detail = await shown();
    await null; // figures are drawn in a microtask
    await null;
    return { wall: performance.now() - begun, worker: detail.took, engine: detail.ran, end: detail.finish[0] };
  };
  for (let n = 0; n < MOVES; n++) {
    const one = chosen[n % chosen.length], place = Math.round(one.most * (0.2 + 0.6 * ((n * 7) % MOVES) / MOVES));
    out.moves.push(await turn(one, place === Number(one.input.value) ? place + 1 : place));
    await passed(8);
  }
  for (let n = 0; n < 6; n++) {
    const begun = performance.now();
    let seen = await turn(chosen[0], Math.round(chosen[0].most * (0.2 + 0.1 * n)));
    if (root.explorer.brief) { await shown(); await null; await null; }
    out.rests.push({ wall: performance.now() - begun });
    await passed(100);
  }
  ready(out);
});
"""


def measured(name: str, folder: Path) -> dict:
    page = ts.explore(name, duration="0.2 s").html()
    probe = f"<script>{READY}{SCRIPT.replace('MOVES', str(MOVES))}</script></body>"
    path = folder / f"{name}.html"
    path.write_text(page.replace("</body>", probe), encoding="utf-8")
    with Chromium(folder / "profile") as browser:
        return browser.found_in(path)


def main() -> None:
    print(f"load {os.getloadavg()[0]:.1f}")
    with tempfile.TemporaryDirectory() as folder:
        for name in sys.argv[1:] or DEVICES:
            found = measured(name, Path(folder))
            assert not found["faults"], found["faults"]
            wall, worker = (np.array([one[key] for one in found["moves"]]) for key in ("wall", "worker"))
            rests = np.array([one["wall"] for one in found["rests"]])
            print(
                f"{name:13} move to frames: median {np.median(wall):.0f} ms, 95 % {np.percentile(wall, 95):.0f} ms; "
                f"in the worker {np.median(worker):.0f} ({np.percentile(worker, 95):.0f}); whole run drawn after "
                f"{np.median(rests):.0f} ms; first move {json.dumps(found['moves'][0])}"
            )


if __name__ == "__main__":
    main()
