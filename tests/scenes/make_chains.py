"""Writes p1_n2.toml, p1_n6.toml and p1_n32.toml from benchmarks/reference/p1.json: mg, um, ms, uN become SI."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from tarsus import (
    Adhesion,
    Drive,
    Film,
    Foot,
    Ground,
    LinearForce,
    Lumped,
    PointLoad,
    Restitution,
    Robot,
    Scene,
    Square,
    write_scene,
)

HERE = Path(__file__).parent
PROBLEMS = HERE.parents[1] / "benchmarks" / "reference" / "p1.json"


def chain(problem: dict) -> Scene:
    """One chain as a scene; kg = 1e6 mg, m = 1e6 um, s = 1e3 ms, N = 1e6 uN."""
    n = len(problem["mass_mg"])
    names = tuple(f"x{i}" for i in range(n))
    structure = Lumped(
        coordinates=names,
        mass=tuple(float(f"{m}e-6") for m in problem["mass_mg"]),
        stiffness=tuple(map(tuple, np.array(problem["stiffness_uN_per_um"]).tolist())),
        damping=tuple(map(tuple, (np.array(problem["damping"]) * 1e-3).tolist())),
    )
    drive = Drive(
        load=PointLoad(weights={names[problem["drive_index"]]: 1.0}),
        law=LinearForce(gain=problem["gain_uN_per_V"] * 1e-6),
    )
    foot = Foot(point=names[problem["tip_index"]], gap=-problem["ground_um"] * 1e-6)
    ground = Ground(
        restitution=Restitution(coefficient=problem["restitution"]),
        adhesion=Adhesion(
            initial=problem["adhesion0_uN"] * 1e-6, rate=problem["adhesion_rate_uN_per_ms"] * 1e-3
        ),
        film=Film(
            coefficient=problem["film_C"] * 1e-21,
            thickness=(problem["film_offset_um"] + problem["ground_um"]) * 1e-6,
        ),
    )
    return Scene(
        name=f"chain of {n} masses",
        robot=Robot(structure=structure, drives={"pull": drive}, feet={"tip": foot}),
        ground=ground,
        signals={"pull": Square(amplitude=8.0, frequency=50.0)},
        duration=1.0,
    )


if __name__ == "__main__":
    for size, problem in json.loads(PROBLEMS.read_text(encoding="utf-8")).items():
        write_scene(chain(problem), HERE / f"p1_n{size}.toml")
