"""Branches and attractors as files: branch.nc, a point an entry, and branch.json with the orbits' events and states;
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
    from tarsus.orbits.branching import Branch

BRANCH_FILES = ("branch.nc", "branch.json", "report.html")


def branch_variables(branch: Branch) -> dict[str, Variable]:
    """The branch as series over its points, in their order."""
    orbits = [point.orbit for point in branch.points]
    count = max((len(one.multipliers) for one in orbits), default=0)
    multipliers = np.full((len(orbits), count), np.nan, dtype=complex)
    for row, one in zip(multipliers, orbits, strict=True):
        row[: len(one.multipliers)] = one.multipliers
    units = {"units": branch.unit, "long_name": branch.path}
    return {
        "at": Variable(("point",), np.array([point.at for point in branch.points]), units),
        "kind": Variable(("point",), np.array([point.kind for point in branch.points], dtype=object), {}),
        "stable": Variable(("point",), np.array([float(one.stable) for one in orbits]), {"units": "1"}),
        "period": Variable(("point",), np.array([one.period for one in orbits]), {"units": "s"}),
        "multiple": Variable(
            ("point",), np.array([one.multiple for one in orbits], dtype=float), {"units": "1"}
        ),
        "impacts": Variable(
            ("point",), np.array([one.impacts for one in orbits], dtype=float), {"units": "1"}
        ),
        "hardest_impact": Variable(
            ("point",), np.array([one.hardest_impact for one in orbits]), {"units": "m/s"}
        ),
        "highest_flight": Variable(
            ("point",), np.array([one.highest_flight for one in orbits]), {"units": "m"}
        ),
        "multiplier_real": Variable(("point", "multiplier"), np.real(multipliers).copy(), {"units": "1"}),
        "multiplier_imag": Variable(("point", "multiplier"), np.imag(multipliers).copy(), {"units": "1"}),
    }


def write_branch(branch: Branch, folder: Path) -> tuple[Path, Path]:
    """Write a branch into a folder and return the files."""
    attrs = {
        "title": branch.scene.name,
        "along": branch.path,
        "ended": branch.ended,
        "source": f"tarsus {package_version()}",
    }
    write_netcdf(branch_variables(branch), attrs, folder / "branch.nc")
    write_text(folder / "branch.json", json_text(branch.to_dict()) + "\n")
    return folder / "branch.nc", folder / "branch.json"


def attractor_files(most: int) -> list[str]:
    """Files that at most so many attractors may have in a folder."""
    each = [f"attractor-{i}.{ending}" for i in range(1, most + 1) for ending in ("toml", "html")]
    return ["attractors.json", "report.html", *each]


def write_attractors(found: Attractors, folder: Path) -> list[Path]:
    """Write what a robot does in the long run into a folder and return the files."""
    write_text(folder / "attractors.json", json_text(found.to_dict() | {"tarsus": package_version()}) + "\n")
    files = [folder / "attractors.json"]
    for i, one in enumerate(found.found, start=1):
        files.append(folder / f"attractor-{i}.toml")
        write_scene(one.scene, files[-1])
    return files
