"""Measures that a sweep can score, by name."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, Protocol

import numpy as np

from tarsus.measure import Measure, measures_of, scene_period
from tarsus.scene import Scene
from tarsus.solve.batch import BatchRun
from tarsus.solve.codes import EVENT_TYPE, ResultCode

__all__ = ["SCORES", "offered", "scored"]


class Score(Protocol):
    """Gives measures of a run by name: all that it has, or those of ``names`` among them."""

    def __call__(self, run: BatchRun, *, names: Collection[str] | None = None) -> Mapping[str, Measure]: ...


SCORES: tuple[Score, ...] = (measures_of,)
"""Where measures come from. A run without events must be no error, and must give every name and unit: it is how the
names are known before anything runs."""


def offered(scene: Scene, duration: float) -> dict[str, Measure]:
    """Every measure that runs of a scene have, by name, with unit and definition; the values mean nothing.

    Parameters
    ----------
    scene
        The scene.
    duration
        Model time of a run [s].
    """
    empty: Any = BatchRun(
        np.zeros(0, EVENT_TYPE), tuple(scene.robot.feet), duration, scene_period(scene, duration), ResultCode.DONE,
        scene,
    )  # fmt: skip
    return {name: measure for score in SCORES for name, measure in score(empty).items()}


def scored(run: BatchRun, names: Collection[str]) -> dict[str, Measure]:
    """Measures of one run that are asked for, by name."""
    return {name: measure for score in SCORES for name, measure in score(run, names=names).items()}
