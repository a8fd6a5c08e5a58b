"""Chaotic motion as statistics: one scene from many random initial states.

A bouncing foot forgets its initial state within a few impacts, and single runs of it mean nothing. Each *seed* starts
the structure at rest displacement with random velocities (`tarsus.calibrate.forward.random_velocities`).
"""

from __future__ import annotations

import math

import numpy as np

from tarsus.base.spec import with_values
from tarsus.calibrate.forward import random_velocities
from tarsus.calibrate.readings import readings
from tarsus.measure.history import RESOLUTION
from tarsus.model.scene import Initial, Scene
from tarsus.solve import Accuracy, simulate_batch
from tarsus_reproduce.forecast import RowReadings

SPEED = 1e-3
"""Standard deviation of the foot's initial speed [m/s]: below a millimetre per second motion here is noise."""
ACCURACY = Accuracy(gap=1e-8)
"""Of the runs: after some impacts seeds part by far more than a step of 1e-8 of a gap errs."""
MEASURES = ("bounces_per_second", "peak", "mean_height", "mean_apex")
"""What is read: bounces [1/s], peak, gap averaged over time, mean apex of the flights [m], NaN without any."""


def foot_statistics(
    scene: Scene, seeds: int, *, duration: float, settle: float, window: float, threads: int | None = None
) -> RowReadings:
    """`MEASURES` of the first foot over many seeds of initial state, after the transient, of each window of each seed;
    runs that did not reach their end are left out.

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
    found = readings(batch, 0, MEASURES, edges, RESOLUTION)[batch.done]
    failed = tuple(code.value for code, done in zip(batch.codes, batch.done, strict=True) if not done)
    values = {name: found[:, i].ravel() for i, name in enumerate(MEASURES)}
    return RowReadings(values, len(found), failed)
