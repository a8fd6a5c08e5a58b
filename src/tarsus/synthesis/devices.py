"""Devices like another, with randomised numbers."""

from __future__ import annotations

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.spec import float_paths, with_values
from tarsus.model.scene import Scene
from tarsus.model.standing import rest_state
from tarsus.model.structure import Walker

_TRIES = 200
"""Draws of a device before it is given up."""
_CLEARANCE = 0.1
"""Share of the neutral distance that the poled foot must be above the ground for the device to be used."""


def perturbed(scene: Scene, spread: float, seed: int, fixed: tuple[str, ...] = ()) -> Scene:
    """A device like another, every number that a campaign identifies multiplied by 1 - spread to 1 + spread.

    Parameters
    ----------
    scene
        The device; its geometry, masses, gaps and signals stay.
    spread
        From 0 to below 1.
    seed
        Of the draw.
    fixed
        Paths that stay as well.

    Raises
    ------
    InputError
        For a spread outside 0 to 1, or when no draw of many gives a device whose poled foot is clear of the ground.
    """
    if not 0.0 <= spread < 1.0:
        raise InputError(f"expected a perturbation from 0 to below 1, got {spread:g}")
    paths = [path for path in identified_paths(scene) if path not in fixed]
    before = float_paths(scene)
    random = np.random.default_rng([seed, 5])
    refused: list[str] = []
    for _ in range(_TRIES):
        factors = 1.0 + spread * random.uniform(-1.0, 1.0, len(paths))
        values = {path: before[path].value * float(f) for path, f in zip(paths, factors, strict=True)}
        if (e := "ground.restitution.coefficient") in values:
            values[e] = min(values[e], 0.95)
        try:
            drawn = with_values(scene, values)
            if isinstance(scene.robot.structure, Walker):
                return drawn
            with_values(drawn, {"initial.displacement": rest_state(drawn)})
            if _rests_clear(drawn):
                return drawn
        except InputError as error:
            refused += error.problems
    why = f": {len(refused)} of {_TRIES} draws are refused, the first since {refused[0]}" if refused else ""
    raise InputError(f"no device within {spread:g} of '{scene.name}' rests clear of the ground after poling{why}")


def identified_paths(scene: Scene) -> list[str]:
    """Paths of the numbers that a campaign identifies.

    The participation of the first coordinate stays: it is the unit of the drive's force. Of a walker the ground's
    numbers, and the springs and dampers of its legs.
    """
    kept: list[str] = []
    wanted = tuple(f"ground.{n}." for n in ("restitution", "film", "adhesion", "electrostatic"))
    if isinstance(scene.robot.structure, Walker):
        springs = ("stiffness_v", "damping_v", "stiffness_l", "damping_l")
        ground = (*wanted, "ground.friction.")
        return [
            path
            for path in float_paths(scene)
            if path.startswith(ground) or (path.startswith("robot.structure.legs.") and path.endswith(springs))
        ]
    wanted += ("robot.structure.frequencies.", "robot.structure.damping_ratios.")
    for path in float_paths(scene):
        parts = path.split(".")
        drive = parts[:2] == ["robot", "drives"] and len(parts) > 4
        if drive and parts[3:5] == ["load", "participation"] and parts[5] != "0":
            kept.append(path)
        if path.startswith(wanted) or (drive and parts[3] == "law" and parts[4] != "thresholds"):
            kept.append(path)
    return kept


def _rests_clear(scene: Scene) -> bool:
    x = np.array(rest_state(scene))
    row, feet = scene.robot.structure.row, scene.robot.feet.values()
    return all(foot.gap + foot.normal * float(row(foot.point) @ x) >= _CLEARANCE * foot.gap for foot in feet)
