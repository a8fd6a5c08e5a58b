"""A weighted ensemble of devices over hypotheses, kept as one file: loads itself and predicts rows nobody measured."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.calibrate.cells import absolute_of
from tarsus.calibrate.ensemble import HypothesisEnsemble
from tarsus.calibrate.faults import Faults
from tarsus.calibrate.lowering import Lowered, conditions_of, lower_study, probes, strange, with_rows
from tarsus.calibrate.prediction import Discrepancy, Prediction, predict_row
from tarsus.calibrate.scenes import Row
from tarsus.calibrate.studyfile import STUDY_FILE, load_study
from tarsus.measure.periods import scene_period
from tarsus.model.laws import Law
from tarsus.model.scene import Scene

ENSEMBLE_FILE = "mixture.json"
FORMAT = 2
"""Of `mixture.json`; in format 1 members did not say how they were found."""


@dataclass(frozen=True)
class WeightedEnsemble:
    """Members of every hypothesis with their weights, and the study they belong to."""

    lowered: Lowered
    ensembles: tuple[HypothesisEnsemble, ...]
    weights: NDArray[np.float64]
    discrepancy: Discrepancy

    def predict(
        self, rows: Sequence[Mapping[str, Any]], threads: int | None = None
    ) -> list[dict[str, Prediction]]:
        """Predict rows by all members.

        Parameters
        ----------
        rows
            Cells of the conditions by column of the study's table, as they stand there; an absent column takes that of
            the first fitted row.
        threads
            Worker threads; by default one for each processor that this process may use.

        Returns
        -------
        list
            For every row its predictions by measure, in SI.

        Raises
        ------
        InputError
            With every unknown column and refused value.
        """
        lowered, study, faults = self.lowered, self.lowered.study, Faults()
        first = lowered.table.rows[lowered.trained[0]]
        asked = []
        for n, row in enumerate(rows, start=1):
            faults.add(*strange(study, row, f"row {n}"))
            asked.append(
                Row(f"row {n}", conditions_of(study, lowered.table, {**first, **row}, f"row {n}", faults))
            )
        faults.stop()
        unknowns, places = lowered.problem.unknowns, tuple(range(len(rows)))
        middle = probes(unknowns)[0]
        variants = tuple(with_rows(one, asked, middle, faults) for one in lowered.forward.variants)
        faults.stop()
        forward = replace(lowered.forward, variants=variants, threads=threads)
        readings = [
            forward(one.hypothesis.run, unknowns.values(one.points), places) for one in self.ensembles
        ]
        out = []
        for n in places:
            best = self.ensembles[int(np.argmax(self.weights))]
            scene = variants[best.hypothesis.run].scene_of(unknowns.by_name(best.points[0]), asked[n])
            period = scene_period(scene, np.inf)
            absolute = np.array(
                [absolute_of(study, one, period, "", faults) for one in study.measures.values()]
            )
            found = predict_row(
                self.ensembles, self.weights, [one[:, n] for one in readings], lowered.problem.objective.cells,
                absolute, self.discrepancy, lowered.problem.peak, lowered.problem.resolution,
            )  # fmt: skip
            out.append({one.measure: one for one in found})
        return out

    def scene(self, kept: int, member: int = 0) -> Scene:
        """The device of a member (0: the best) of a kept hypothesis, under the conditions of the first fitted row."""
        one = self.ensembles[kept]
        run = self.lowered.forward.variants[one.hypothesis.run]
        unknowns = self.lowered.problem.unknowns
        return run.scene_of(unknowns.by_name(one.points[member]), run.rows[0])


def ensemble_table(whole: WeightedEnsemble) -> dict[str, Any]:
    """A weighted ensemble as plain data, which `load_ensemble` reads back."""
    unknowns = whole.lowered.problem.unknowns
    branches = []
    for weight, one in zip(whole.weights, whole.ensembles, strict=True):
        run = whole.lowered.forward.variants[one.hypothesis.run]
        members = []
        for point, share, found in zip(one.points, one.weights, one.found, strict=True):
            values = unknowns.by_name(point)
            members.append(
                {
                    "weight": float(share),
                    "found": found,
                    "point": point.tolist(),
                    "unknowns": values,
                    "values": {path: run.values(values, run.rows[0])[path] for path in run.driven},
                }
            )
        branches.append({"options": one.hypothesis.options, "weight": float(weight), "members": members})
    d = whole.discrepancy
    return {
        "format": FORMAT,
        "study": whole.lowered.study.name,
        "units": dict(zip(unknowns.names, unknowns.units, strict=True)),
        "sigma": d.sigma.tolist(),
        "existence_wrong": d.wrong.tolist(),
        "branches": branches,
    }


def load_ensemble(
    folder: str | os.PathLike[str], laws: Mapping[str, type[Law]] | None = None, threads: int | None = None
) -> WeightedEnsemble:
    """Read the weighted ensemble of a calibration's folder.

    Parameters
    ----------
    folder
        Folder that `tarsus.calibrate` made.
    laws
        Classes of user laws by name, where the scene has them.
    threads
        Worker threads of its predictions; by default one for each processor that this process may use.

    Returns
    -------
    WeightedEnsemble
        Devices with weights, which predicts any measure with an interval.

    Raises
    ------
    InputError
        If the folder holds no finished calibration.
    """
    place = Path(folder)
    try:
        table = json.loads((place / ENSEMBLE_FILE).read_text(encoding="utf-8"))
        same = table["format"] == FORMAT
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"'{place}' holds no finished calibration: {error}") from None
    if not same:
        raise InputError(f"'{place}' holds an ensemble of another format; calibrate again")
    lowered = lower_study(load_study(place / STUDY_FILE, laws), threads)
    ensembles = []
    for one in table["branches"]:
        hypothesis = next(b for b in lowered.problem.hypotheses if b.options == one["options"])
        points = np.array([member["point"] for member in one["members"]])
        weights = np.array([member["weight"] for member in one["members"]])
        nothing, found = np.zeros((len(points), 0)), tuple(member["found"] for member in one["members"])
        ensembles.append(
            HypothesisEnsemble(points, weights, np.zeros(len(points)), hypothesis, nothing, found)
        )
    weights = np.array([one["weight"] for one in table["branches"]])
    discrepancy = Discrepancy(np.array(table["sigma"]), np.array(table["existence_wrong"]))
    return WeightedEnsemble(lowered, tuple(ensembles), weights, discrepancy)
