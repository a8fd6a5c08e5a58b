"""A ball dropped from 1 m: every impact against its closed form, and the end of infinitely many bounces.

With restitution e the flights last t0, 2 e t0, 2 e^2 t0, ..., t0 = sqrt(2 h / g), so the ball rests after
t0 (1 + e) / (1 - e).
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

import tarsus as ts

SCENE = Path(__file__).parent / "scenes" / "bouncing_ball.toml"


def impact_times(restitution: float, height: float = 1.0, gravity: float = 9.81, count: int = 6) -> np.ndarray:
    """Closed-form impact times [s], shape [count]."""
    fall = math.sqrt(2.0 * height / gravity)
    flights = 2.0 * fall * restitution ** np.arange(1, count)
    return fall + np.concatenate([[0.0], np.cumsum(flights)])


def largest_error() -> float:
    """Largest relative error of the first six impact times at e = 0.9 [1]."""
    run = ts.simulate(ts.load_scene(SCENE), duration=4.0)
    bounces = run.events[run.events["kind"] == 1]
    exact = impact_times(0.9)
    return float(np.max(np.abs(bounces["time"][: len(exact)] / exact - 1.0)))


def time_of_rest(restitution: float = 0.7) -> float:
    """When a ball that bounces infinitely often comes to rest [s]."""
    run = ts.simulate(ts.load_scene(SCENE, **{"ground.restitution.coefficient": restitution}), duration=4.0)
    rests = run.events[run.events["kind"] == 4]
    return float(rests["time"][0])


if __name__ == "__main__":
    print(f"impact times agree with the closed form to {largest_error():.1e}")
    fall = math.sqrt(2.0 / 9.81)
    print(f"at rest after {time_of_rest():.10f} s; closed form {fall * (1 + 0.7) / (1 - 0.7):.10f} s")
