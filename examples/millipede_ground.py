"""What ground the millipede needs: a sweep of adhesion and electrostatics, and where it stands still."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import bisect

import tarsus as ts

RATE, COEFFICIENT = "ground.adhesion.rate", "ground.electrostatic.coefficient"


def strides(rates: NDArray[np.float64], coefficients: NDArray[np.float64]) -> NDArray[np.float64]:
    """Travel a drive period [m], shape (rates, coefficients), over rates of adhesion [N/s] and C_e [N m^2/V^2]."""
    vary = {RATE: rates, COEFFICIENT: coefficients}
    return ts.simulate_batch(ts.load_scene("millipede-table"), vary, 0.1, grid=True).measure("stride")


def critical_rate(scene: ts.Scene) -> float:
    """Growth of adhesion [N/s] beyond which the walker no longer gets its feet off the ground."""

    def walks(exponent: float) -> float:
        batch = ts.simulate_batch(scene, {RATE: [10.0**exponent]}, 0.1)
        return batch.measure("duty_factor")[0] - 0.999

    return 10.0 ** float(bisect(walks, -5.0, -1.0, xtol=1e-3))


def expected_rate(scene: ts.Scene) -> float:
    """The same [N/s] by hand: a foot comes off if its leg, let go with the body at its highest, pulls more than the
    adhesion that has grown during half a period; the spring then pulls with the drive's force less the weight."""
    drive, leg = (next(iter(one.values())) for one in (scene.robot.drives, scene.robot.structure.legs))
    gravity, adhesion, gait = scene.ground.gravity, scene.ground.adhesion, scene.gait
    pull = drive.law.gain * gait.high - (scene.robot.structure.body.mass + leg.mass) * gravity.acceleration
    return (pull - adhesion.initial) / (gait.duty / gait.frequency)


if __name__ == "__main__":
    scene = ts.load_scene("millipede-table")
    rates, coefficients = np.geomspace(1e-5, 1e-1, 9), np.geomspace(1e-19, 1e-15, 5)
    found = strides(rates, coefficients)
    print("stride [um] over growth of adhesion [N/s] (down) and C_e [N m^2/V^2] (across)")
    print("          " + "".join(f"{one:>10.0e}" for one in coefficients))
    for rate, row in zip(rates, found, strict=True):
        print(f"{rate:>10.1e}" + "".join(f"{one * 1e6:>10.3f}" for one in np.where(abs(row) < 1e-10, 0.0, row)))
    print(
        "electrostatics press driven feet down: more friction, longer strides; adhesion hardly matters until it holds"
    )
    print(f"the feet no longer come off beyond {critical_rate(scene):.2e} N/s; by hand {expected_rate(scene):.2e} N/s")
