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

from tarsus.measure import RESOLUTION, Counting, by_window, histories_of, period_statistics, scene_period
from tarsus.plan import lower_scene
from tarsus.scene import Scene
from tarsus.solve import Accuracy, Run
from tarsus.solve.codes import ResultCode
from tarsus.solve.engine import SharedBook, execute

Floats = NDArray[np.float64]

SPEED = 1e-3
"""Standard deviation of the foot's initial speed [m/s]: below a millimetre per second motion here is noise."""
ACCURACY = Accuracy(gap=1e-8)


@dataclass(frozen=True)
class Statistics:
    """Height statistics of one foot over ns seeds, after the transient.

    The measures of `tarsus.measure` by drive period after the transient, or of every window of every seed, then with
    (ns nw,) values each: bounces (ns,) [1/s]; peak (ns,) [m];
    mean (ns,) [m] mean height, the gap averaged over time; apex (ns,) [m] mean apex of the flights, NaN without any;
    failed: sentences of the runs that did not reach their end (those are left out).
    """

    bounces: Floats
    peak: Floats
    mean: Floats
    apex: Floats
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
    window: float | None = None,
    threads: int | None = None,
    on_done: Callable[[], None] | None = None,
) -> Statistics:
    """Bounces, peak, mean height and mean apex of a foot over many seeds of initial state.

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
        Height [m] that a flight must clear to count.
    window
        Length [s] of the windows that the observed time is cut into, as an instrument reads it; without it a seed has
        one value, the mean over its drive periods.
    threads
        Worker threads; all cores by default.
    on_done
        Called after each run.
    """
    name = foot if foot is not None else next(iter(scene.robot.feet))
    whole = settle + duration
    plan = lower_scene(scene)
    book = SharedBook(plan, whole)
    period = scene_period(scene, whole)

    def one(seed: int) -> Floats | str:
        own = replace(
            plan,
            initial=np.concatenate([np.zeros(len(plan.system.mass)), random_velocities(scene, name, seed)]),
        )
        raw = execute(own, whole, book=book, accuracy=ACCURACY, period=period)
        run = Run(scene, own, raw, whole, period, math.nan)
        # the steps are not kept, so that there is no energy account to ask for
        code = ResultCode.of(int(raw.codes[0]), makes_energy=scene.ground.makes_energy)
        done = code is ResultCode.DONE
        result = _judge(run, name, settle, resolution, window) if done else code.value
        if on_done is not None:
            on_done()
        return result

    with ThreadPoolExecutor(threads or os.cpu_count() or 1) as pool:
        results = [one(0), *pool.map(one, range(1, seeds))]  # the first compiles before the threads start
    rows = [row for row in results if not isinstance(row, str)]
    columns = np.concatenate(rows, axis=1) if rows else np.zeros((4, 0))
    return Statistics(*columns, failed=tuple(row for row in results if isinstance(row, str)))


_MEASURES = ("bounces_per_second", "peak", "mean_height", "mean_apex")


def _judge(run: Run, foot: str, settle: float, resolution: float, window: float | None) -> Floats:
    """The measures (4, nw) of a foot by window, or (4, 1) by drive period."""
    if window is None:
        dropped = math.ceil(settle / run.period * (1.0 - 1e-9))
        found = period_statistics(run, skip=dropped, height=resolution)
        return np.array([[found[name].per_foot[foot]] for name in _MEASURES])
    count = max(math.floor((run.duration - settle) / window * (1.0 + 1e-9)), 1)
    edges = np.array([settle + window * k for k in range(count + 1)], dtype=np.float64)
    history = {foot: histories_of(run)[foot]}
    rows = by_window(history, edges, Counting.of(run.period, resolution))
    return np.array([rows[name][0] for name in _MEASURES])
