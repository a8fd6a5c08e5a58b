"""`tarsus doctor`: is this installation sound?"""

from __future__ import annotations

from typing import Any

from tarsus.cli.options import Json

IMPACTS = (0.4515236409857308, 1.264266194760045, 1.995734493156927)
"""First impacts [s] of a ball dropped from 1 m, restitution 0.9, 9.81 m/s^2: sqrt(2 h / g) (1, 1 + 2 e, ...)."""

CLOSE = 1e-10
"""Relative error of those times below which the engine is right on this processor; it is 1e-15 where all is well."""


def doctor(*, json: Json = False) -> int:
    """Tell versions, processor and threads, and check the engine against a closed form.

    Exit code 1 when something is wrong.
    """
    from tarsus.cli import console

    found = {**_versions(), **_engine()}
    if json:
        console.print_json(found)
    else:
        width = max(len(name) for name in found)
        for name, value in found.items():
            print(f"{name.replace('_', ' '):<{width}}  {value}")
    if not found["engine_error"] < CLOSE:
        console.complain(
            ["the engine does not find the impacts of a bouncing ball; build it again for this machine"]
        )
        return 1
    return 0


def _versions() -> dict[str, Any]:
    import os
    import platform
    from importlib.metadata import PackageNotFoundError, version

    def of(name: str) -> str:
        try:
            return version(name)
        except PackageNotFoundError:
            return "missing"

    from tarsus.files.library import device_names

    names = ("tarsus", "numpy", "scipy", "xarray", "matplotlib", "pydantic", "cyclopts")
    return {
        **{name: of(name) for name in names},
        "python": platform.python_version(),
        "system": platform.platform(),
        "processors": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "devices": len(device_names()),
    }


def _engine() -> dict[str, Any]:
    """How the engine was built, and its largest relative error on a ball that bounces."""
    import numpy as np

    import tarsus as ts
    from tarsus.solve.engine import BUILT

    ball = ts.Scene(
        name="ball",
        duration=2.2,
        robot=ts.Robot(
            structure=ts.Lumped(coordinates=("ball",), mass=((1.0,),), stiffness=((0.0,),)),
            drives={},
            feet={"ball": ts.Foot(point="ball", gap=1.0)},
        ),
        ground=ts.Ground(restitution=ts.Restitution(coefficient=0.9), gravity=ts.Gravity()),
        signals={},
    )
    times = ts.simulate(ball).events["time"][: len(IMPACTS)]
    error = (
        float(np.max(np.abs(times / np.array(IMPACTS) - 1.0))) if len(times) == len(IMPACTS) else float("inf")
    )
    return {"engine": ", ".join(filter(None, BUILT.values())), "engine_error": error}
