"""How far the ground must be for a foot to miss it: many runs of one scene, one changed number each."""

from __future__ import annotations

import numpy as np

import tarsus as ts

GAP = "robot.feet.tip.gap"


def least_clearance(duration: float = 0.02, halvings: int = 24) -> float:
    """Smallest gap [m] that the cantilever's tip does not cross within ``duration`` [s], by halving."""
    session = ts.Session(ts.load_scene("cantilever", volts=8, hz=50, wave="square"))
    low, high = 0.0, 1e-3
    for _ in range(halvings):
        middle = 0.5 * (low + high)
        touched = bool(len(session.run({GAP: middle}, duration).events))
        low, high = (middle, high) if touched else (low, middle)
    return high


def deepest_swing(duration: float = 0.02) -> float:
    """How far [m] the tip swings towards a ground that it never reaches."""
    scene = ts.load_scene("cantilever", volts=8, hz=50, wave="square")
    far = ts.with_values(scene, {GAP: 1e-3, "ground.film": None})
    run = ts.simulate(far, duration)
    return 1e-3 - float(run.at(np.linspace(0.0, duration, 20001)).state.gap.min())


if __name__ == "__main__":
    print(f"least clearance {1e6 * least_clearance():.4f} um, deepest swing {1e6 * deepest_swing():.4f} um")
