"""What a step of a robot costs, and thousands of robots against a batch, in CPU time of one process.

    python benchmarks/stepping.py
    python benchmarks/stepping.py --robots 256 --steps 20

A step is 1 ms under volts that are new every time. The batch runs the same robots for the same time, at the same
accuracy, under the same volts as one signal a robot; both on one thread, one after the other, `ROUNDS` times.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import numpy as np

import tarsus as ts

ROUNDS = 5


def cpu(of: Callable[[], object]) -> float:
    """CPU time [s] of a call."""
    begin = time.process_time()
    of()
    return time.process_time() - begin


def one_robot(name: str, steps: int = 200) -> tuple[float, float]:
    """CPU time [s] of a step of 1 ms through a session, and of a millisecond of one run over all of it."""
    scene = ts.load_scene(name)
    volts = np.random.default_rng(1).uniform(0.0, 14.0, (steps, len(scene.robot.drives)))
    commands = [dict(zip(scene.robot.drives, own.tolist(), strict=True)) for own in volts]
    sim = ts.Session(scene)
    sim.reset()
    for command in commands[:5]:
        sim.step(command, "1 ms")

    def stepped() -> None:
        sim.reset()
        for command in commands:
            sim.step(command, "1 ms")

    waves = {
        f"signals.{drive}": {"kind": "on_off", "levels": own.tolist(), "durations": [1e-3] * steps}
        for drive, own in zip(scene.robot.drives, volts.T, strict=True)
    }
    session = ts.Session(ts.with_values(scene, waves))
    session.run({}, steps * 1e-3)
    pairs = [(cpu(stepped), cpu(lambda: session.run({}, steps * 1e-3))) for _ in range(ROUNDS)]
    step, run = np.min(pairs, axis=0) / steps
    return float(step), float(run)


def many_robots(name: str, robots: int, steps: int) -> tuple[float, float]:
    """CPU time [s] of robots in steps of 1 ms, and of a batch of them."""
    scene = ts.load_scene(name)
    drives = list(scene.robot.drives)
    volts = np.random.default_rng(1).uniform(0.0, 14.0, (steps, len(drives), robots))
    ground = np.linspace(1e-7, 1e-6, robots)
    sim = ts.Session(scene, robots=robots, vary={"ground.adhesion.initial": ground}, threads=1)
    waves = {
        f"signals.{drive}": {"kind": "on_off", "levels": [0.0] * steps, "durations": [1e-3] * steps}
        for drive in drives
    }
    vary: dict[str, object] = {"ground.adhesion.initial": ground}
    for d, drive in enumerate(drives):
        vary |= {f"signals.{drive}.levels.{k}": volts[k, d] for k in range(steps)}
    session = ts.Session(ts.with_values(scene, waves))

    def stepped() -> None:
        sim.reset()
        for own in volts:
            sim.step(dict(zip(drives, own, strict=True)), "1 ms")

    def batch() -> None:
        session.batch(vary, steps * 1e-3, threads=1)  # type: ignore[arg-type]

    stepped()
    pairs = np.array([(cpu(stepped), cpu(batch)) for _ in range(ROUNDS)])
    return tuple(np.median(pairs, axis=0).tolist())


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--robots", type=int, default=1024)
    parser.add_argument("--steps", type=int, default=20)
    asked = parser.parse_args()
    for name in ("millipede", "cantilever", "hexapod-walker"):
        step, run = one_robot(name)
        print(f"{name}: a step of 1 ms {1e3 * step:.3f} ms, of a run 1 ms {1e3 * run:.3f} ms", flush=True)
    step, run = many_robots("millipede", asked.robots, asked.steps)
    print(
        f"millipede, {asked.robots} robots, {asked.steps} ms: {step:.2f} s, batch {run:.2f} s, {step / run:.2f}"
    )
