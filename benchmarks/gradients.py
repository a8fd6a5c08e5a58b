"""What derivatives of a measure cost, in runs without any, by however many numbers.

    python benchmarks/gradients.py --counts 8 64 256 --repeats 7

P1's chain of two masses at the accuracy of single runs; CPU time, runs and gradients in turn; medians.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import numpy as np

import tarsus as ts
from tarsus.model.scene import Scene
from tarsus.study import bench

MEASURE = "impact_speed"


def cases(counts: list[int]) -> dict[str, tuple[Scene, list[str], float]]:
    """By name: a scene, paths of its numbers and how long to run it [s]."""
    square = bench.chain(2)
    drive = [f"signals.pull.{name}" for name in ("amplitude", "frequency", "offset", "duty", "phase")]
    ground = ["robot.drives.pull.law.gain", "ground.restitution.coefficient", "robot.feet.tip.gap"]
    found = {f"square wave, {seconds:g} s": (square, drive + ground, seconds) for seconds in (0.2, 1.0)}
    for count in counts:
        rng, half = np.random.default_rng(3), count // 2
        levels = np.where(np.arange(half) % 2, -8.0, 8.0) * (1.0 + 0.05 * rng.normal(size=half))
        lasting = 0.01 * (1.0 + 0.1 * rng.normal(size=half))
        switched = ts.OnOff(levels=tuple(levels), durations=tuple(lasting))
        paths = [f"signals.pull.{field}.{k}" for field in ("levels", "durations") for k in range(half)]
        scene = ts.with_values(square, {"signals": {"pull": switched}})
        found[f"{count} levels and durations"] = scene, paths, float(lasting.sum())
        times = 0.0025 * np.arange(count)
        volts = 8.0 * np.sin(100.0 * np.pi * times) * (1.0 + 0.1 * rng.normal(size=count))
        sampled = ts.with_values(
            square, {"signals": {"pull": ts.Sampled(times=tuple(times), levels=tuple(volts))}}
        )
        paths = [f"signals.pull.levels.{k}" for k in range(count)]
        found[f"{count} samples"] = sampled, paths, float(times[-1])
    return found


def seconds_of(work: Callable[[], object]) -> float:
    """CPU time [s]."""
    start = time.process_time()
    work()
    return time.process_time() - start


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--counts", type=int, nargs="+", default=[8, 64, 256])
    parser.add_argument("--repeats", type=int, default=7)
    asked = parser.parse_args()
    for name, (scene, paths, seconds) in cases(asked.counts).items():
        works: tuple[Callable[[], object], ...] = (
            lambda scene=scene, seconds=seconds: ts.simulate(scene, seconds),
            lambda scene=scene, paths=paths, seconds=seconds: ts.gradient(MEASURE, scene, paths, seconds),
        )
        spent = np.array([[seconds_of(work) for work in works] for _ in range(asked.repeats + 1)])[1:]
        run, derived = np.median(spent, axis=0)
        print(f"{name:28s} run {run * 1e3:6.2f} ms, derivatives {derived / run:5.2f}")


if __name__ == "__main__":
    main()
