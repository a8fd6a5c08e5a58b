"""The installation: the devices that can be named, and whether the engine computes what it should."""

from __future__ import annotations

import os
import platform
from importlib.metadata import PackageNotFoundError, version

import numpy as np

from tarsus.files.installed import device_title
from tarsus.files.library import device_names, load_scene
from tarsus.model.laws import Gravity, Restitution
from tarsus.model.robot import Foot, Robot
from tarsus.model.scene import Ground, Scene
from tarsus.model.structure import Lumped
from tarsus.solve import Engine, simulate
from tarsus.tables.numbers import spaced
from tarsus.tables.table import Table
from tarsus.tables.view import View

IMPACTS = (0.4515236409857308, 1.264266194760045, 1.995734493156927)
"""First impacts [s] of a ball dropped from 1 m, restitution 0.9, 9.81 m/s^2: sqrt(2 h / g) (1, 1 + 2 e, ...)."""

CLOSE = 1e-10
"""Relative error of those times below which the engine is right on this processor; it is 1e-15 where all is well."""

LIBRARIES = ("tarsus", "numpy", "scipy", "xarray", "matplotlib", "pydantic", "cyclopts")


def devices() -> View:
    """List the packaged devices and those that other installed packages add, with titles, feet and drives."""
    scenes = {name: load_scene(name) for name in device_names()}
    listed = [
        {
            "name": name,
            "title": device_title(name) or one.robot.structure.kind,
            "feet": len(one.robot.feet),
            "drives": sorted(one.robot.drives),
        }
        for name, one in scenes.items()
    ]
    rows = [(one["name"], one["title"], one["feet"], _listed(one["drives"])) for one in listed]
    return View({"devices": listed}, Table("", ("device", "what it is", "feet", "drives"), rows))


def _listed(names: list[str]) -> str:
    return ", ".join(names) if len(names) <= 6 else f"{len(names)} drives, {names[0]} to {names[-1]}"


def doctor() -> View:
    """Show versions, processor and threads, and check the engine against the closed form of a ball that bounces."""
    data = {
        **{name: _version(name) for name in LIBRARIES},
        "python": platform.python_version(),
        "system": platform.platform(),
        "processors": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "devices": len(device_names()),
        "engine": ", ".join(filter(None, Engine.built().values())),
        "engine_error": _engine_error(),
    }
    right = data["engine_error"] < CLOSE
    wrong = "the engine does not find the impacts of a bouncing ball; build it again for this machine"
    table = Table("", ("what", "found"), [(spaced(name), str(one)) for name, one in data.items()])
    return View(data, table, problems=() if right else (wrong,))


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "missing"


def _engine_error() -> float:
    ball = Scene(
        name="ball",
        duration=2.2,
        robot=Robot(
            structure=Lumped(coordinates=("ball",), mass=((1.0,),), stiffness=((0.0,),)),
            drives={},
            feet={"ball": Foot(point="ball", gap=1.0)},
        ),
        ground=Ground(restitution=Restitution(coefficient=0.9), gravity=Gravity()),
        signals={},
    )
    times = simulate(ball).events["time"][: len(IMPACTS)]
    return float(np.max(np.abs(times / np.array(IMPACTS) - 1.0))) if len(times) == len(IMPACTS) else float("inf")
