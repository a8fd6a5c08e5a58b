"""Millipedes for tests that do not change when the packaged devices do: Table 4.1 on the ground of Table 2.2."""

from __future__ import annotations

from pathlib import Path

import tarsus as ts
from example_files import load_file
from tarsus_reproduce.millipede import Coarse, damping_ratio

INTERPRETATIONS = load_file(Path(__file__).parents[2] / "docs" / "package_interpretations.py")
"""The script that judges random interpretations for the package."""

FEW = Coarse(9, (0.1, 0.9))
"""Nine values of what varies, at two restitutions."""


def overdamped() -> ts.Scene:
    """With the damping of Table 4.1 and springs relaxed at the start."""
    film = {"ground.film.coefficient": 1.747e-21, "ground.film.thickness": 50e-6}
    charge = {"ground.electrostatic.coefficient": 1e-19, "ground.electrostatic.offset": 50e-6}
    ground = {"ground.landing": None, "ground.friction.coefficient": 0.4}
    relaxed = {"initial.standing": None, "gait.frequency": 50.0, "provenance": {}}
    scene = ts.load_scene("millipede-table")
    return ts.with_values(scene, {**INTERPRETATIONS.PRINTED, **film, **charge, **ground, **relaxed})


def ringing(ratio: float = 0.05) -> ts.Scene:
    """With a damping ratio of (4.3) that rings, standing, the film thin and in the nN reading."""
    scene = overdamped()
    factor = ratio / damping_ratio(scene)
    legs = scene.robot.structure.legs
    changes = {f"robot.structure.legs.{name}.damping_v": factor * leg.damping_v for name, leg in legs.items()}
    film = {"ground.film.coefficient": 1.747e-24, "ground.film.thickness": 0.2e-6}
    return ts.with_values(scene, {**changes, **film, "initial": {"standing": {}}})
