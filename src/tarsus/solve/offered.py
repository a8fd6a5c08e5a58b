"""Measures that a sweep can score, by name."""

from __future__ import annotations

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
    return dict(measures_of(Run(scene, duration, scene_period(scene, duration), Log.nothing(duration))))
