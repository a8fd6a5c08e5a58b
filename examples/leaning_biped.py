"""A robot on two legs that lean, by contact modes: it walks on friction.

The legs of a walker (`ts.Walker`) are springs upward and along the ground, each by itself. These lean, so that a
push down is one forward as well, and a foot's mass ties its two ways. Mass, damping and stiffness of such a robot are
matrices (`ts.Lumped`); ``along`` says which point of the structure is a foot's way along the ground, and friction acts
there.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import tarsus as ts

BODY, TURN, FOOT = 2e-7, 8e-14, 5e-9  # [kg], [kg m^2], [kg]
STRETCH, BEND = (2.0, 4e-6), (0.7, 3e-6)  # of a leg: stiffness [N/m], damping [N s/m]
HALF, BELOW = 1e-3, -1e-4  # [m] hips before and behind the centre of mass, and above it


def scene(lean: float = 0.4, tied: float = 0.2, **laws: Any) -> ts.Scene:
    """The robot on a ground with friction.

    lean [rad]: of the legs, inward; tied: share of a foot's mass that ties its ways.
    """
    surge, heave, pitch, *feet = np.eye(7)
    mass = np.diag([BODY, BODY, TURN, *[FOOT] * 4])
    stiffness, damping = np.zeros((2, 7, 7))
    points = {}
    for leg, side, x, z in (("a", 1.0, *feet[:2]), ("b", -1.0, *feet[2:])):
        hip_x, hip_z = surge + BELOW * pitch, heave - side * HALF * pitch
        points |= {f"{leg}_hip": tuple(hip_z), f"{leg}_hip_x": tuple(hip_x)}
        c, s = math.cos(side * lean), math.sin(side * lean)
        stretch, bend = c * (hip_z - z) + s * (hip_x - x), c * (hip_x - x) - s * (hip_z - z)
        for way, (spring, damper) in ((stretch, STRETCH), (bend, BEND)):
            stiffness += spring * np.outer(way, way)
            damping += damper * np.outer(way, way)
        mass += side * tied * FOOT * (np.outer(x, z) + np.outer(z, x))
    structure = ts.Lumped(
        coordinates=("x", "z", "pitch", "ax", "az", "bx", "bz"),
        mass=mass.tolist(),
        stiffness=stiffness.tolist(),
        damping=damping.tolist(),
        weights=points,
        upward=(0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0),
    )
    shares = {"z": -1.0, "_hip": 1.0, "x": -0.7, "_hip_x": 0.7}
    ground = {
        "gravity": ts.Gravity(acceleration=9.81),
        "restitution": ts.Restitution(coefficient=0.5),
        "adhesion": ts.Adhesion(initial=2e-7, rate=1e-5),
        "friction": {"kind": "coulomb", "coefficient": 0.4},
    } | laws
    return ts.Scene(
        name="leaning biped",
        robot=ts.Robot(
            structure=structure,
            drives={
                leg: ts.Drive(
                    load=ts.PointLoad(weights={f"{leg}{point}": share for point, share in shares.items()}),
                    law=ts.LinearForce(gain=2e-6),
                )
                for leg in "ab"
            },
            feet={leg: ts.Foot(point=f"{leg}z", gap=1e-6, along=f"{leg}x") for leg in "ab"},
        ),
        ground=ts.Ground(**ground),
        signals={
            leg: ts.Sine(amplitude=7.0, offset=7.0, frequency=200.0, phase=math.pi * i) for i, leg in enumerate("ab")
        },
        duration=0.01,
    )


def walk(seconds: float = 0.02) -> tuple[ts.Run, float]:
    """A run, and how far [m] the body has come forward in it."""
    run = ts.simulate(scene(), seconds)
    return run, float(run.at(np.array([seconds])).state.x[0, 0])


def main() -> None:
    """Walk for four steps, and print where that led and what it cost."""
    run, way = walk()
    slips = int((run.events["kind"] == 7).sum())
    print(f"{run.code} {way * 1e6:.1f} um forward in {run.duration:g} s, {slips} slips")
    print(f"friction took {run.ledger.friction:.3g} J of {run.ledger.work_in:.3g} J")


if __name__ == "__main__":
    main()
