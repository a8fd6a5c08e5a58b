"""The files of a finished calibration: all numbers, the weighted ensemble, and a device for every hypothesis."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.spec import float_paths, get_value, with_values
from tarsus.calibrate.results import device_file
from tarsus.calibrate.studyfile import ASKED_FILE, STUDY_FILE, TABLE_FILE
from tarsus.calibrate.weighted_ensemble import ENSEMBLE_FILE, ensemble_table
from tarsus.files.jsontext import json_text
from tarsus.files.runstore import SWEEP_FILES
from tarsus.files.store import REPORT_FILE
from tarsus.files.toml import scene_text
from tarsus.files.whole import write_text
from tarsus.fit.ranges import weighted_quantile
from tarsus.model.scene import Provenance, Scene, Source, override

if TYPE_CHECKING:
    from tarsus.calibrate.calibrating import Calibration

CALIBRATION_FILE = "calibration.json"
CALIBRATION_FILES = (
    *SWEEP_FILES,
    STUDY_FILE,
    ASKED_FILE,
    TABLE_FILE,
    CALIBRATION_FILE,
    ENSEMBLE_FILE,
    "branch-*.toml",
    REPORT_FILE,
)
"""Everything that a calibration's folder may hold of it, as glob patterns."""


def hypothesis_scene(result: Calibration, place: int) -> Scene:
    """The device of a kept hypothesis: its best member, every fitted value with its 95 % interval and its origin."""
    whole = result.ensemble
    ensemble = whole.ensembles[place]
    lowered, study = result.lowered, result.lowered.study
    run = lowered.forward.variants[ensemble.hypothesis.run]
    unknowns = lowered.problem.unknowns
    members = [(run.run(unknowns.by_name(one), run.rows[0]) or (None, {}))[1] for one in ensemble.points]
    scene = whole.scene(place)
    name = f"{study.scene.name}-{place + 1}" if len(whole.weights) > 1 else study.scene.name
    count = len(lowered.trained)
    rows = f"{count} row{'s' if count > 1 else ''}"
    note = f"Calibration '{study.name}' to {rows} of its table; hypothesis: {ensemble.hypothesis.name}."
    own = float_paths(study.scene).keys() - {*lowered.driven}
    given = override(study.scene, {path: one for path, one in members[0].items() if path in own}, by="a study")
    origins = {path: origin for path, origin in given.provenance.items() if _there(scene, path)}
    for path in lowered.driven:
        values = [one[path] for one in members]
        ends = [weighted_quantile(np.array(values), ensemble.weights, at) for at in (0.025, 0.975)]
        low, high = min(ends[0], values[0]), max(ends[1], values[0])
        origins[path] = Provenance(source=Source.CALIBRATED, note=note, interval=((low, high),))
    for path in lowered.settings()[ensemble.hypothesis.run]:
        covered = {one: origin for one, origin in origins.items() if not one.startswith(f"{path}.")}
        origins = covered | {path: Provenance(source=Source.CALIBRATED, note=f"{note} A discrete unknown.")}
    return with_values(scene, {"name": name, "provenance": origins})


def _there(scene: Scene, path: str) -> bool:
    """Whether a path of provenance still stands for something."""
    if "*" in path:
        return True
    try:
        return get_value(scene, path) is not None
    except InputError:
        return False


def write_outputs(result: Calibration, folder: Path) -> list[Path]:
    """Write the files into a folder, and return them."""
    written = []
    for place in range(len(result.solution.fit.kept)):
        scene = hypothesis_scene(result, place)
        target = folder / device_file(place)
        write_text(target, scene_text(scene))
        written.append(target)
    for name, table in ((ENSEMBLE_FILE, ensemble_table(result.ensemble)), (CALIBRATION_FILE, result.to_dict())):
        write_text(folder / name, json_text(table, indent=1) + "\n")
        written.append(folder / name)
    return written
