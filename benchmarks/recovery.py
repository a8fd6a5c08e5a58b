"""How well restitution and impact column are recovered from synthetic vibrometer records, and whether intervals hold.

Run ``python benchmarks/recovery.py [trials] [decibels]``. Every trial draws a drive (square or sine, its frequency),
a gap and a restitution, simulates the printed hexapod near the ground and in the air, records both with a vibrometer
whose noise lies 40 dB below the velocities and whose trigger is late by up to a sample, and estimates the impact map.
Printed are the errors and in how many trials the 95 % intervals cover the truth.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import tarsus as ts
from tarsus.impacts.impact_map import ImpactMapEstimate, estimate_impact_map
from tarsus.synthesis.vibrometer import Vibrometer

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from printed_robots import POINTS, hexapod, printed

DURATION = 0.12
RATE = 200e3


@dataclass(frozen=True)
class Trial:
    """One trial: the drive, the truth, and what was estimated."""

    drive: str
    restitution: float
    estimate: ImpactMapEstimate


def true_column() -> np.ndarray:
    """Velocity changes (6,) per unit change at foot 1, of an impulse at it."""
    mobility = np.linalg.inv(printed()[0])[:, 0]
    return mobility / mobility[0]


def run_trial(seed: int, decibels: float = 40.0) -> Trial:
    """Simulate, record and estimate with everything drawn from one seed."""
    random = np.random.default_rng(seed)
    square = bool(random.integers(2))
    wave, hz = (ts.Square, random.uniform(15.0, 60.0)) if square else (ts.Sine, random.uniform(60.0, 140.0))
    restitution = float(random.uniform(0.3, 0.7))
    signal = wave(amplitude=10.0, frequency=hz)
    near = hexapod(signal=signal, gap=float(random.uniform(8e-6, 12e-6)), restitution=restitution)
    far = ts.with_values(near, {"robot.feet.foot1.gap": 0.03})
    close, in_air = (ts.simulate(scene, DURATION) for scene in (near, far))
    vibrometer = Vibrometer(rate=RATE, jitter=1.0 / RATE).at_level(close, POINTS, decibels)
    records = [vibrometer.measure(run, POINTS, 2 * seed + i) for i, run in enumerate((close, in_air))]
    estimate = estimate_impact_map(*records, near.robot.structure, "foot1")
    return Trial(f"{'square' if square else 'sine'} {hz:.0f} Hz", restitution, estimate)


@dataclass(frozen=True)
class Recovery:
    """Over all trials: relative errors of restitution (nt,) and column (nt,) (norm over norm), and whether the 95 %
    intervals cover the truth: restitution (nt,), each other point of the column (nt, 5); impacts used (nt,)."""

    restitution_error: np.ndarray
    column_error: np.ndarray
    restitution_covered: np.ndarray
    column_covered: np.ndarray
    impacts: np.ndarray


def recovery(trials: list[Trial]) -> Recovery:
    """Score trials against their truth."""
    column = true_column()
    found = np.array([trial.estimate.values for trial in trials])
    e = np.array([trial.restitution for trial in trials])
    spreads = [trial.estimate.restitution for trial in trials]
    return Recovery(
        np.array([s.value for s in spreads]) / e - 1.0,
        np.linalg.norm(found - column, axis=1) / np.linalg.norm(column),
        np.array([s.low <= truth <= s.high for s, truth in zip(spreads, e, strict=True)]),
        np.array(
            [
                [s.low <= b <= s.high for s, b in zip(t.estimate.column[1:], column[1:], strict=True)]
                for t in trials
            ]
        ),
        np.array([len(t.estimate.fitted) for t in trials]),
    )


def report(result: Recovery) -> str:
    """The figures as text."""
    lines = [
        f"{len(result.impacts)} trials, {result.impacts.min()} to {result.impacts.max()} impacts used in each"
    ]
    for name, error in (("restitution", result.restitution_error), ("column", result.column_error)):
        size = np.abs(error)
        lines.append(
            f"{name}: mean absolute error {size.mean():.2%}, 95 % of trials below {np.quantile(size, 0.95):.2%}, "
            f"worst {size.max():.2%}"
        )
    lines.append(f"restitution: interval covers in {result.restitution_covered.mean():.1%}")
    each = ", ".join(f"{share:.1%}" for share in result.column_covered.mean(axis=0))
    lines.append(f"column: intervals cover in {each}")
    return "\n".join(lines)


def main(arguments: list[str]) -> None:
    count = int(arguments[0]) if arguments else 200
    decibels = float(arguments[1]) if len(arguments) > 1 else 40.0
    start = time.perf_counter()
    trials = []
    for seed in range(count):
        try:
            trials.append(run_trial(seed, decibels))
        except ts.InputError as error:
            print(f"trial {seed}: {error}")
    print(report(recovery(trials)))
    print(f"{time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main(sys.argv[1:])
