"""A four-legged piezoelectric robot of 1.27 g trots: what public numbers predict beside what was measured.

python examples/trotting_quadruped.py [REPORT.html]
"""

from __future__ import annotations

import math
import sys
from itertools import product

import numpy as np
from numpy.typing import NDArray

import tarsus as ts
from tarsus.solve import Run

MEASURED = 0.44
"""Fastest speed of the robot [m/s], 10.1 body lengths a second (Baisch and others, IJRR 2014)."""
DAMPING, RESTITUTION, FRICTION = (0.3, 0.5, 0.8), (0.1, 0.3, 0.5), (0.4, 0.51, 0.6)
"""What is not known: damping ratio of a foot in the air, restitution, friction."""


def trot(hz: float = 50.0, duration: float = 0.5) -> Run:
    """A run of the packaged robot at a stride frequency [Hz]."""
    return ts.simulate(ts.load_scene("hamr-like", hz=hz), duration)


def speeds(hz: NDArray[np.float64], duration: float = 1.0) -> NDArray[np.float64]:
    """Mean speeds (nf,) [m/s] at stride frequencies (nf,) [Hz]."""
    return ts.simulate_batch(ts.load_scene("hamr-like"), {"gait.frequency": hz}, duration).measure("mean_speed")


def spread(hz: float = 50.0, duration: float = 1.0) -> NDArray[np.float64]:
    """Mean speeds (27,) [m/s] over everything that is not known."""
    scene = ts.load_scene("hamr-like", hz=hz)
    grounds = np.array(list(product(RESTITUTION, FRICTION)))
    vary = {"ground.restitution.coefficient": grounds[:, 0], "ground.friction.coefficient": grounds[:, 1]}
    found = []
    for ratio in DAMPING:
        damped = ts.with_values(
            scene,
            {
                f"robot.structure.legs.{name}.damping_{axis}": 2.0 * ratio * math.sqrt(stiffness * leg.mass)
                for name, leg in scene.robot.structure.legs.items()
                for axis, stiffness in (("v", leg.stiffness_v), ("l", leg.stiffness_l))
            },
        )
        found.append(ts.simulate_batch(damped, vary, duration).measure("mean_speed"))
    return np.concatenate(found)


if __name__ == "__main__":
    frequencies = np.array([10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0])
    for hz, speed in zip(frequencies, speeds(frequencies), strict=True):
        print(f"{hz:4.0f} Hz  {speed:6.3f} m/s")
    low, middle, high = np.quantile(spread(), (0.0, 0.5, 1.0))
    print(f"50 Hz, over all that is not known: {low:.2f} to {high:.2f} m/s, median {middle:.2f}; measured {MEASURED}")
    if len(sys.argv) > 1:
        from tarsus.report import write_report

        print(f"wrote {write_report(trot(), sys.argv[1])}")
