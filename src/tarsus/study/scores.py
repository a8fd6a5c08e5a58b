"""Measures that a sweep can score, by name."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from typing import Any

import numpy as np

from tarsus.measure import Measure, measures_of, scene_period, whole_run_measures
from tarsus.scene import Scene
from tarsus.solve.batch import BatchRun
from tarsus.solve.codes import EVENT_TYPE, ResultCode

__all__ = ["Score", "offered", "score_of"]

Score = Callable[[BatchRun], Mapping[str, Measure]]
"""Takes a run and gives measures by name. A run without events must be no error, and must give every name and unit: it
is how the names are known before anything runs."""


def offered(scene: Scene, duration: float) -> dict[str, Measure]:
    """Every measure that runs of a scene have, by name, with unit and definition; the values mean nothing.

    Parameters
    ----------
    scene
        The scene.
    duration
        Model time of a run [s].
    """
    return dict(measures_of(_nothing_happened(scene, duration)))


def score_of(names: Collection[str], scene: Scene, duration: float) -> Score:
    """What gives those of `offered` that are named, perhaps others with them: whole-run measures need no periods, whose
    statistics take most of the time."""
    whole = whole_run_measures(_nothing_happened(scene, duration))
    return whole_run_measures if set(names) <= set(whole) else measures_of


def _nothing_happened(scene: Scene, duration: float) -> Any:
    """A run of a scene without events."""
    return BatchRun(
        np.zeros(0, EVENT_TYPE), tuple(scene.robot.feet), duration, scene_period(scene, duration), ResultCode.DONE,
        scene,
    )  # fmt: skip
