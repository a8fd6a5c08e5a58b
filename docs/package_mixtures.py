"""Packaged mixtures and devices: the members of a calibration that fit a device's table, as small files.

    python docs/package_mixtures.py OUT [STUDY ...]

runs the packaged calibrations, or those named, in folders of OUT (what is finished there is read back, what was killed
goes on), and writes what comes out into `tarsus_reproduce`: the mixtures, and the fitted values of the devices.
"""

from __future__ import annotations

import hashlib
import json
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.spec import get_value, with_values
from tarsus.calibrate.calibrating import calibrate
from tarsus.calibrate.description import Study
from tarsus.calibrate.weighted_ensemble import WeightedEnsemble, ensemble_table, load_ensemble
from tarsus.calibrate.writing import CALIBRATION_FILE
from tarsus.files.installed import device_title
from tarsus.files.library import load_scene
from tarsus.files.toml import scene_text
from tarsus.files.whole import write_text
from tarsus.fit.ensemble import drawn_evenly
from tarsus.fit.ranges import weighted_quantile
from tarsus.model.scene import Scene, Source
from tarsus_reproduce.ensembles import FILES

MOST = 24
"""Members of a branch that are kept, the best and a draw of the others: with sixteen of the cantilever's the median of
contact durations is off by a percent more than with all, and a page takes a minute."""


def mixture_file(folder: str | Path) -> dict[str, Any]:
    """A calibration's ensemble as plain data (`ensemble_table`), with its errors over the fitted rows and over each row
    left out.

    Weights sum to 1 over the branches that are kept: those that read every column as the study's measures say, which is
    how the reproduction reads it. Of a branch with more members than `MOST` the best is kept, and of the others as many
    as are drawn evenly along their weights; those drawn share the weight of all but the best.

    Raises
    ------
    InputError
        If the folder holds no finished calibration.
    """
    whole = load_ensemble(folder)
    study, plain = whole.lowered.study, []
    for weight, one in zip(whole.weights, whole.ensembles, strict=True):
        if not column_names(study, one.hypothesis.options):
            kept, share = thinned(one.weights, MOST)
            plain.append((weight, replace(one, points=one.points[kept], weights=share)))
    weights = np.array([weight for weight, _ in plain])
    thin = replace(whole, ensembles=tuple(one for _, one in plain), weights=weights / weights.sum())
    calibration = json.loads((Path(folder) / CALIBRATION_FILE).read_text(encoding="utf-8"))
    return {
        **_rounded(ensemble_table(thin), 9),
        "seed": study.search.seed,
        "table_sha256": _digest(Path(folder) / "table.csv"),
        "study_sha256": _digest(Path(folder) / "study.py"),
        "errors": _rounded(calibration["summary"], 6),
        "notes": notes_of(whole, calibration),
    }


def notes_of(whole: WeightedEnsemble, calibration: Mapping[str, Any]) -> list[str]:
    """Sentences of what a calibration chose and was given, from its table of numbers."""
    study, notes = whole.lowered.study, []
    for name, one in calibration["choices"].items():
        weights = ", ".join(f"{option} {weight:.2f}" for option, weight in one["weights"].items())
        notes.append(f"{name}, by weight: {weights}. {one['meaning']}".strip())
    for weight, one in zip(whole.weights, whole.ensembles, strict=True):
        other = column_names(study, one.hypothesis.options)
        if other:
            read = ", ".join(f"'{column}' as {measure}" for column, measure in other.items())
            notes.append(
                "Not in this ensemble, which reads the table plainly: "
                f"{one.hypothesis.name}, weight {weight:.2f}, which reads {read}."
            )
    notes += [f"Known besides the table: {one['name']}. {one['reason']}" for one in calibration["constraints"]]
    return notes


def _rounded(value: Any, digits: int) -> Any:
    """Plain data with its floats to so many digits."""
    if isinstance(value, dict):
        return {name: _rounded(one, digits) for name, one in value.items()}
    if isinstance(value, list):
        return [_rounded(one, digits) for one in value]
    return float(f"{value:.{digits}g}") if isinstance(value, float) else value


def thinned(weights: NDArray[np.float64], most: int) -> tuple[list[int], NDArray[np.float64]]:
    """Places of at most ``most`` of the weighted members (nm,), the first and a draw of the others; their weights."""
    if len(weights) <= most:
        return list(range(len(weights))), weights / weights.sum()
    places, times = np.unique(drawn_evenly(weights[1:], np.arange(len(weights) - 1.0), most - 1), return_counts=True)
    rest = 1.0 - weights[0] / weights.sum()
    return [0, *(places + 1).tolist()], np.concatenate([[1.0 - rest], rest * times / times.sum()])


def column_names(study: Study, options: Mapping[str, str]) -> dict[str, str]:
    """Columns that options read as another measure than the study's own, with that measure."""
    read = {}
    for choice, option in options.items():
        for column, measure in study.choices[choice].measures(option).items():
            if measure != study.measures[column].measure:
                read[column] = measure
    return read


def _digest(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


def fitted_device(device: str, folder: str | Path) -> Scene:
    """A packaged device with what its calibration found: values of the best set, intervals, weight of its choices.

    Everything else of the device, and what its notes say of the origin of a value, stays.

    Raises
    ------
    InputError
        If the folder holds no finished calibration.
    """
    whole, scene = load_ensemble(folder), load_scene(device)
    study, unknowns = whole.lowered.study, whole.lowered.problem.unknowns
    plain = [n for n, one in enumerate(whole.ensembles) if not column_names(study, one.hypothesis.options)]
    best = whole.ensembles[max(plain, key=lambda n: whole.weights[n])]
    run = whole.lowered.forward.variants[best.hypothesis.run]
    sets = [unknowns.by_name(one) for one in best.points]
    members = [(run.run(one, run.rows[0]) or (None, {}))[1] for one in sets]
    origins = dict(scene.provenance)
    for path, origin in scene.provenance.items():
        if origin.source is not Source.CALIBRATED:
            continue
        each = [one for one in whole.lowered.driven if one == path or one.rpartition(".")[0] == path]
        ends = tuple(_interval([member[one] for member in members], best.weights) for one in each)
        note = re.sub(r"weight [0-9.]+", f"weight {_weight(whole, best.hypothesis.run, path):.2f}", origin.note)
        told = origin.interval is not None and ends
        origins[path] = origin.model_copy(update={"interval": ends if told else origin.interval, "note": note})
    fixed = whole.lowered.settings()[best.hypothesis.run]
    values = {path: float(f"{members[0][path]:.6g}") for path in whole.lowered.driven}
    return with_values(with_values(scene, fixed), {**values, "provenance": origins})


def with_other_modes(name: str, fitted: Scene) -> Scene:
    """A packaged device that differs from a fitted one in its frequencies: what was calibrated is taken over, the gain
    for the same displacement of its point at rest."""
    scene = load_scene(name)
    gain, weights = "robot.drives.pzt.law.gain", fitted.robot.drives["pzt"].load.vector
    taken = {
        path: get_value(fitted, path)
        for path, origin in fitted.provenance.items()
        if origin.source is Source.CALIBRATED
    }
    soft, other = (
        float((weights(one) ** 2 / np.diag(one.matrices().stiffness)).sum())
        for one in (fitted.robot.structure, scene.robot.structure)
    )
    return with_values(scene, taken | {gain: float(f"{taken[gain] * soft / other:.6g}")})


def _interval(values: list[float], weights: NDArray[np.float64]) -> tuple[float, float]:
    """95 % of weighted values (nm,), and the best, which is the first, to six digits."""
    low, high = (weighted_quantile(np.array(values), weights, at) for at in (0.025, 0.975))
    low, high = min(low, values[0]), max(high, values[0])
    return float(f"{low:.6g}"), float(f"{high:.6g}")


def _weight(whole: WeightedEnsemble, run: int, path: str) -> float:
    """Weight of the branches that set a path as a variant of the runs does."""
    settings = whole.lowered.settings()
    own = [settings[one.hypothesis.run].get(path) == settings[run].get(path) for one in whole.ensembles]
    return float(whole.weights[own].sum())


def package(folder: Path, studies: Sequence[str], say: Callable[[int, int, str], None] | None = None) -> list[Path]:
    """Calibrate packaged studies into folders of a folder, and write their mixtures and devices into this package."""
    home, written = Path(str(files("tarsus_reproduce"))), []
    for name in studies:
        out = folder / name
        calibrate(name, out, resume=out.exists(), progress=say)
        if name in FILES:
            written.append(home / "data" / FILES[name])
            write_text(written[-1], json.dumps(mixture_file(out), indent=1, default=dict) + "\n")
        made = {name: fitted_device(name, out)}
        made |= {other: with_other_modes(other, made[name]) for other in _OTHER_MODES.get(name, ())}
        for device, scene in made.items():
            written.append(home / "devices" / f"{device}.toml")
            write_text(written[-1], f"# {device_title(device)}\n{scene_text(scene)}")
    return written


_OTHER_MODES = {"hexapod": ("hexapod-table",)}
"""Fitted devices -> those that take their calibrated numbers over."""
STUDIES = ("cantilever", "cantilever-1", "hexapod")
"""Packaged calibrations; each is named after the device that it fits."""


def main(words: list[str]) -> int:
    """Run packaged calibrations and write their results into the package."""
    names = words[1:] or STUDIES
    strange = [name for name in names if name not in STUDIES]
    if not words or strange:
        raise InputError(f"expected a folder and any of {', '.join(STUDIES)}; got {' '.join(words) or 'nothing'}")
    for file in package(Path(words[0]), names):
        print(file)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
