"""Standing still: a walker's start in static equilibrium on its feet, and a structure at rest in the air."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.linear import eigh, product, solve
from tarsus.base.spec import described, with_values
from tarsus.base.units import format_quantity
from tarsus.model.drive.lower import evaluate, lower
from tarsus.model.scene import Ground, Initial, Provenance, Scene, Source
from tarsus.model.structure import Walker
from tarsus.model.structure.base import Array

_LOOSE = 1e-12
"""A motion with less than this share of the stiffest, all coordinates scaled to be alike, is not held."""

_BALANCED = 1e-9
"""Forces below this share of the largest are rounding."""


def standing(scene: Scene, *, driven: bool = False) -> Scene:
    """The scene starting in static equilibrium: all feet on the ground, the body on its springs, everything at rest.

    Feet are held at gap 0 under gravity and the drives' forces.  Along the way they stand where no force is left on
    them, so that friction has nothing to hold; the body stays where it is.

    Parameters
    ----------
    scene
        Of a walker.
    driven
        With the drives' volts at t = 0; otherwise at 0 V, after their history.

    Returns
    -------
    Scene
        A changed copy, with `initial.displacement` [m] and [rad].

    Raises
    ------
    InputError
        For a structure that is no walker, a body that its feet do not hold up, a foot that pulls harder than
        adhesion holds at first, and forces along the way that do not balance.
    """
    described(scene)
    return _starting_at(scene, equilibrium(scene, driven=driven), driven)


def equilibrium(scene: Scene, *, driven: bool = False) -> Array:
    """Coordinates (n,) [m] of that start, as `standing` finds them; raises what it raises.

    It is what a scene with ``initial.standing`` starts from, computed anew wherever its mass, gravity, springs or
    volts vary.
    """
    walker = scene.robot.structure
    if not isinstance(walker, Walker):
        raise InputError(f"only a walker stands on its feet; this structure is of kind '{walker.kind}'")
    volts, load = _drives(scene, driven)
    matrices = walker.matrices()
    if scene.ground.gravity is not None:
        load = load - scene.ground.gravity.acceleration * (product(matrices.mass, walker.vertical()))
    heights = {name: walker.leg_coordinate(foot.point) + 1 for name, foot in scene.robot.feet.items()}
    held = {place: -scene.robot.feet[name].gap for name, place in heights.items()}
    ways = [0, *(walker.leg_coordinate(leg) for leg, one in walker.legs.items() if one.stiffness_l == 0.0)]
    held |= dict.fromkeys(ways, 0.0)
    x = _equilibrium(walker, matrices.stiffness, load, held)
    held_by = product(matrices.stiffness, x)
    push = held_by - load
    scale = _BALANCED * float(np.abs(load).max(initial=0.0) + np.abs(held_by).max())
    problems = []
    for name, place in heights.items():
        hold = push[place] + _hold(scene.ground, volts.get(scene.robot.feet[name].electrode, 0.0))
        if hold < -scale:
            missing = format_quantity(float(f"{-hold:.4g}"), "N")
            problems.append(f"foot '{name}' would have to be pulled down by {missing}: it does not stand")
    if float(np.abs(push[ways]).max()) > scale:
        problems.append("the forces along the way do not balance: the robot would not stand still")
    if problems:
        raise InputError(problems)
    return x


def rest_state(scene: Scene, volts: float = 0.0) -> tuple[float, ...]:
    """Coordinates (n,) of the structure at rest in the air at a voltage, after the history of its drives.

    ``K x = sum_d load_d law_d(volts)``; at 0 V the neutral deflection (2.4).
    """
    structure = scene.robot.structure
    force = np.zeros(structure.size)
    for drive in scene.robot.drives.values():
        force += drive.load.vector(structure) * float(drive.law.force([volts], drive.history)[0])
    return tuple(np.linalg.solve(structure.matrices().stiffness, force).tolist())


def _drives(scene: Scene, driven: bool) -> tuple[dict[str | None, float], Array]:
    """Volts of every drive at the start, and the generalised force (n,) of all of them."""
    volts: dict[str | None, float] = {}
    load = np.zeros(scene.robot.structure.size)
    signals = scene.actuator_volts if driven else {}
    for name, drive in scene.robot.drives.items():
        if (signal := signals.get(name)) is None:
            volts[name], exerted = 0.0, float(drive.law.force([0.0], drive.history)[0])
        else:
            force, volt = lower(signal, drive.law, drive.history)
            volts[name], exerted = float(evaluate(volt, 0.0)), float(evaluate(force, 0.0))
        load += exerted * drive.load.vector(scene.robot.structure)
    return volts, load


def _equilibrium(walker: Walker, stiffness: Array, load: Array, held: Mapping[int, float]) -> Array:
    """Coordinates (n,) where the free ones are in balance."""
    x = np.zeros(len(load))
    x[list(held)] = list(held.values())
    free = [i for i in range(len(x)) if i not in held]
    if not free:
        return x
    inner = stiffness[np.ix_(free, free)]
    size = np.sqrt(np.where(np.diag(inner) > 0.0, np.diag(inner), 1.0))
    values, shapes = eigh(inner / np.outer(size, size))
    if values[0] < _LOOSE * max(values[-1], 1.0):
        raise InputError(_unsupported(walker, free[int(np.argmax(np.abs(shapes[:, 0])))]))
    x[free] = solve(inner, (load - product(stiffness, x))[free])
    return x


def _unsupported(walker: Walker, coordinate: int) -> str:
    if coordinate < walker.body_size:
        return f"the body is not held up: its feet leave it free to {walker.body_coordinates[coordinate]}"
    leg = list(walker.legs)[(coordinate - walker.body_size) // 2]
    return (
        f"the foot of leg '{leg}' hangs on nothing: the leg has no stiffness upward and stands on no ground"
    )


def _hold(ground: Ground, volts: float) -> float:
    """Pull [N] that a foot bears on the ground from the first moment on: adhesion, and smooth attraction."""
    hold = sum(law.evaluate(0.0) for law in ground.acting_on("strength").values())
    smooth = ground.acting_on("force").values()
    return hold - sum(law.evaluate(0.0, 0.0, volts, 0.0) for law in smooth)


def _starting_at(scene: Scene, x: Array, driven: bool) -> Scene:
    at = "the drives' first volts" if driven else "0 V"
    origin = Provenance(source=Source.DERIVED, note=f"Static equilibrium on all feet at {at}.")
    return with_values(
        scene,
        {
            "initial": Initial(displacement=tuple(x.tolist())),
            "provenance": {**scene.provenance, "initial.displacement": origin},
        },
    )
