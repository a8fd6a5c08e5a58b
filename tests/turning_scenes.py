"""Walkers that move across the way as well, for tests."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import tarsus as ts
from random_scenes import PLAIN, Dice
from tarsus.model.drive.laws import LinearForce
from tarsus.model.laws import Friction
from tarsus.model.scene import Drive, Foot, Ground, Initial, PointLoad, Robot, Scene
from tarsus.model.structure import Walker, WalkerBody, WalkerLeg
from walking_scenes import GRAVITY, sticky, trotter

HALF_LENGTH, HALF_WIDTH, FRICTION = 2e-3, 1e-3, 0.3
STIFF: dict[str, Any] = {"stiffness_v": 50.0, "stiffness_l": 40.0, "stiffness_t": 30.0}
LOSS: dict[str, Any] = {"damping_v": 1e-4, "damping_l": 1e-4, "damping_t": 1e-4}


def puck(spin: float, surge: float = 0.0, mass: float = 1e-6, foot: float = 1e-8, **ground: Any) -> Scene:
    """A plate on four feet that slides as a rigid one does from the start, with a spin [rad/s] or a speed ahead [m/s]:
    its legs are bent by as much as its deceleration bends them."""
    at = {f"{a}{b}": (a * HALF_LENGTH, b * HALF_WIDTH) for a in (1, -1) for b in (1, -1)}
    at = {f"leg{i}": place for i, place in enumerate(at.values())}
    legs = {name: WalkerLeg(x=x, y=y, mass=foot, **STIFF, **LOSS) for name, (x, y) in at.items()}
    square = HALF_LENGTH**2 + HALF_WIDTH**2
    walker = Walker(body=WalkerBody(mass=mass, yaw_inertia=mass * square / 3.0), legs=legs)
    laws = {"gravity": ts.Gravity(acceleration=GRAVITY), "friction": Friction(coefficient=FRICTION)} | ground
    press = (mass / 4.0 + foot) * GRAVITY
    n, coordinates = walker.size, walker.body_coordinates
    start, speed = np.zeros(n), np.zeros(n)
    start[coordinates.index("heave")] = -mass * GRAVITY / 4.0 / STIFF["stiffness_v"]
    speed[coordinates.index("yaw")], speed[coordinates.index("surge")] = spin, surge
    turning = -math.copysign(spinning_down(mass, foot), spin) if spin else 0.0
    slowing = -math.copysign(FRICTION * GRAVITY, surge) if surge else 0.0
    for name, (x, y) in at.items():
        rates = np.array([surge - y * spin, x * spin])
        slows = np.array([slowing - y * turning, x * turning])
        friction = -FRICTION * press * rates / max(float(np.hypot(*rates)), 1e-300)
        for point, rate, what, key in zip(
            (f"{name}_x", f"{name}_y"), rates, foot * slows - friction, ("stiffness_l", "stiffness_t"), strict=True
        ):
            row = walker.row(point)
            speed += row * rate
            start -= row * what / STIFF[key]  # what the spring gives the foot: m a - friction
    return Scene(
        name="puck",
        robot=Robot(structure=walker, feet={name: Foot(point=name, gap=0.0) for name in legs}),
        ground=Ground(**laws),
        initial=Initial(displacement=tuple(start), velocity=tuple(speed)),
        duration=0.05,
    )


def spinning_down(mass: float = 1e-6, foot: float = 1e-8) -> float:
    """Angular deceleration [rad/s^2] of the puck: mu m g r over its moment of inertia, feet at a distance r."""
    square, whole = HALF_LENGTH**2 + HALF_WIDTH**2, mass + 4.0 * foot
    return FRICTION * whole * GRAVITY * math.sqrt(square) / (mass * square / 3.0 + 4.0 * foot * square)


def dragged(share: float, angle: float, speed: float = 0.02, ahead: float = 0.7, **ground: Any) -> Scene:
    """A foot that nothing but friction holds along the ground, under a heavy body that stands on it. It is drawn by a
    constant force, ``share`` of what friction bears, in a direction ``ahead`` [rad] of the way, and slides with a speed
    [m/s] at an angle [rad] from that."""
    foot, mass = 1e-8, 1e-6
    leg = WalkerLeg(
        x=0.0,
        y=0.0,
        mass=foot,
        stiffness_v=50.0,
        damping_v=1e-4,
        stiffness_l=1e-12,
        damping_l=0.0,
        stiffness_t=1e-12,
        damping_t=0.0,
    )
    walker = Walker(body=WalkerBody(mass=mass), legs={"leg": leg})
    start, points = np.zeros(walker.size), (walker.row("leg_x"), walker.row("leg_y"))
    start[walker.body_coordinates.index("heave")] = -mass * GRAVITY / leg.stiffness_v
    pull = PointLoad(weights={"leg_x": math.cos(ahead), "leg_y": math.sin(ahead)})
    law = LinearForce(gain=share * FRICTION * (mass + foot) * GRAVITY)
    velocity = speed * (math.cos(ahead + angle) * points[0] + math.sin(ahead + angle) * points[1])
    laws = {"gravity": ts.Gravity(acceleration=GRAVITY), "friction": Friction(coefficient=FRICTION)} | ground
    return Scene(
        name="dragged",
        robot=Robot(
            structure=walker, feet={"leg": Foot(point="leg", gap=0.0)}, drives={"pull": Drive(load=pull, law=law)}
        ),
        ground=Ground(**laws),
        signals={"pull": ts.Constant(level=1.0)},
        initial=Initial(displacement=tuple(start), velocity=tuple(velocity)),
        duration=2e-4,
    )


def across(scene: Scene, dice: Dice | None = None, inertia: float = 2e-6) -> Scene:
    """The scene with legs that move across the way, and a body that turns."""
    walker = scene.robot.structure
    assert isinstance(walker, Walker)
    share = dice.log if dice is not None else lambda low, high: 1.0
    legs = {
        name: one.model_copy(
            update={"stiffness_t": one.stiffness_l * share(0.3, 10.0), "damping_t": one.damping_l * share(0.3, 3.0)}
        )
        for name, one in walker.legs.items()
    }
    body = walker.body.model_copy(update={"yaw_inertia": walker.body.mass * inertia * share(0.5, 2.0)})
    return ts.with_values(scene, {"robot.structure": Walker(body=body, legs=legs)})


def turning_walk(seed: int) -> Scene:
    """A walker that moves every way, driven harder than it needs, by legs of uneven strength and pushes across."""
    dice = Dice([seed, 78], PLAIN)
    laws: dict[str, Any] = {
        name: None
        for name, chance in (("adhesion", 0.5), ("restitution", 0.3), ("friction", 0.1))
        if dice.chance(chance)
    }
    if dice.chance(0.3):
        laws["film"] = ts.Film(coefficient=dice.log(1e-28, 1e-24), thickness=1e-7)
    legs = dice.one_of([1, 2, 3, 4])
    scene = across(trotter(legs, ground=sticky(**laws), seed=seed, turning=dice.chance(0.5)), dice)
    drives = dict(scene.robot.drives)
    for name, one in drives.items():
        drives[name] = one.model_copy(update={"law": LinearForce(gain=2e-6 * dice.log(0.3, 6.0))})
    push = Drive(load=PointLoad(weights={"body_y": 1.0, "leg0_y": dice.between(-0.5, 0.5)}), law=LinearForce(gain=1e-6))
    sine = ts.Sine(amplitude=dice.log(0.1, 2.0), offset=0.0, frequency=dice.log(50.0, 500.0), phase=0.3)
    made = {"name": f"turning {seed}", "robot.drives": drives | {"push": push}, "signals.push": sine, "duration": 0.02}
    return ts.with_values(scene, made)
