"""What another value of a number costs in a batch, against another parameter of a ground law.

    python benchmarks/slots.py --runs 60 1000 --seconds 0.2 0.03 --repeats 5

P1's chain of two masses at the accuracy of batches, one thread; CPU time, kinds of numbers taken in turn; medians.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

import tarsus as ts
from tarsus.model.scene import Scene
from tarsus.study import bench

VOLTS, HERTZ = 8.0, 50.0


def kinds(count: int) -> dict[str, tuple[str, Scene, dict[str, np.ndarray]]]:
    """By name: what it is held against, the scene, and values in no order."""
    spread = np.random.default_rng(1).permutation(np.linspace(-1.0, 1.0, count))
    square = bench.chain(2)

    def driven(wave: object) -> Scene:
        return ts.with_values(square, {"signals": {"pull": wave}})

    sine = driven(ts.Sine(amplitude=VOLTS, frequency=HERTZ))
    switched = driven(ts.OnOff(levels=(VOLTS, -VOLTS), durations=(0.01, 0.01), repeat=True))
    moved = ts.with_values(square, {"initial": ts.Initial(displacement=(0.0, 0.0))})
    restitution = {"ground.restitution.coefficient": 0.378 * (1.0 + 0.2 * spread)}
    one, other = "a law, square wave", "a law, sine"
    stiffness = ts.get_value(square, "robot.structure.stiffness.1.1")
    damping = ts.get_value(square, "robot.structure.damping.1.1")
    return {
        one: (one, square, restitution),
        "gap": (one, square, {"robot.feet.tip.gap": 7e-5 * (1.0 + 0.1 * spread)}),
        "initial state": (one, moved, {"initial.displacement.1": 1e-6 * (1.0 + spread)}),
        "amplitude": (one, square, {"signals.pull.amplitude": VOLTS * (1.0 + 0.1 * spread)}),
        "offset": (one, square, {"signals.pull.offset": spread}),
        "phase": (one, square, {"signals.pull.phase": np.pi * (1.0 + spread)}),
        "gain": (
            one,
            square,
            {"robot.drives.pull.law.gain": square.robot.drives["pull"].law.gain * (1.0 + 0.1 * spread)},
        ),
        "duty": (one, square, {"signals.pull.duty": 0.5 + 0.2 * spread}),
        "switching time": (one, switched, {"signals.pull.durations.0": 0.01 * (1.0 + 0.1 * spread)}),
        "frequency of the drive": (one, square, {"signals.pull.frequency": HERTZ * (1.0 + 0.1 * spread)}),
        other: (other, sine, restitution),
        "amplitude of a sine": (other, sine, {"signals.pull.amplitude": VOLTS * (1.0 + 0.1 * spread)}),
        "phase of a sine": (other, sine, {"signals.pull.phase": np.pi * (1.0 + spread)}),
        "stiffness": (one, square, {"robot.structure.stiffness.1.1": stiffness * (1.0 + 0.01 * spread)}),
        "damping": (one, square, {"robot.structure.damping.1.1": damping * (1.0 + 0.01 * spread)}),
    }


def measure(count: int, seconds: float, repeats: int) -> None:
    """Print what a run costs, by kind."""
    cases = kinds(count)
    spent: dict[str, list[float]] = {name: [] for name in cases}
    for _ in range(repeats):
        for name, (_, scene, vary) in cases.items():
            begun = time.process_time()
            ts.simulate_batch(scene, vary, seconds, threads=1)
            spent[name].append(time.process_time() - begun)
    for name, (against, _, _) in cases.items():
        own, base = float(np.median(spent[name])), float(np.median(spent[against]))
        print(
            f"{count:5d} runs of {seconds:g} s  {name:24s} {1e3 * own / count:8.3f} ms a run  {own / base:6.2f}"
        )


def main() -> None:
    """Measure what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, nargs="+", default=[60])
    parser.add_argument("--seconds", type=float, nargs="+", default=[0.2])
    parser.add_argument("--repeats", type=int, default=5)
    given = parser.parse_args()
    for count in given.runs:
        for seconds in given.seconds:
            measure(count, seconds, given.repeats)


if __name__ == "__main__":
    main()
