"""Measures that a sweep can score, by name."""

from __future__ import annotations

import numpy as np

from tarsus.measure import Measure, measures_of, scene_period
from tarsus.model.scene import Scene
from tarsus.solve.batch import BatchRun
from tarsus.solve.codes import EVENT_TYPE, ResultCode

__all__ = ["offered"]


def offered(scene: Scene, duration: float) -> dict[str, Measure]:
    """Every measure that runs of a scene have, by name, with unit and definition; the values mean nothing.

    Parameters
    ----------
    scene
        The scene.
    duration
        Model time of a run [s].
    """
    empty = BatchRun(
        np.zeros(0, EVENT_TYPE), tuple(scene.robot.feet), duration, scene_period(scene, duration), ResultCode.DONE,
        scene,
    )  # fmt: skip
    return dict(measures_of(empty))
