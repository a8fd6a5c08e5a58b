"""What a hysteretic actuator and a bouncing robot cost: ``python benchmarks/robots.py``.

A sine through hysteresis beside a square wave, per simulated second of a beam; an impact of a hexapod of six modes with
its own impact map, in impacts of P1 with 6 masses; random initial states of 1 s each with their statistics.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from tarsus.base.events import IMPACTS
from tarsus.files.library import load_scene
from tarsus.plan.lowering import lower_scene
from tarsus.plan.rows import rows_of
from tarsus.solve import Engine
from tarsus.study import bench
from tarsus_reproduce.seeds import foot_statistics


def hysteresis_figures(repeats: int, duration: float = 1.0) -> dict[str, Any]:
    found = {}
    for wave in ("square", "sine"):
        plan = lower_scene(load_scene(bench.scene_file("hysteresis"), volts=8.0, hz=50.0, wave=wave))
        engine, rows = Engine(plan, duration), rows_of(plan)
        engine.run(rows, bench.ACCURACY)
        best, _ = bench.fastest(lambda: engine.run(rows, bench.ACCURACY), repeats)  # noqa: B023
        found[f"hysteresis_{wave}_ms"] = best * 1e3 / duration
    return {**found, "hysteresis_ratio": found["hysteresis_sine_ms"] / found["hysteresis_square_ms"]}


def robot_figures(repeats: int, chain_ms_per_impact: float, seeds: int = 64) -> dict[str, Any]:
    scene = load_scene(bench.scene_file("hexapod"))
    plan, duration = lower_scene(scene), 1.0
    engine, rows = Engine(plan, duration), rows_of(plan)
    raw = engine.run(rows)
    best, _ = bench.fastest(lambda: engine.run(rows), repeats)
    impacts = int(np.isin(raw.events[:, 2], IMPACTS).sum())
    start = time.perf_counter()
    foot_statistics(scene, seeds, duration=0.8, settle=0.2, window=0.02)
    return {
        "hexapod_us_per_impact": best * 1e6 / impacts,
        "hexapod_ratio": best * 1e3 / impacts / chain_ms_per_impact,
        "hexapod_impacts": impacts,
        "hexapod_seeds_per_s": seeds / (time.perf_counter() - start),
    }


def main(repeats: int = 25) -> None:
    """Print every figure."""
    chain = bench.TimedChain(6)
    impacts = len(chain.impacts())
    seconds, _ = bench.fastest(chain.impacts, repeats)
    for name, value in (
        hysteresis_figures(repeats) | robot_figures(repeats, seconds * 1e3 / impacts)
    ).items():
        print(f"{name}: {value:.4g}")


if __name__ == "__main__":
    main()
