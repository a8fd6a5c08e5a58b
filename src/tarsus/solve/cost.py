"""How much work a run will be, before it is started."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tarsus.model.scene import Scene

MOST_STEPS = 1e8
"""Longest run that is started: about an hour of computing and more samples than anyone reads."""

STEPS_PER_CYCLE = 20.0
"""Steps a cycle of the fastest motion, a round number: the estimate is only there to refuse the absurd."""


def estimated_steps(scene: Scene, duration: float) -> float:
    """Rough number of engine steps for `duration` [s]: 20 a cycle of the fastest mode or drive."""
    import numpy as np

    matrices = scene.robot.structure.matrices()
    squares = np.linalg.eigvals(np.linalg.solve(matrices.mass, matrices.stiffness)).real
    fastest = math.sqrt(max(float(np.max(squares, initial=0.0)), 0.0)) / (2.0 * math.pi)
    drives = [float(getattr(signal, "frequency", 0.0)) for signal in scene.waveforms.values()]
    return duration * max([fastest, *drives, 1.0]) * STEPS_PER_CYCLE
