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

from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.calibrate.description import Study
from tarsus.calibrate.ensemble import drawn
from tarsus.calibrate.mixture import Mixture, load_mixture
from tarsus.calibrate.outputs import CALIBRATION_FILE
from tarsus.calibrate.prediction import Miss
from tarsus.files.library import load_scene
from tarsus_reproduce.predictions import Member

__all__ = ["mixture_file", "packaged_errors", "packaged_members", "packaged_misses"]

MOST = 24
"""Members of a branch that are kept, the best and a draw of the others: with sixteen of the cantilever's the median of
contact durations is off by a percent more than with all, and a page takes a minute."""

_PACKAGED = {"cantilever": "cantilever_mixture.json", "hexapod": "hexapod_mixture.json"}


def packaged_members(device: str) -> tuple[Member, ...]:
    """The packaged mixture of a device, as scenes with weights; empty for a device without one."""
    table = _packaged(device)
    if table is None:
        return ()
    scene = load_scene(device)
    return tuple(
        Member(with_values(base, one["values"]), one["weight"])
        for branch in table["branches"]
        for base in [with_values(scene, {"name": f"{device}, {branch['name']}", **branch["set"]})]
        for one in branch["members"]
    )


def packaged_misses(device: str) -> dict[str, Miss]:
    """What a packaged mixture misses of the measures of its study, by their names there; empty without a mixture."""
    table = _packaged(device) or {}
    return {name: Miss(**one) for name, one in table.get("discrepancy", {}).items()}


def packaged_errors(device: str) -> dict[str, Any] | None:
    """Errors of a packaged mixture by its calibration, over the rows it was fitted to ("training") and over each as it
    was predicted without it ("left_out", None where no row was): by measure of the study `mean_relative_error`,
    `mean_absolute_error` in `unit`, `held` (share of values in their 80 % intervals) and `brier` (score of existence);
    and `held` of all. None without a mixture."""
    return (_packaged(device) or {}).get("errors")


def _packaged(device: str) -> dict[str, Any] | None:
    name = _PACKAGED.get(device)
    if name is None:
        return None
    return json.loads(files("tarsus_reproduce").joinpath("data", name).read_text(encoding="utf-8"))


def mixture_file(folder: str | Path) -> dict[str, Any]:
    """A calibration's mixture as plain data: of every member its weight and all floats that were fitted; what the model
    misses of every measure; and its errors over the fitted rows and over each row left out.

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
            values = dict(zip(unknowns.names, unknowns.at(one.points[i]).tolist(), strict=True))
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
        "discrepancy": _discrepancy(mixture),
        "errors": _rounded(
            json.loads((Path(folder) / CALIBRATION_FILE).read_text(encoding="utf-8"))["summary"]
        ),
        "branches": branches,
    }


def _discrepancy(mixture: Mixture) -> dict[str, dict[str, float]]:
    """Of every measure the fields of its `Miss`; the tolerance is that of the row where it is largest."""
    cells, found = mixture.lowered.problem.objective.cells, mixture.discrepancy
    return {
        name: {
            "absolute": float(f"{cells.absolute[:, k].max():.6g}"),
            "relative": float(cells.relative[k]),
            "sigma": float(f"{found.sigma[k]:.6g}"),
            "wrong": float(f"{found.wrong[k]:.6g}"),
        }
        for k, name in enumerate(cells.names)
    }


def _rounded(value: Any) -> Any:
    """Plain data with its floats to six digits."""
    if isinstance(value, dict):
        return {name: _rounded(one) for name, one in value.items()}
    return float(f"{value:.6g}") if isinstance(value, float) else value


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
