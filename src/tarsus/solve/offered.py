"""Measures that a sweep can score, by name."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tarsus.measure.measure import Measure
from tarsus.measure.periods import scene_period
from tarsus.measure.walking import measures_of
from tarsus.solve.engine import Log
from tarsus.solve.run import Run

if TYPE_CHECKING:
    from tarsus.model.scene import Scene


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
