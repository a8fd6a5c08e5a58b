"""From vibrometer records to an impact map: the hexapod near the ground and in the air.

    python examples/impact_records.py

No raw records of the source exist, so they are made: the packaged hexapod is simulated over a gap of 10 um and far from
the ground, and a synthetic vibrometer records both, three times each, with noise 40 dB below the motion and a trigger
that is late by up to a sample. Then the records are processed as in section 3.4.2: aligned, subtracted (3.27),
restitution (3.30) and velocity changes (3.32) by differences of samples, and by the fit of free motion on both sides of
each impact. The truth is known here: restitution 0.51 and an impulse at the foot; small forces are left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import tarsus as ts
from tarsus.impacts import ImpactMapEstimate, compare_with_modes, detect_impacts, estimate_impact_map, subtract
from tarsus.model.structure import Structure
from tarsus.records.measurement import Measurement
from tarsus.synthesis import Vibrometer
from tarsus_reproduce.plain_figures import PlainFigures, plain_figures

FOOT = "foot1"
POINTS = tuple(f"foot{i}" for i in range(1, 7))


@dataclass(frozen=True)
class Result:
    """Estimates beside the truth: restitution [1] and column (6,) [1]."""

    structure: Structure
    estimate: ImpactMapEstimate
    plain: PlainFigures
    restitution: float
    column: np.ndarray


def made_records(near: ts.Scene, repeats: int, duration: float = 0.06) -> tuple[list[Measurement], list[Measurement]]:
    """Repeats of records near the ground and in the air (3 cm away)."""
    far = ts.with_values(near, {f"robot.feet.{FOOT}.gap": 0.03})
    close, in_air = ts.simulate(near, duration), ts.simulate(far, duration)
    instrument = Vibrometer(rate=200e3, jitter=5e-6).at_level(close, POINTS, decibels=40.0)
    return (
        [instrument.measure(close, POINTS, seed) for seed in range(repeats)],
        [instrument.measure(in_air, POINTS, 100 + seed) for seed in range(repeats)],
    )


def impulse_column(structure: Structure) -> np.ndarray:
    """Velocity changes (6,) of the feet per unit change at the contact foot, of an impulse there."""
    mass = structure.matrices().mass
    rows = np.array([structure.row(point) for point in POINTS])
    changes = rows @ np.linalg.solve(mass, structure.row(FOOT))
    return changes / changes[0]


def processed(repeats: int = 3) -> Result:
    """Make records of the packaged hexapod and estimate its impact map from them."""
    # a ground that only bounces, mass-weighted, and a drive that leaves room between the impacts
    scene = ts.with_values(
        ts.load_scene("hexapod"),
        {
            "ground": ts.Ground(restitution=ts.Restitution(coefficient=0.51)),
            "signals.pzt": ts.Square(amplitude=10.0, frequency=20.0),
            "robot.drives.pzt.law.gain": 2.4329e-6,
        },
    )
    structure = scene.robot.structure
    closes, airs = made_records(scene, repeats)
    estimate = estimate_impact_map(closes, airs, structure, FOOT)
    difference = subtract(closes[0], airs[0], estimate.repeats[0].alignments[0])
    plain = plain_figures(closes[0], difference, FOOT, detect_impacts(difference, FOOT))
    assert scene.ground.restitution is not None
    return Result(structure, estimate, plain, scene.ground.restitution.coefficient, impulse_column(structure))


def table(result: Result) -> str:
    """The estimates beside the truth, as text."""
    estimate = result.estimate
    lines = [
        f"{' '.join(repeat.refused) or 'The repeat is accepted.'} {repeat.alignments[0].overall:.1%} of the signal "
        "before contact is left."
        for repeat in estimate.repeats
    ]
    lines += [f"{len(estimate.fitted)} impacts fitted", ""]
    lines.append(f"{'':12s} {'truth':>8s} {'estimate, 95 % interval':>32s} {'by differences':>18s}")
    rows = [("restitution", result.restitution, estimate.restitution, result.plain.restitution_spread)]
    rows += list(zip(estimate.names, result.column, estimate.column, result.plain.column_spread, strict=True))
    for name, truth, found, rough in rows:
        shown = f"{found.value:.4f} [{found.low:.4f}, {found.high:.4f}]"
        lines.append(f"{name:12s} {truth:8.4f} {shown:>32s} {rough.value:10.3f} +- {rough.scatter:.2f}")
    alike = compare_with_modes(estimate.values, result.structure, POINTS)
    share, hertz = alike.assurance[alike.best], alike.frequencies[alike.best]
    lines += ["", f"most like mode {alike.best + 1} of {hertz:.0f} Hz: MAC {share:.3f}"]
    return "\n".join(lines)


if __name__ == "__main__":
    print(table(processed()))
