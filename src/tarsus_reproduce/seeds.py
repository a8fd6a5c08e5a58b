"""Chaotic motion as statistics: one scene from many random initial states.

A bouncing foot forgets its initial state within a few impacts, and single runs of it mean nothing. Each *seed* starts
the structure at rest displacement with random velocities (`tarsus.calibrate.forward.random_velocities`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.base.spec import with_values
from tarsus.calibrate.forward import random_velocities
from tarsus.measure.history import RESOLUTION, Counting
from tarsus.measure.periods import by_window
from tarsus.model.scene import Initial, Scene
from tarsus.solve import Accuracy, simulate_batch

Floats = NDArray[np.float64]

SPEED = 1e-3
"""Standard deviation of the foot's initial speed [m/s]: below a millimetre per second motion here is noise."""
ACCURACY = Accuracy(gap=1e-8)
"""Of the runs: after some impacts seeds part by far more than a step of 1e-8 of a gap errs."""
_MEASURES = ("bounces_per_second", "peak", "mean_height", "mean_apex")


@dataclass(frozen=True)
class Statistics:
    """Height statistics of the first foot over ns seeds, after the transient, of each of nw windows of each seed.

    values: (ns nw,) by measure: `bounces_per_second` [1/s], `peak` [m], `mean_height` [m], the gap averaged over time,
    `mean_apex` [m] of the flights, NaN without any; failed: sentences of the runs that did not reach their end (those
    are left out).
    """

    values: Mapping[str, Floats]
    failed: tuple[str, ...]

    @property
    def ok(self) -> bool:
        """True when every run reached its end."""
        return not self.failed


def foot_statistics(
    scene: Scene, seeds: int, *, duration: float, settle: float, window: float, threads: int | None = None
) -> Statistics:
    """Bounces, peak, mean height and mean apex of the first foot over many seeds of initial state.

    scene: its own initial state is not used; duration, settle: observed time [s] of every run, and the transient before
    it that is dropped; window: length [s] of the windows that the observed time is cut into, as an instrument reads it;
    threads: by default one for each processor that this process may use.
    """
    name, size = next(iter(scene.robot.feet)), scene.robot.structure.size
    drawn = np.array([random_velocities(scene, name, seed, SPEED) for seed in range(seeds)])
    start = with_values(scene, {"initial": Initial(velocity=(0.0,) * size)})
    vary = {f"initial.velocity.{i}": drawn[:, i] for i in range(size)}
    batch = simulate_batch(start, vary, settle + duration, accuracy=ACCURACY, threads=threads)
    count = max(math.floor(duration / window * (1.0 + 1e-9)), 1)
    edges = np.array([settle + window * k for k in range(count + 1)], dtype=np.float64)
    counting, out = (
        Counting.of(float(batch.periods[0]), RESOLUTION),
        np.full((len(_MEASURES), seeds, count), np.nan),
    )
    for members, histories in batch.histories([0]):
        rows = by_window(histories, edges, counting, _MEASURES)
        out[:, members] = [rows[measure] for measure in _MEASURES]
    failed = tuple(code.value for code, done in zip(batch.codes, batch.done, strict=True) if not done)
    flat = out[:, batch.done].reshape(len(_MEASURES), -1)
    return Statistics(dict(zip(_MEASURES, flat, strict=True)), failed)
