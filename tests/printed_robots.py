"""The printed hexapod (appendix B of the source) as a scene, with any impact map."""

from __future__ import annotations

import tomllib
from importlib.resources import files
from typing import Any

import numpy as np

import tarsus as ts
from tarsus.model.laws.impact_map import Body, MeasuredImpactMap

POINTS = tuple(f"foot{i}" for i in range(1, 7))
UNIT = 1e-6
"""Kilograms per printed unit of mass: any common scale of M, C and K will do here."""


def printed(robot: str = "hexapod") -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """M, C, K as printed."""
    tables = tomllib.loads(files("tarsus_reproduce").joinpath("data", "appendix_b.toml").read_text(encoding="utf-8"))
    return tuple(np.array(tables[robot][name]) for name in "MCK")  # type: ignore[return-value]


def printed_map(*, passive: bool = True) -> MeasuredImpactMap:
    """The printed CoR matrix: its first column beside the identity (E7)."""
    tables = tomllib.loads(files("tarsus_reproduce").joinpath("data", "appendix_b.toml").read_text(encoding="utf-8"))
    matrix = np.eye(6)
    matrix[:, 0] = tables["hexapod"]["R_first_column"]
    return MeasuredImpactMap.from_matrix(matrix, list(POINTS), {"foot1": "foot1"}, passive=passive)


def body() -> Body:
    mass, _, stiffness = printed()
    return Body(mass, stiffness, lambda point: np.eye(6)[POINTS.index(point)])


def hexapod(
    *, signal: Any, gap: float = 1e-5, restitution: float = 0.51, static: float = 12e-6, feet: int = 1, **ground: Any
) -> ts.Scene:
    """The printed hexapod; ``static`` [m] is how far 10 V move foot 1."""
    mass, damping, stiffness = (matrix * UNIT for matrix in printed())
    gain = static / np.linalg.inv(stiffness)[0, 0] / 10.0
    return ts.Scene(
        name="printed hexapod",
        robot=ts.Robot(
            structure=ts.Lumped(coordinates=POINTS, mass=mass, damping=damping, stiffness=stiffness),
            drives={"pzt": ts.Drive(load=ts.PointLoad(weights={"foot1": 1.0}), law=ts.LinearForce(gain=gain))},
            feet={name: ts.Foot(point=name, gap=gap, electrode="pzt") for name in POINTS[:feet]},
        ),
        ground=ts.Ground(restitution=ts.Restitution(coefficient=restitution), **ground),
        signals={"pzt": signal},
        duration=1.0,
    )
