"""The files of a finished calibration: all numbers, the weighted ensemble, and a device for every hypothesis."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tarsus.base.spec import with_values
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
    """The device of a kept hypothesis under the conditions of the first fitted row: its best member, every fitted value
    with its 95 % interval, and what else the study sets as set by it."""
    whole, lowered, study = result.ensemble, result.lowered, result.lowered.study
    ensemble = whole.ensembles[place]
    run, unknowns = lowered.forward.variants[ensemble.hypothesis.run], lowered.problem.unknowns
    sets = [unknowns.by_name(one) for one in ensemble.points]
    best = run.changes(sets[0], run.rows[0])
    assert best is not None  # it was simulated
    scene = study.scene
    for changes in (best.wholes, best.numbers):
        scene = override(scene, changes, by="a study")
    count = len(lowered.trained)
    rows = f"{count} row{'s' if count > 1 else ''}"
    note = f"Calibration '{study.name}' to {rows} of its table; hypothesis: {ensemble.hypothesis.name}."
    origins = dict(scene.provenance)
    members = [(run.run(one, run.rows[0]) or (scene, {}))[1] for one in sets]
    for path in lowered.driven:
        values = [one[path] for one in members]
        ends = [weighted_quantile(np.array(values), ensemble.weights, at) for at in (0.025, 0.975)]
        low, high = min(ends[0], values[0]), max(ends[1], values[0])
        origins[path] = Provenance(source=Source.CALIBRATED, note=note, interval=((low, high),))
    for path in lowered.settings()[ensemble.hypothesis.run]:
        covered = {one: origin for one, origin in origins.items() if not one.startswith(f"{path}.")}
        origins = covered | {path: Provenance(source=Source.CALIBRATED, note=f"{note} A discrete unknown.")}
    name = f"{study.scene.name}-{place + 1}" if len(whole.weights) > 1 else study.scene.name
    return with_values(scene, {"name": name, "provenance": origins})


def write_outputs(result: Calibration, folder: Path) -> None:
    """Write the files into a folder."""
    for place in range(len(result.solution.fit.kept)):
        write_text(folder / device_file(place), scene_text(hypothesis_scene(result, place)))
    for name, table in ((ENSEMBLE_FILE, ensemble_table(result.ensemble)), (CALIBRATION_FILE, result.to_dict())):
        write_text(folder / name, json_text(table, indent=1) + "\n")
