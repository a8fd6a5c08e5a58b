"""Measures of a foot's motion that events do not show: its swing, and its oscillations in a drive step."""

from __future__ import annotations

import numpy as np
from scipy.signal import find_peaks

from tarsus.base.arrays import Floats
from tarsus.model.scene import Scene
from tarsus.solve import Accuracy, simulate

PROMINENCE = 0.2
"""A maximum counts as an oscillation from so much of the swing on: what one sees in a printed trace of a few cm."""
SAMPLES = 100
"""Samples of a drive step: ten for each of ten oscillations."""


def swing(gap: Floats) -> float:
    """Largest less smallest gap [m]."""
    return float(np.ptp(gap))


def oscillations_per_step(gap: Floats, steps: float) -> float:
    """Maxima of a gap with a prominence of at least `PROMINENCE` of its swing, over the number of drive steps."""
    span = float(np.ptp(gap))
    if span == 0.0:
        return 0.0
    return len(find_peaks(gap, prominence=PROMINENCE * span)[0]) / steps


def motion_of(
    scene: Scene, foot: str, start: float, length: float, period: float, accuracy: Accuracy
) -> dict[str, float]:
    """Both measures of a foot from ``start`` [s] on over ``length`` [s]; infinite where the run stops before its end.

    A drive step is half a period. The energy account is not asked for: at a search's accuracy it need not close.
    """
    run = simulate(scene, start + length, accuracy)
    if run.end_time < run.duration:
        return {"swing": np.inf, "oscillations_per_step": np.inf}
    steps = 2.0 * length / period
    times = start + np.linspace(0.0, length, int(np.ceil(SAMPLES * steps)) + 1)
    states = run.states(np.minimum(times, run.duration))
    gap = states.gap[list(scene.robot.feet).index(foot)]
    return {"swing": swing(gap), "oscillations_per_step": oscillations_per_step(gap, steps)}
