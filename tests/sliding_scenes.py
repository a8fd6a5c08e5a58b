"""Robots by contact modes whose feet slide and stick: blocks, walkers as matrices, a cantilever, a biped."""

from __future__ import annotations

from typing import Any

import numpy as np

import tarsus as ts
from example_files import load
from tarsus.model.drive.laws import LinearForce
from tarsus.model.laws import Friction
from tarsus.model.scene import Drive, Foot, Ground, Initial, PointLoad, Robot, Scene
from walking_scenes import GRAVITY, sticky

MASS = 1e-6


def slider(speed: float = 0.0, fall: float = 0.0, gap: float = 0.0, coupling: float = 0.0, **laws: Any) -> Scene:
    """A mass with a foot under it: upward z, along x, on nothing; driven along by volts in newtons.

    speed, fall: velocities along and downward [m/s]; coupling: mass that ties the two ways, as a share of the mass,
    on which no weight acts.
    """
    mass = ((MASS, coupling * MASS), (coupling * MASS, MASS))
    structure = ts.Lumped(
        coordinates=("z", "x"),
        mass=mass,
        stiffness=(0.0, 0.0),
        damping=(0.0, 0.0),
        upward=tuple(np.linalg.solve(mass, (MASS, 0.0))),
        forward=tuple(np.linalg.solve(mass, (0.0, MASS))),
    )
    drive = Drive(load=PointLoad(weights={"x": 1.0}), law=LinearForce(gain=1.0))
    acting = {
        "gravity": ts.Gravity(acceleration=GRAVITY),
        "restitution": ts.Restitution(coefficient=0.5),
        "friction": Friction(coefficient=0.3),
    } | laws
    return Scene(
        name="slider",
        robot=Robot(structure=structure, drives={"along": drive}, feet={"foot": Foot(point="z", gap=gap, along="x")}),
        ground=Ground(**acting),
        initial=Initial(velocity=(-fall, speed)),
        duration=0.1,
    )


def by_modes(scene: Scene) -> Scene:
    """A walker's scene with its robot as matrices: the same equations, by contact modes."""
    walker = scene.robot.structure
    matrices = walker.matrices()
    structure = ts.Lumped(
        coordinates=tuple(f"q{i}" for i in range(walker.size)),
        mass=matrices.mass.tolist(),
        stiffness=matrices.stiffness.tolist(),
        damping=matrices.damping.tolist(),
        weights={point: tuple(walker.row(point)) for point in walker.points},
        upward=tuple(walker.vertical()),
        forward=tuple(walker.horizontal()),
    )
    feet = {name: foot.model_copy(update={"along": f"{foot.point}_x"}) for name, foot in scene.robot.feet.items()}
    return ts.with_values(scene, {"robot.structure": structure, "robot.feet": feet})


def cantilever(**laws: Any) -> Scene:
    """Three modes whose tip moves along the ground as it moves to it, over a shaker's force at an angle."""
    structure = ts.Modal(
        frequencies=(400.0, 2300.0, 5100.0),
        damping_ratios=(0.01, 0.02, 0.02),
        modal_masses=(2e-9,) * 3,
        shapes={"tip": (1.0, -0.9, 0.8), "tip_x": (0.25, 0.7, -0.5)},
    )
    drive = Drive(load=PointLoad(weights={"tip": -1.0, "tip_x": 0.6}), law=LinearForce(gain=5e-7))
    return Scene(
        name="cantilever that slides",
        robot=Robot(structure=structure, drives={"d": drive}, feet={"tip": Foot(point="tip", gap=1e-6, along="tip_x")}),
        ground=sticky(**({"gravity": None} | laws)),
        signals={"d": ts.Sine(amplitude=8.0, offset=2.0, frequency=200.0)},
        duration=0.01,
    )


biped = load("leaning_biped").scene
"""A robot on two legs that lean, see the example."""
