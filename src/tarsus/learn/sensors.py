"""What an agent sees of a robot: what sensors on it would."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.base.events import FootState

if TYPE_CHECKING:
    from tarsus.model.scene import Scene
    from tarsus.solve import State

Floats = NDArray[np.float64]

MICRO, MILLI, NANO = 1e6, 1e3, 1e9
LENGTHS, PASSED = ("surge", "heave", "sway"), ("surge", "sway", "yaw")
"""Of the body's coordinates those that are lengths, and those that say how far it has got."""


@dataclass(frozen=True)
class Sensors:
    """What is seen of a robot, as numbers of a handy size.

    body: its heave [um], roll and pitch [mrad], with their rates [mm/s, rad/s], and the rates of its surge,
    sway [mm/s] and yaw [rad/s];
    where it has got to is seen by no sensor on it. points: displacements [um] and velocities [mm/s] of named points of
    the structure; currents [nA] into the drives by motion; contacts: 1 for every foot on the ground.
    """

    body: bool = True
    points: Sequence[str] = ()
    currents: bool = True
    contacts: bool = True

    def names(self, scene: Scene) -> list[str]:
        """Of the numbers, in their order."""
        out = []
        if self.body:
            coordinates = scene.robot.structure.body_coordinates
            out += [name for name in coordinates if name not in PASSED] + [f"{name} rate" for name in coordinates]
        out += [f"{point}{what}" for point in self.points for what in ("", " velocity")]
        out += [f"{name} current" for name in scene.robot.drives] if self.currents else []
        return out + ([f"{name} contact" for name in scene.robot.feet] if self.contacts else [])

    def seen(self, state: State) -> NDArray[np.float32]:
        """The numbers (nr, size) in a state of nr robots. Raises InputError for a point that there is not."""
        scene, parts = state.scene, []
        if self.body:
            names = scene.robot.structure.body_coordinates
            sizes = {name: MICRO if name in LENGTHS else MILLI for name in names}
            rates = {name: MILLI if name in LENGTHS else 1.0 for name in names}
            parts += [state.x[:, i] * sizes[name] for i, name in enumerate(names) if name not in PASSED]
            parts += [state.v[:, i] * rates[name] for i, name in enumerate(names)]
        for point in self.points:
            parts += [state.displacement(point) * MICRO, state.velocity(point) * MILLI]
        if self.currents:
            parts += list(state.currents.T * NANO)
        if self.contacts:
            parts += list((state.contacts != FootState.AIR).T.astype(float))
        seen = np.stack(parts, axis=1) if parts else np.zeros((len(state.x), 0))
        return seen.astype(np.float32)
