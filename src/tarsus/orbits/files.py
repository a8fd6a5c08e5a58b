"""Branches and attractors as files: branch.nc, a point an entry, and branch.json with orbits' events and states;
attractors.json, and of each attractor a device file whose run settles to it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tarsus.files.jsontext import json_text
from tarsus.files.series import Variable, write_netcdf
from tarsus.files.toml import write_scene
from tarsus.files.version import package_version
from tarsus.files.whole import write_text

if TYPE_CHECKING:
    from tarsus.orbits.attractors import Attractors
    from tarsus.orbits.branches import Branches

BRANCH_FILES = ("branch.nc", "branch.json", "report.html")
ATTRACTOR_FILES = ("attractors.json", "report.html", "attractor-*.toml", "attractor-*.html")


def branch_variables(found: Branches) -> dict[str, Variable]:
    """The branches as series over their points, one branch after the other."""
    points = [point for one in found for point in one.points]
    orbits = [point.orbit for point in points]
    number = np.repeat(np.arange(len(found)) + 1.0, [len(one.points) for one in found])
    count = max((len(one.multipliers) for one in orbits), default=0)
    multipliers = np.full((len(orbits), count), np.nan, dtype=complex)
    for row, one in zip(multipliers, orbits, strict=True):
        row[: len(one.multipliers)] = one.multipliers
    units = {"units": found.unit, "long_name": found.path}

    def series(name: str, unit: str) -> Variable:
        return Variable(("point",), np.array([getattr(one, name) for one in orbits], dtype=float), {"units": unit})

    return {
        "at": Variable(("point",), np.array([point.at for point in points]), units),
        "branch": Variable(("point",), number, {"units": "1"}),
        "kind": Variable(("point",), np.array([point.kind for point in points], dtype=object), {}),
        "stable": series("stable", "1"),
        "period": series("period", "s"),
        "multiple": series("multiple", "1"),
        "impacts": series("impacts", "1"),
        "hardest_impact": series("hardest_impact", "m/s"),
        "highest_flight": series("highest_flight", "m"),
        "multiplier_real": Variable(("point", "multiplier"), np.real(multipliers).copy(), {"units": "1"}),
        "multiplier_imag": Variable(("point", "multiplier"), np.imag(multipliers).copy(), {"units": "1"}),
    }


def write_branch(found: Branches, folder: Path) -> tuple[Path, Path]:
    """Write branches into a folder and return the files."""
    folder.mkdir(parents=True, exist_ok=True)
    attrs = {"title": found.scene.name, "along": found.path, "source": f"tarsus {package_version()}"}
    write_netcdf(branch_variables(found), attrs, folder / "branch.nc")
    write_text(folder / "branch.json", json_text(found.to_dict() | {"tarsus": package_version()}) + "\n")
    return folder / "branch.nc", folder / "branch.json"


def write_attractors(found: Attractors, folder: Path) -> list[Path]:
    """Write what a robot does in the long run into a folder and return the files."""
    write_text(folder / "attractors.json", json_text(found.to_dict() | {"tarsus": package_version()}) + "\n")
    files = [folder / "attractors.json"]
    for i, one in enumerate(found.found, start=1):
        files.append(folder / f"attractor-{i}.toml")
        write_scene(one.scene, files[-1])
    return files
