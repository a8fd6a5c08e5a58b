"""A weighted ensemble of devices over hypotheses, kept as one file: loads itself and predicts rows nobody measured."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from tarsus.base.verb import verb
from tarsus.base.workers import Workers
from tarsus.calibrate.cells import absolute_of
from tarsus.calibrate.description import TableSampling
from tarsus.calibrate.ensemble import HypothesisEnsemble
from tarsus.calibrate.faults import Faults
from tarsus.calibrate.forward import Forward
from tarsus.calibrate.lowering import Lowered, check_rows, conditions_of, lower_study, probes, strange
from tarsus.calibrate.prediction import Discrepancy, Prediction, predict_row
from tarsus.calibrate.scenes import Row
from tarsus.calibrate.studyfile import STUDY_FILE, load_study
from tarsus.files.jsontext import read_json
from tarsus.files.rows import parse_rows
from tarsus.files.tables import read_text
from tarsus.measure.periods import scene_period
from tarsus.model.laws import Law
from tarsus.model.scene import Scene

ENSEMBLE_FILE = "mixture.json"


class SupportsRecords(Protocol):
    """A DataFrame: what gives its rows as mappings."""

    def to_dict(self, orient: str, /) -> Any: ...


RowsGiven = Mapping[str, Any] | Sequence[Mapping[str, Any]] | str | os.PathLike[str] | SupportsRecords
"""Rows of a table: mappings by column, a CSV file, or a DataFrame."""


@dataclass(frozen=True)
class WeightedEnsemble:
    """Members of every hypothesis with their weights, and the study they belong to."""

    lowered: Lowered
    ensembles: tuple[HypothesisEnsemble, ...]
    weights: NDArray[np.float64]
    discrepancy: Discrepancy

    def predict(
        self, rows: RowsGiven, *, sampling: TableSampling | None = None, threads: Workers = None
    ) -> list[dict[str, Prediction]]:
        """Predict rows by all members.

        Parameters
        ----------
        rows
            A mapping or several, a CSV file or a DataFrame: cells of the conditions by column of the study's table, as
            they stand there, and values of the scene by path, which prevail. An absent column takes the cell of the
            first fitted row; measured columns are not read.
        sampling
            Windows and initial states of the runs, instead of the study's own.
        threads
            Worker threads; by default those of the ensemble.

        Returns
        -------
        list
            For every row its predictions by measure, in SI: median, 80 % interval, probability that there is some.

        Raises
        ------
        InputError
            With every unknown column and refused value.
        """
        lowered, unknowns = self.lowered, self.lowered.problem.unknowns
        forward = self._forward(rows, sampling, threads)
        places = tuple(range(len(forward.variants[0].rows)))
        readings = [forward(one.hypothesis.run, unknowns.values(one.points), places) for one in self.ensembles]
        out = []
        for n, scene in enumerate(self._scenes(forward)):
            period, faults = scene_period(scene, np.inf), Faults()
            absolute = [
                absolute_of(forward.sampling, one, period, name, faults) for name, one in lowered.study.measures.items()
            ]
            found = predict_row(
                self.ensembles,
                self.weights,
                [one[:, n] for one in readings],
                lowered.problem.objective.cells,
                np.array(absolute),
                self.discrepancy,
            )
            out.append({one.measure: one for one in found})
        return out

    def scenes(self, rows: RowsGiven) -> list[Scene]:
        """The device of the best member under the conditions of each of the rows; arguments and errors as for
        `predict`."""
        return self._scenes(self._forward(rows, None, None))

    def _scenes(self, forward: Forward) -> list[Scene]:
        best = self.ensembles[int(np.argmax(self.weights))]
        run, values = forward.variants[best.hypothesis.run], self.lowered.problem.unknowns.by_name(best.points[0])
        return [run.scene_of(values, row) for row in run.rows]

    def _forward(self, given: RowsGiven, sampling: TableSampling | None, threads: Workers) -> Forward:
        """The forward model of rows."""
        lowered, study, faults = self.lowered, self.lowered.study, Faults()
        own = lowered.forward
        first = lowered.table.rows[lowered.trained[0]]
        asked = []
        for n, row in enumerate(_mappings(given), start=1):
            added = {name: value for name, value in row.items() if name not in lowered.table.columns}
            paths = {name: value for name, value in added.items() if "." in name and value != ""}
            faults.add(*strange(study, [name for name in added if "." not in name], f"row {n}"))
            cells = {name: row[name] for name in study.conditions if name in row}
            conditions = conditions_of(study, lowered.table, {**first, **cells}, f"row {n}", faults)
            asked.append(Row(f"row {n}", conditions, paths))
        faults.stop()
        chosen = sampling or own.sampling
        middle = probes(lowered.problem.unknowns)[0]
        variants = tuple(replace(one, rows=tuple(asked), moving=chosen.draws > 1) for one in own.variants)
        for one in variants:
            check_rows(one, middle, faults)
        faults.stop()
        return replace(own, variants=variants, sampling=chosen, threads=own.threads if threads is None else threads)


def _mappings(rows: RowsGiven) -> Sequence[Mapping[str, Any]]:
    """Rows as mappings by column."""
    if isinstance(rows, str | os.PathLike):
        return parse_rows(read_text(rows), str(rows)).rows
    if isinstance(rows, Mapping):
        return [rows]
    return rows if isinstance(rows, Sequence) else rows.to_dict("records")


def ensemble_table(whole: WeightedEnsemble) -> dict[str, Any]:
    """A weighted ensemble as plain data, which `load_ensemble` reads back."""
    unknowns = whole.lowered.problem.unknowns
    branches = []
    for weight, one in zip(whole.weights, whole.ensembles, strict=True):
        pairs = zip(one.points, one.weights.tolist(), strict=True)
        members = [{"weight": share, "unknowns": unknowns.by_name(point)} for point, share in pairs]
        branches.append({"options": one.hypothesis.options, "weight": float(weight), "members": members})
    d = whole.discrepancy
    return {
        "study": whole.lowered.study.name,
        "units": dict(zip(unknowns.names, unknowns.units, strict=True)),
        "sigma": d.sigma.tolist(),
        "existence_wrong": d.wrong.tolist(),
        "branches": branches,
    }


@verb
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
    table = read_json(place / ENSEMBLE_FILE)
    return ensemble_of_table(table, lower_study(load_study(place / STUDY_FILE, laws), threads))


def ensemble_of_table(table: Mapping[str, Any], lowered: Lowered) -> WeightedEnsemble:
    """A weighted ensemble from what `ensemble_table` made of it, for its study."""
    unknowns, ensembles = lowered.problem.unknowns, []
    for one in table["branches"]:
        hypothesis = next(b for b in lowered.problem.hypotheses if b.options == one["options"])
        sets = [[member["unknowns"][name] for name in unknowns.names] for member in one["members"]]
        points, weights = unknowns.cube(np.array(sets)), _weights(one["members"])
        nothing = np.zeros((len(points), 0))
        ensembles.append(HypothesisEnsemble(points, weights, np.zeros(len(points)), hypothesis, nothing))
    weights = _weights(table["branches"])
    discrepancy = Discrepancy(np.array(table["sigma"]), np.array(table["existence_wrong"]))
    return WeightedEnsemble(lowered, tuple(ensembles), weights, discrepancy)


def _weights(of: Sequence[Mapping[str, Any]]) -> NDArray[np.float64]:
    """Weights of sum 1, which those of a file that rounds them have nearly."""
    found = np.array([one["weight"] for one in of])
    return found / found.sum()
