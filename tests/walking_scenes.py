"""Walkers for tests of the walking engine."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import tarsus as ts
from tarsus.model.drive.laws import LinearForce
from tarsus.model.laws import Friction
from tarsus.model.scene import Drive, Foot, Ground, Initial, PointLoad, Robot, Scene
from tarsus.model.structure import Walker, WalkerBody, WalkerLeg

GRAVITY = 9.81
LOOSE = {"stiffness_v": 0.0, "damping_v": 0.0, "stiffness_l": 0.0, "damping_l": 0.0}


def block(mass: float = 1e-6, friction: float | None = 0.3, **changes: Any) -> Scene:
    """A block with friction on the ground: a foot on nothing, driven along and upward by volts in newtons.

    The body, which the block does not feel, falls beside it.
    """
    walker = Walker(body=WalkerBody(mass=mass), legs={"block": WalkerLeg(mass=mass, **LOOSE)})
    drives = {
        name: Drive(load=PointLoad(weights={point: 1.0}), law=LinearForce(gain=1.0))
        for name, point in (("along", "block_x"), ("upward", "block"))
    }
    ground = Ground(
        gravity=ts.Gravity(acceleration=GRAVITY),
        restitution=ts.Restitution(coefficient=0.5),
        friction=None if friction is None else Friction(coefficient=friction),
    )
    scene = Scene(
        name="block",
        robot=Robot(structure=walker, drives=drives, feet={"block": Foot(point="block", gap=0.0)}),
        ground=ground,
        duration=1.0,
    )
    return scene.model_copy(update=changes)


def moving(scene: Scene, **speeds: float) -> Scene:
    """The scene with initial velocities [m/s] of points that are coordinates."""
    walker = scene.robot.structure
    start = sum((speed * walker.row(point) for point, speed in speeds.items()), np.zeros(walker.size))
    return scene.model_copy(update={"initial": Initial(velocity=tuple(start))})


def trotter(
    legs: int = 3, damping: float = 2e-6, ground: Ground | None = None, seed: int = 1, turning: bool = True
) -> Scene:
    """A body on scattered legs that step one after the other, each driven by its own volts."""
    rng = np.random.default_rng(seed)
    some = {}
    for i in range(legs):
        stiff, soft, loss = 1.0 + rng.random(3)
        some[f"leg{i}"] = WalkerLeg(
            x=1e-3 * (i - (legs - 1) / 2),
            y=5e-4 * (-1.0) ** i,
            z=-1e-4,
            mass=2e-9,
            stiffness_v=stiff,
            damping_v=damping * loss,
            stiffness_l=soft,
            damping_l=damping,
        )
    mass = 1e-7 * legs
    inertia = {"roll_inertia": mass * 1e-6, "pitch_inertia": mass * 2e-6} if turning else {}
    return Scene(
        name="trotter",
        robot=Robot(
            structure=Walker(body=WalkerBody(mass=mass, **inertia), legs=some),
            drives={
                leg: Drive(
                    load=PointLoad(weights={leg: -1.0, f"{leg}_hip": 1.0, f"{leg}_x": -0.7, f"{leg}_hip_x": 0.7}),
                    law=LinearForce(gain=2e-6),
                )
                for leg in some
            },
            feet={leg: Foot(point=leg, gap=1e-6, electrode=leg) for leg in some},
        ),
        ground=ground or sticky(),
        signals={
            leg: ts.Sine(amplitude=7.0, offset=7.0, frequency=200.0, phase=2.0 * math.pi * i / legs)
            for i, leg in enumerate(some)
        },
        duration=0.02,
    )


def sticky(**changes: Any) -> Ground:
    """A ground with every law but the film's and electrostatics'."""
    laws = {
        "gravity": ts.Gravity(acceleration=GRAVITY),
        "restitution": ts.Restitution(coefficient=0.5),
        "adhesion": ts.Adhesion(initial=2e-7, rate=1e-5),
        "friction": Friction(coefficient=0.3),
    }
    return Ground(**(laws | changes))
