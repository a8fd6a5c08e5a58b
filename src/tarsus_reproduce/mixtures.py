"""Packaged mixtures: the members of a calibration that fit a device's table, as small files.

    python -m tarsus_reproduce.mixtures OUT > hexapod_mixture.json

writes the file of the calibration whose result is in the folder OUT (`tarsus calibrate hexapod -o OUT`).
"""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Mapping
from importlib.resources import files
from itertools import compress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.calibrate.description import Study
from tarsus.calibrate.ensemble import drawn
from tarsus.calibrate.mixture import load_mixture
from tarsus.errors import InputError
from tarsus.files.library import load_scene
from tarsus.spec import with_values
from tarsus_reproduce.predictions import Member

__all__ = ["mixture_file", "packaged_members"]

MOST = 6
"""Members of a branch that are kept, the best and a draw of the others: enough for its spread, and a page takes half a
minute."""

_PACKAGED = {"cantilever": "cantilever_mixture.json", "hexapod": "hexapod_mixture.json"}


def packaged_members(device: str) -> tuple[Member, ...]:
    """The packaged mixture of a device, as scenes with weights; empty for a device without one."""
    name = _PACKAGED.get(device)
    if name is None:
        return ()
    table = json.loads(files("tarsus_reproduce").joinpath("data", name).read_text(encoding="utf-8"))
    scene = load_scene(device)
    return tuple(
        Member(with_values(base, one["values"]), one["weight"])
        for branch in table["branches"]
        for base in [with_values(scene, {"name": f"{device}, {branch['name']}", **branch["set"]})]
        for one in branch["members"]
    )


def mixture_file(folder: str | Path) -> dict[str, Any]:
    """A calibration's mixture as plain data: of every member its weight and all floats that were fitted.

    Weights sum to 1 over the branches that are kept: those that read every column as the study's measures say, which is
    how the reproduction reads it. Of a branch with more members than `MOST` the best is kept, and of the others as many
    as are drawn evenly along their weights; those drawn share the weight of all but the best.

    Raises
    ------
    InputError
        If the folder holds no finished calibration.
    """
    mixture = load_mixture(folder)
    study = mixture.lowered.study
    unknowns = mixture.lowered.problem.unknowns
    branches = []
    plain = [column_names(study, one.branch.options) == {} for one in mixture.ensembles]
    total = float(mixture.weights[plain].sum())
    for weight, one in zip(mixture.weights[plain] / total, compress(mixture.ensembles, plain), strict=True):
        run = mixture.lowered.forward.branches[one.branch.run]
        kept, share = thinned(one.weights, MOST)
        members = []
        for i, part in zip(kept, share, strict=True):
            values = dict(zip(unknowns.names, unknowns.values(one.points[i]).tolist(), strict=True))
            driven = run.values(values, run.rows[0])
            fitted = {path: float(f"{driven[path]:.9g}") for path in run.driven}
            members.append({"weight": float(f"{weight * part:.6g}"), "values": fitted})
        chosen = (study.choices[choice].options[option] for choice, option in one.branch.options.items())
        fixed = {path: value for option in chosen for path, value in option.set.items()}
        branches.append(
            {"name": one.branch.name, "weight": float(f"{weight:.6g}"), "set": fixed, "members": members}
        )
    return {
        "study": study.name,
        "seed": study.search.seed,
        "table_sha256": _digest(Path(folder) / "table.csv"),
        "study_sha256": _digest(Path(folder) / "study.toml"),
        "branches": branches,
    }


def thinned(weights: NDArray[np.float64], most: int) -> tuple[list[int], NDArray[np.float64]]:
    """Places of at most ``most`` of the weighted members (nm,), the first and a draw of the others; their weights."""
    if len(weights) <= most:
        return list(range(len(weights))), weights / weights.sum()
    places, times = np.unique(drawn(weights[1:], np.arange(len(weights) - 1.0), most - 1), return_counts=True)
    rest = 1.0 - weights[0] / weights.sum()
    return [0, *(places + 1).tolist()], np.concatenate([[1.0 - rest], rest * times / times.sum()])


def column_names(study: Study, options: Mapping[str, str]) -> dict[str, str]:
    """Columns that options read as another measure than the study's own, with that measure."""
    read = {}
    for choice, option in options.items():
        for column, measure in study.choices[choice].options[option].measures.items():
            if measure != study.measures[column].measure:
                read[column] = measure
    return read


def _digest(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


def main(words: list[str]) -> int:
    """Print the file of a calibration's folder."""
    if len(words) != 1:
        raise InputError("expected the folder of a calibration")
    print(json.dumps(mixture_file(words[0]), indent=1, default=dict))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
