"""Whether gaits do what their design says: plain runs of 2 s, on grounds and from starts that no search has seen.

Run ``python benchmarks/gaits_confirmed.py front FOLDER [--gaits robust optimum] [--grounds 400] [--starts 5]`` or
``... adaptive``; ``--json FILE`` keeps the numbers. FOLDER is what `tarsus design gait` wrote; without a front in it
one is designed for speed and written there.

``front``: the scenes of gaits that lie in the folder are simulated as `tarsus.simulate` does it on grounds drawn by
chance from the box, each from starts drawn by chance. Counted are runs within the stated interval, which promises 95 %,
runs that are worse than the worst that any attack on grounds and starts together had found, and grounds on which the
robust gait is faster than the nominal optimum.

``adaptive``: `tarsus.design.adapt`. On its hidden grounds the gait that the table takes, the best single one and the
best of the few, as such runs have them: what is lost, beside what the design says is lost.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

import tarsus as ts
from tarsus.base.arrays import Floats
from tarsus.base.spec import with_values
from tarsus.base.workers import spread
from tarsus.design.grounds import Grounds, drawn, over_of
from tarsus.files.library import load_scene
from tarsus.measure.shares import share_of
from tarsus.measure.walking import measures_of
from tarsus.model.scene import Scene
from tarsus.orbits.starts import Box
from tarsus.solve.run import Shared

DEVICE = "millipede"
FREE = {"gait.frequency": None, "gait.duty": None}
OVER = {"ground.friction.coefficient": (0.2, 0.8), "ground.restitution.coefficient": (0.1, 0.9)}
DURATION = 2.0
"""Of the plain runs [s]; twice what the design walks."""
SEED = 20_261_124
"""Of grounds and starts here; designs have small seeds."""
WORSE = 0.02
"""Share by which a run is worse than the known worst that counts as such: the certificate's own."""


def plain_speeds(scene: Scene, put: Mapping[str, Floats], threads: int) -> Floats:
    """Mean speeds (nr,) [m/s] of a scene with values (nr,) by path, in single runs; 0 of one that does not reach its
    end."""
    shared = Shared()

    def speed(i: int) -> float:
        there = with_values(scene, {path: float(values[i]) for path, values in put.items()})
        run = ts.simulate(there, DURATION, shared=shared)
        return measures_of(run, names=("mean_speed",))["mean_speed"].value if run.ok else 0.0

    count = len(next(iter(put.values())))
    return np.array(list(spread(speed, range(count), threads)))


def put_down(starts: Box, grounds: Grounds, count: int, rng: np.random.Generator) -> dict[str, Floats]:
    """Values (ng count,) by path of grounds, each with so many starts drawn by chance."""
    ends = np.array(list(starts.ends.values()))
    along = ends[:, 0] + np.ptp(ends, axis=1) * rng.random((len(grounds) * count, len(ends)))
    rows = grounds.rows(np.repeat(np.arange(len(grounds)), count))
    return {**rows, **starts.placed(dict(zip(starts.ends, along.T, strict=True)))}


def confirmed_front(asked: argparse.Namespace) -> dict[str, Any]:
    """The front's statements beside what plain runs say."""
    clock, file = time.process_time(), asked.folder / "gaits.json"
    if not file.exists():
        ts.design.gait(
            DEVICE, FREE, "speed", over=OVER, candidates=asked.candidates, seed=asked.seed, threads=asked.threads
        ).write(asked.folder)  # fmt: skip
    designed, found = time.process_time() - clock, json.loads(file.read_text(encoding="utf-8"))
    starts, rng = Box.of(load_scene(DEVICE), None), np.random.default_rng(SEED)
    over = over_of(starts.scene, OVER)
    assert over is not None
    grounds = drawn(over, asked.grounds, rng)
    put = put_down(starts, grounds, asked.starts, rng)
    told: dict[str, Any] = {"grounds": asked.grounds, "starts": asked.starts, "design_cpu_s": designed}
    by_ground = {}
    for name in asked.gaits:
        scene = load_scene(asked.folder / "gaits" / f"{name}.toml")
        got = plain_speeds(with_values(scene, {"initial": starts.scene.initial}), put, asked.threads)
        stated = (
            found[name] if name in ("robust", "optimum") else found["front"][int(name.rpartition("-")[2]) - 1]
        )
        low, high = stated["intervals"]["speed"]
        worst, means = stated["worst"]["speed"], got.reshape(-1, asked.starts).mean(axis=1)
        by_ground[name] = means
        told[name] = {
            "stated": {"nominal": stated["nominal"]["speed"], "worst_found": worst, "interval": [low, high]},
            "mean": float(got.mean()), "least": float(got.min()), "most": float(got.max()),
            "worst_twentieth": float(np.sort(got)[: max(len(got) // 20, 1)].mean()),
            "within": share_of(int(((got >= low) & (got <= high)).sum()), len(got)),
            "ground_means_within": share_of(int(((means >= low) & (means <= high)).sum()), len(means)),
            "worse_than_found": share_of(int((got < (1.0 - WORSE) * worst).sum()), len(got)),
        }  # fmt: skip
    if {"robust", "optimum"} <= set(by_ground):
        faster = int((by_ground["robust"] > by_ground["optimum"]).sum())
        told["robust_faster_on"], told["stated_better"] = share_of(faster, asked.grounds), found["better"]
    return told | {"certificate": found["certificate"], "cpu_s": time.process_time() - clock}


def confirmed_adaptive(asked: argparse.Namespace) -> dict[str, Any]:
    """The table's regret beside that of plain runs, on the design's hidden grounds."""
    clock = time.process_time()
    found = ts.design.adapt(
        DEVICE, FREE, OVER, "slip", candidates=asked.candidates, training=asked.training, hidden=asked.hidden,
        gaits=asked.most, seed=asked.seed, threads=asked.threads,
    )  # fmt: skip
    designed, starts = time.process_time() - clock, Box.of(load_scene(DEVICE), None)
    put = put_down(starts, found.grounds, asked.starts, np.random.default_rng(SEED))
    speeds = [plain_speeds(with_values(starts.scene, dict(one)), put, asked.threads) for one in found.gaits]
    by_gait = np.stack([one.reshape(-1, asked.starts).mean(axis=1) for one in speeds], axis=1)
    each = np.arange(len(by_gait))
    return {
        "hidden": len(each), "starts": asked.starts, "gaits": len(found.gaits), "probes": len(found.probes),
        "stated": {
            "taken": -float(found.costs[each, found.chosen].mean()), "knows": -float(found.known.mean()),
            "regret": found.regret, "interval": found.regret_interval, "single": found.fixed_regret,
        },
        "taken": float(by_gait[each, found.chosen].mean()), "single": float(by_gait.mean(axis=0).max()),
        "best_of_the_few": float(by_gait.max(axis=1).mean()),
        "design_cpu_s": designed, "cpu_s": time.process_time() - clock, "walks": found.runs,
    }  # fmt: skip


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=("front", "adaptive"))
    parser.add_argument("folder", type=Path, nargs="?", default=Path("gaits"), help="of a front")
    parser.add_argument("--gaits", nargs="+", default=["robust", "optimum"], help="of a front: files there")
    parser.add_argument("--grounds", type=int, default=400, help="of a front")
    parser.add_argument("--starts", type=int, default=5, help="on each ground")
    parser.add_argument("--candidates", type=int, default=400)
    parser.add_argument("--most", type=int, default=10, help="gaits of a table")
    parser.add_argument("--training", type=int, default=64, help="grounds of a table")
    parser.add_argument("--hidden", type=int, default=40, help="grounds that it is tried on")
    parser.add_argument("--seed", type=int, default=0, help="of the designs")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--json", type=Path, help="file for the numbers")
    asked = parser.parse_args()
    text = json.dumps({"front": confirmed_front, "adaptive": confirmed_adaptive}[asked.what](asked), indent=1)
    if asked.json is not None:
        asked.json.write_text(text + "\n", encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
