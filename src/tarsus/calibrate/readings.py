"""What is read of one foot: measures of windows of a run, which a table can hold, and of its motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats
from tarsus.measure.history import Counting, EventHistories
from tarsus.measure.periods import PER_WINDOW, by_window
from tarsus.model.scene import Scene
from tarsus.solve import Accuracy, Batch, simulate

PER_PERIOD = ("bounces", "rebounds", "contact_duration", "impacts")
"""Measures that grow with the window: a table has them by drive period."""

MOTION = {"swing": "m", "oscillations_per_step": "1"}
"""Measures of the foot's motion in a single recorded run, for constraints: its swing, and its oscillations in a drive
step, which events do not show."""
PROMINENCE = 0.2
"""A maximum counts as an oscillation from so much of the swing on: what one sees in a printed trace of a few cm."""
SAMPLES = 100
"""Samples of a drive step: ten for each of ten oscillations."""


def known_measures() -> dict[str, str]:
    """SI unit of every measure of a window, by name."""
    return {name: one.unit for name, one in PER_WINDOW.items()}


def unit_of(measure: str) -> str:
    """SI unit of a measure."""
    return MOTION[measure] if measure in MOTION else known_measures()[measure]


def readings(batch: Batch, foot: int, names: Sequence[str], edges: Floats, resolution: float) -> NDArray[np.float64]:
    """Measures (nr, names, windows) of a foot of every run in windows between ``edges`` (nw + 1,) [s]; NaN where a
    window has none.

    Those of `PER_PERIOD` are scaled from the window to the drive period.
    """
    out = np.full((len(batch), len(names), len(edges) - 1), np.nan)
    for members, table in batch.tables():
        histories = EventHistories(table.events, table.first, table.ends, [foot], len(table.feet))
        found = by_window(histories, edges, Counting.of(table.period, resolution), names)
        scale = table.period[:, None] / np.diff(edges)
        read = [found[name] * (scale if name in PER_PERIOD else 1.0) for name in names]
        out[members] = np.stack(read, axis=1)
    return out


def oscillations_per_step(gap: Floats, steps: float) -> float:
    """Maxima of a gap with a prominence of at least `PROMINENCE` of its swing, over the number of drive steps."""
    span = float(np.ptp(gap))
    if span == 0.0:
        return 0.0
    from scipy.signal import find_peaks  # which takes longer to load than a verb

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
    return {"swing": float(np.ptp(gap)), "oscillations_per_step": oscillations_per_step(gap, steps)}
