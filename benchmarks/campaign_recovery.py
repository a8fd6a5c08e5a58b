"""How well devices are recovered from synthetic campaigns, and whether the intervals hold.

Run ``python benchmarks/campaign_recovery.py [devices] [first] [decibels]``, by default 200 devices from seed 1
at 40 dB. Every trial draws a device, all numbers that a campaign identifies within 20 % of the cantilever's,
writes its campaign into a temporary folder and identifies it. Printed are the errors of every number and how often
its 95 % interval covers the truth; trials that were not identified are listed with their reasons. A trial takes
about half a minute.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.spec import float_paths
from tarsus.files.library import load_scene
from tarsus.identify.campaign import read_campaign
from tarsus.identify.chain import Identification, identify
from tarsus.model.scene import Scene
from tarsus.synthesis.campaign_folder import write_campaign
from tarsus.synthesis.devices import perturbed
from tarsus.synthesis.recordings import Instrument

DEVICE, SPREAD = "cantilever-capture", 0.2
FILM = "C / g0^3"
GOALS = {
    "robot.structure.frequencies": 5e-4,
    "robot.structure.damping_ratios": 0.03,
    "ground.restitution.coefficient": 0.03,
    "ground.adhesion": 0.10,
    FILM: 0.15,
}


@dataclass
class Tally:
    """Over trials, by number: errors relative to the truth (absolute where it is zero), and whether it was covered."""

    errors: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    covered: dict[str, list[bool]] = field(default_factory=lambda: defaultdict(list))
    seconds: list[float] = field(default_factory=list)
    failed: list[str] = field(default_factory=list)

    def add(self, name: str, value: float, true: float, low: float, high: float) -> None:
        """One number of one trial."""
        self.errors[name].append(value / true - 1.0 if true else value)
        self.covered[name].append(low <= true <= high)


def scored(tally: Tally, found: Identification, truth: Scene) -> None:
    """Add what one trial found."""
    true = float_paths(truth)
    for step in found.steps.values():
        for path, value in zip(step.paths, step.values, strict=True):
            tally.add(path, float(value), true[path].value, *step.interval(path))
    if "film" in found.steps and truth.ground.film is not None:
        value, draws, _ = found.steps["film"].combinations[FILM]
        film = truth.ground.film
        low, high = np.quantile(draws, [0.025, 0.975])
        tally.add(FILM, value, film.coefficient / film.thickness**3, float(low), float(high))


def trial(tally: Tally, seed: int, decibels: float) -> None:
    """One device: drawn, recorded, identified."""
    truth = perturbed(load_scene(DEVICE), SPREAD, seed)
    with tempfile.TemporaryDirectory() as folder:
        try:
            write_campaign(truth, Path(folder), Instrument(snr_db=decibels), seed)
            start = time.perf_counter()
            found = identify(read_campaign(folder))
        except InputError as error:
            tally.failed.append(f"seed {seed}: {error}")
            return
    tally.seconds.append(time.perf_counter() - start)
    tally.failed += [f"seed {seed}: {one.name}: {'; '.join(one.reasons)}" for one in found.not_done]
    scored(tally, found, truth)


def goal_of(name: str) -> float | None:
    """Relative error that a number must stay below."""
    return next((goal for start, goal in GOALS.items() if name.startswith(start)), None)


def report(tally: Tally) -> str:
    """The figures as text."""
    lines = [
        f"{'number':42s} {'n':>4s} {'mean |error|':>13s} {'95 % below':>11s} {'worst':>9s} {'covers':>7s}  goal"
    ]
    for name, errors in tally.errors.items():
        size = np.abs(errors)
        goal = goal_of(name)
        met = "" if goal is None else f"{goal:.2%}: {np.count_nonzero(size <= goal)} of {len(size)}"
        lines.append(
            f"{name:42s} {len(size):4d} {size.mean():13.3g} {np.quantile(size, 0.95):11.3g} {size.max():9.3g} "
            f"{np.mean(tally.covered[name]):7.1%}  {met}"
        )
    goals = [np.mean(tally.covered[name]) for name in tally.errors if goal_of(name) is not None]
    if goals:
        lines.append(f"numbers with a goal: covered in {np.mean(goals):.1%}, at least {np.min(goals):.1%}")
    if tally.seconds:
        lines.append(
            f"identification: {np.mean(tally.seconds):.1f} s on average, {np.max(tally.seconds):.1f} s at most"
        )
    return "\n".join([*lines, *tally.failed])


def main(arguments: list[str]) -> None:
    count = int(arguments[0]) if arguments else 200
    first = int(arguments[1]) if len(arguments) > 1 else 1
    decibels = float(arguments[2]) if len(arguments) > 2 else 40.0
    tally = Tally()
    for seed in range(first, first + count):
        trial(tally, seed, decibels)
        print(f"seed {seed} done, {len(tally.failed)} not", file=sys.stderr, flush=True)
    print(report(tally))


if __name__ == "__main__":
    main(sys.argv[1:])
