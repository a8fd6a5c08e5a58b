"""Chaotic motion as statistics: one scene from many random initial states.

A bouncing foot forgets its initial state within a few impacts, and single runs of it mean nothing. Each *seed* starts
the structure at rest displacement with random velocities, the same kinetic energy in every mode on average
(``v = c M^{-1/2} z`` with standard normal ``z``), scaled to a standard deviation of the bouncing foot's speed.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tarsus.measure import RESOLUTION, foot_history, period_statistics, scene_period
from tarsus.plan import lower_scene
from tarsus.scene import Scene
from tarsus.solve import Accuracy, Run
from tarsus.solve.engine import SharedBook, execute

Floats = NDArray[np.float64]

SPEED = 1e-3
"""Standard deviation of the foot's initial speed [m/s]: below a millimetre per second motion here is noise."""
SAMPLES_PER_S = 4000
"""Samples of the gap per second of model time, for its mean."""
ACCURACY = Accuracy(gap=1e-8)


@dataclass(frozen=True)
class Statistics:
    """Height statistics of one foot over ns seeds, after the transient.

    bounces (ns,) [1/s]: rebounds whose apex clears the resolution; peak (ns,) [m]: highest gap in a drive period, mean
    over the periods; mean (ns,) [m]: gap averaged over time; failed: sentences of the runs that did not reach their end
    (those are left out).
    """

    bounces: Floats
    peak: Floats
    mean: Floats
    failed: tuple[str, ...]

    @property
    def ok(self) -> bool:
        """True when every run reached its end."""
        return not self.failed


def random_velocities(scene: Scene, foot: str, seed: int, speed: float = SPEED) -> tuple[float, ...]:
    """Initial velocities (n,) [m/s] of seed number ``seed``; ``speed`` [m/s]: standard deviation of the foot's own."""
    structure = scene.robot.structure
    factor = np.linalg.cholesky(structure.matrices().mass)
    shape = np.random.default_rng(seed).normal(size=structure.size)
    spread = np.linalg.solve(factor, structure.row(scene.robot.feet[foot].point))
    return tuple((np.linalg.solve(factor.T, shape) * speed / np.linalg.norm(spread)).tolist())


def foot_statistics(
    scene: Scene,
    seeds: int,
    *,
    duration: float,
    settle: float,
    foot: str | None = None,
    resolution: float = RESOLUTION,
    threads: int | None = None,
    on_done: Callable[[], None] | None = None,
) -> Statistics:
    """Bounces, peak and mean height of a foot over many seeds of initial state.

    Parameters
    ----------
    scene
        The scene; its own initial state is not used.
    seeds
        Number of runs.
    duration, settle
        Observed time [s] of every run, and the transient before it that is dropped.
    foot
        Its name; the first foot by default.
    resolution
        Height [m] a rebound must clear to count.
    threads
        Worker threads; all cores by default.
    on_done
        Called after each run.
    """
    name = foot if foot is not None else next(iter(scene.robot.feet))
    index = list(scene.robot.feet).index(name)
    times = settle + (np.arange(math.ceil(duration * SAMPLES_PER_S)) + 0.5) / SAMPLES_PER_S
    times = times[times < settle + duration]

    whole = settle + duration
    plan = lower_scene(scene)
    book = SharedBook(plan, whole)
    period = scene_period(scene, whole)

    def one(seed: int) -> tuple[float, float, float] | str:
        own = replace(
            plan,
            initial=np.concatenate([np.zeros(len(plan.system.mass)), random_velocities(scene, name, seed)]),
        )
        raw = execute(own, whole, book=book, accuracy=ACCURACY, period=period, record=True)
        run = Run(scene, own, raw, whole, period, math.nan)
        result = _judge(run, index, times, settle, resolution) if run.ok else run.code.value
        if on_done is not None:
            on_done()
        return result

    with ThreadPoolExecutor(threads or os.cpu_count() or 1) as pool:
        results = [one(0), *pool.map(one, range(1, seeds))]  # the first compiles before the threads start
    rows = np.array([row for row in results if not isinstance(row, str)]).reshape(-1, 3)
    return Statistics(
        rows[:, 0], rows[:, 1], rows[:, 2], tuple(row for row in results if isinstance(row, str))
    )


def _judge(run: Run, foot: int, times: Floats, settle: float, resolution: float) -> tuple[float, float, float]:
    history = foot_history(run.all_events, foot, run.duration)
    peaks = period_statistics(run, skip=math.ceil(settle / run.period * (1.0 - 1e-9)))["peak"].per_foot
    return (
        float(np.count_nonzero(history.bounces(resolution) >= settle)) / (run.duration - settle),
        peaks[run.foot_names[foot]],
        float(run.states(times).gap[foot].mean()),
    )
