"""Ensembles that predict rows of printed tables: packaged ones, which calibrations found, and single devices.

`docs/package_mixtures.py` calibrates the packaged studies and writes their ensembles and the fitted devices.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from tarsus.calibrate.ensemble import HypothesisEnsemble
from tarsus.calibrate.lowering import Lowered, lower_study
from tarsus.calibrate.objective import Hypothesis
from tarsus.calibrate.prediction import Discrepancy
from tarsus.calibrate.scenes import Variant
from tarsus.calibrate.studyfile import FUNCTION, load_study
from tarsus.calibrate.weighted_ensemble import WeightedEnsemble, ensemble_of_table
from tarsus.files.rowfunction import RowFunction
from tarsus.model.scene import Scene
from tarsus_reproduce.packaged import data_text

FILES = {"cantilever": "cantilever_mixture.json", "hexapod": "hexapod_mixture.json"}
"""Device -> the file of its ensemble."""


@lru_cache
def _packaged(device: str) -> dict[str, Any]:
    """The file of a device; empty for one without an ensemble."""
    return json.loads(data_text(FILES[device])) if device in FILES else {}


@lru_cache
def packaged_study(name: str) -> Lowered:
    """A packaged study; whether there is a bounce is judged of every table."""
    lowered = lower_study(load_study(name))
    cells = lowered.problem.objective.cells
    cells = replace(cells, exists=np.array([one == "bounces" for one in cells.names]))
    objective = replace(lowered.problem.objective, cells=cells)
    return replace(lowered, problem=replace(lowered.problem, objective=objective))


def packaged_ensemble(device: str) -> WeightedEnsemble | None:
    """The packaged ensemble of a device; None for a device without one."""
    return ensemble_of_table(_packaged(device), packaged_study(device)) if device in FILES else None


def device_ensemble(study: str, scene: Scene, driven: Callable[[Scene, Mapping[str, Any]], Scene]) -> WeightedEnsemble:
    """A single device as an ensemble that predicts rows of a packaged study, without a discrepancy.

    driven: the device under the conditions of a row; what it changes of signals and gaps is taken.
    """
    lowered = packaged_study(study)

    def changes(_: Any, row: Mapping[str, Any]) -> dict[str, Any]:
        made = driven(scene, row)
        signals = {f"signals.{name}": one.model_dump() for name, one in made.signals.items()}
        return signals | {f"robot.feet.{name}.gap": one.gap for name, one in made.robot.feet.items()}

    module = ModuleType(scene.name)
    setattr(module, FUNCTION, changes)
    defined = RowFunction(Path(scene.name), FUNCTION, module, b"")
    forward = replace(lowered.forward, variants=(Variant(scene, defined, {}, (), {}),))
    columns = tuple(forward.channels.index(one.measure) for one in lowered.study.measures.values())
    middle, one = np.full((1, len(lowered.problem.unknowns)), 0.5), np.ones(1)
    alone = HypothesisEnsemble(middle, one, 0.0 * one, Hypothesis({}, 0, columns), np.zeros((1, 0)))
    nothing = np.zeros(len(columns))
    return WeightedEnsemble(replace(lowered, forward=forward), (alone,), one, Discrepancy(nothing, nothing))


def packaged_errors(device: str) -> dict[str, Any] | None:
    """Errors of a packaged ensemble by its calibration, over the rows it was fitted to ("training") and over each as it
    was predicted without it ("left_out", None where no row was): by measure of the study `mean_relative_error`,
    `mean_absolute_error` in `unit`, `held` (share of values in their 80 % intervals) and `brier` (score of existence);
    `held` of all; and what was chosen (`notes`: options with their weights, interpretations of the table that
    are not in it, constraints with their reasons, a sentence each). None without an ensemble."""
    table = _packaged(device)
    return {**table["errors"], "notes": tuple(table["notes"])} if table else None
