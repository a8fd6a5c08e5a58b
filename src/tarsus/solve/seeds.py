"""Chaotic motion as statistics: one scene from many random initial states.

A bouncing foot forgets its initial state within a few impacts, and single runs of it mean nothing. Each *seed* starts
the structure at rest displacement with random velocities, the same kinetic energy in every mode on average
(``v = c M^{-1/2} z`` with standard normal ``z``), scaled to a standard deviation of the bouncing foot's speed.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.base.workers import spread
from tarsus.measure.history import RESOLUTION, Counting
from tarsus.measure.periods import by_window, scene_period
from tarsus.plan.lowering import lower_scene
from tarsus.plan.rows import rows_of
from tarsus.solve.codes import ResultCode
from tarsus.solve.engine import Accuracy, book_of, execute
from tarsus.solve.results import Batch, Part

if TYPE_CHECKING:
    from tarsus.model.scene import Scene

Floats = NDArray[np.float64]

SPEED = 1e-3
"""Standard deviation of the foot's initial speed [m/s]: below a millimetre per second motion here is noise."""
ACCURACY = Accuracy(gap=1e-8)
"""Of the runs: after some impacts seeds part by far more than a step of 1e-8 of a gap errs."""


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
        Worker threads; by default one for each processor that this process may use.
    on_done
        Called after each run.
    """
    name = foot if foot is not None else next(iter(scene.robot.feet))
    whole = settle + duration
    plan = lower_scene(scene)
    book = book_of(plan, whole)
    period = scene_period(scene, whole)
    still = np.zeros(len(plan.system.mass))

    def some(first: int) -> tuple[list[str], Floats]:
        numbers = range(first, min(first + _TOGETHER, seeds))
        initial = np.array(
            [np.concatenate([still, random_velocities(scene, name, seed)]) for seed in numbers]
        )
        rows = replace(rows_of(plan, len(initial), period), initial=initial)
        raw = execute(plan, whole, rows=rows, book=book, accuracy=ACCURACY)
        codes = [ResultCode.of(int(code), makes_energy=scene.ground.makes_energy) for code in raw.codes]
        done = np.array([code is ResultCode.DONE for code in codes])
        batch = Batch(
            scene, {}, whole, np.full(len(initial), period), [Part.of(raw, np.arange(len(initial)))]
        )
        rows = _judge(batch, name, settle, resolution, window)[done]
        for _ in numbers:
            if on_done is not None:
                on_done()
        return [code.value for code in codes if code is not ResultCode.DONE], rows

    results = list(spread(some, range(0, seeds, _TOGETHER), threads))
    columns = np.concatenate([rows for _, rows in results]).transpose(1, 0, 2).reshape(len(_MEASURES), -1)
    return Statistics(*columns, failed=tuple(one for failed, _ in results for one in failed))


_TOGETHER = 16
"""Seeds that a thread runs and judges at a time."""
_MEASURES = ("bounces_per_second", "peak", "mean_height", "mean_apex")


def _judge(batch: Batch, foot: str, settle: float, resolution: float, window: float | None) -> Floats:
    """The measures (ns, 4, nw) of a foot by window, or (ns, 4, 1) by drive period."""
    feet = list(batch.scene.robot.feet)
    number, period = feet.index(foot), float(batch.periods[0])
    if window is None:
        dropped = math.ceil(settle / period * (1.0 - 1e-9))
        found = batch.measured(_MEASURES, skip=dropped, height=resolution)
        each = [one.per_foot[:, number] for one in found.values() if one.per_foot is not None]
        return np.stack(each, axis=1)[:, :, None]
    count = max(math.floor((batch.duration - settle) / window * (1.0 + 1e-9)), 1)
    edges = np.array([settle + window * k for k in range(count + 1)], dtype=np.float64)
    out = np.full((len(batch), len(_MEASURES), count), np.nan)
    for members, histories in batch.histories([number]):
        rows = by_window(histories, edges, Counting.of(period, resolution), _MEASURES)
        out[members] = np.stack([rows[name] for name in _MEASURES], axis=1)
    return out
