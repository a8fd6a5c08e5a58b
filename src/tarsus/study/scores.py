"""Measures that a sweep can score, by name."""

from __future__ import annotations

import numpy as np

from tarsus.core.arrays import EVENT_WIDTH
from tarsus.measure import Measure, measures_of, scene_period
from tarsus.model.scene import Scene
from tarsus.solve.engine import Log
from tarsus.solve.run import Run

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
    nothing = Log(np.zeros(1, int), np.array([[duration, 0.0, 0.0]]), np.zeros((0, EVENT_WIDTH)), np.zeros(1, int))
    return dict(measures_of(Run(scene, duration, scene_period(scene, duration), nothing)))
