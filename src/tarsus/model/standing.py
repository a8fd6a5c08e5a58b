"""Standing still: where a walker stands on its feet, per unit of what bears on it, and a structure at rest in air."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.linear import eigh, product, solve
from tarsus.model.structure.base import Array
from tarsus.model.structure.walker import Walker

if TYPE_CHECKING:
    from tarsus.model.robot import Robot
    from tarsus.model.scene import Scene

_LOOSE = 1e-12
"""A motion with less than this share of the stiffest, all coordinates scaled to be alike, is not held."""


@dataclass(frozen=True)
class Stance:
    """How a walker of n coordinates stands on all its m feet.

    per_source (n, m + 2 + nd): its coordinates per unit of the rest gaps [m], of gravity into the ground and back
    along it [m/s^2], and of the forces of its drives [N]; heights (m,), ways (m,): the coordinates of the feet
    upward and along the ground, where friction holds them; loose: those of other parts along it that nothing holds;
    driven: whether it stands under the drives' first volts.
    """

    per_source: Array
    heights: NDArray[np.int64]
    ways: NDArray[np.int64]
    loose: NDArray[np.int64]
    driven: bool


def stance_of(robot: Robot, stiffness: Array, weight: Array, loads: Array, driven: bool) -> Stance:
    """How a walker stands: feet at gap 0, the rest in balance. Along the way feet stand where no force is left on
    them, so that friction has nothing to hold; the body stays where it is. On an incline the body hangs back by its
    weight along the ground, on feet that friction holds.

    weight (n, 2): constant forces per unit of gravity; loads (n, nd): forces of the drives.

    Raises InputError for a body or a foot that nothing holds up.
    """
    walker = robot.structure
    assert isinstance(walker, Walker)  # checked by Scene
    m = len(robot.feet)
    heights = [walker.leg_coordinate(foot.point) + 1 for foot in robot.feet.values()]
    ways = [height - 1 for height in heights]
    limp = [walker.leg_coordinate(leg) for leg, one in walker.legs.items() if one.end.stiffness_l == 0.0]
    limp += [
        walker.body_size + 2 * len(walker.legs) + i
        for i, one in enumerate(walker.legs.values())
        if one.stiffness_t == 0.0
    ]
    found = np.zeros((len(weight), m + 2 + loads.shape[1]))
    found[heights, range(m)] = -1.0
    own = [c for c in range(found.shape[1]) if c != m + 1]  # all but gravity along the ground
    free = [i for i in range(len(weight)) if i not in {*walker.adrift, *heights, *limp}]
    if free:
        softest = _softest(stiffness, free)
        if softest is not None:
            raise InputError(_unsupported(walker, softest))
        forces = np.column_stack([-product(stiffness, found[:, :m]), weight[:, 0], loads])
        found[np.ix_(free, own)] = solve(stiffness[np.ix_(free, free)], forces[free])
    free = [i for i in range(len(weight)) if i not in {*heights, *ways, *limp}]
    if _softest(stiffness, free) is None:  # else nothing holds the body back: it stands on level ground alone
        found[free, m + 1] = solve(stiffness[np.ix_(free, free)], weight[free, 1])
    loose = [i for i in (*walker.adrift, *limp) if i not in ways]
    return Stance(found, np.array(heights), np.array(ways), np.array(loose), driven)


def _softest(stiffness: Array, free: list[int]) -> int | None:
    """The coordinate of those that are free which moves most in a motion that no spring holds; None where all
    are held."""
    inner = stiffness[np.ix_(free, free)]
    size = np.sqrt(np.where(np.diag(inner) > 0.0, np.diag(inner), 1.0))
    values, shapes = eigh(inner / np.outer(size, size))
    loose = values[0] < _LOOSE * max(values[-1], 1.0)
    return free[int(np.argmax(np.abs(shapes[:, 0])))] if loose else None


def rest_state(scene: Scene, volts: float = 0.0) -> tuple[float, ...]:
    """Coordinates (n,) of the structure at rest in the air at a voltage, after the history of its drives.

    ``K x = sum_d load_d law_d(volts)``; at 0 V the neutral deflection (2.4).
    """
    structure = scene.robot.structure
    force = np.zeros(structure.size)
    for drive in scene.robot.drives.values():
        force += drive.load.vector(structure) * drive.exerted(volts)
    return tuple(np.linalg.solve(structure.matrices().stiffness, force).tolist())


def _unsupported(walker: Walker, coordinate: int) -> str:
    if coordinate < walker.body_size:
        return f"the body is not held up: its feet leave it free to {walker.body_coordinates[coordinate]}"
    leg = list(walker.legs)[(coordinate - walker.body_size) // 2]
    return f"the foot of leg '{leg}' has no support: the leg has no stiffness upward and stands on no ground"
