"""Sets of unknowns to what an instrument would read: runs of one template are simulated together, and neither threads
nor neighbours change one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.base.workers import Workers, is_executor, spread, workers
from tarsus.calibrate.description import TableSampling
from tarsus.calibrate.readings import MOTION, motion_of, readings
from tarsus.calibrate.scenes import Row, Variant
from tarsus.measure.periods import scene_period
from tarsus.model.scene import Scene
from tarsus.solve import Accuracy, Shared, simulate_batch

Ints = NDArray[np.intp]

TOGETHER = 64
"""Most sets that a thread simulates together: what is done once for many runs costs little then, and their events fit
into memory. Workers share the sets of a question evenly."""


@dataclass(frozen=True)
class _Run:
    """A row of a set, ready to run: its place (set, row), template, floats by path, window [s]."""

    place: tuple[int, int]
    template: Scene
    values: Mapping[str, float]
    window: float


@dataclass(frozen=True)
class Forward:
    """The forward model: variants of its runs, names of the unknowns, channels (measures that are read), sampling."""

    variants: tuple[Variant, ...]
    unknowns: tuple[str, ...]
    channels: tuple[str, ...]
    sampling: TableSampling
    threads: Workers = None
    _shared: Shared = field(default_factory=Shared, compare=False)

    @property
    def samples(self) -> int:
        """Number of windows of all draws."""
        return self.sampling.windows * self.sampling.draws

    def __call__(self, variant: int, sets: Floats, rows: Sequence[int]) -> NDArray[np.float32]:
        """Readings (ns, rows, channels, samples) in SI of sets (ns, nu) in a variant.

        NaN where a window has no such reading, infinite where the run did not reach its end. Single precision: so are
        they kept, and a result must not depend on whether it was read back.
        """
        each = -(-len(sets) // workers(self.threads))
        size = each if is_executor(self.threads) else min(each, TOGETHER)
        parts = [sets[i : i + size] for i in range(0, len(sets), size)]
        found = spread(partial(self._some, variant, tuple(rows)), parts, self.threads)
        with np.errstate(over="ignore"):  # what a growing motion takes beyond single precision has failed as well
            return np.concatenate(list(found)).astype(np.float32)

    def __getstate__(self) -> dict[str, Any]:
        """Without the workers: who got it is one of them."""
        return {**self.__dict__, "threads": 1}

    def _some(self, variant: int, rows: tuple[int, ...], sets: Floats) -> Floats:
        chosen = self.variants[variant]
        out = np.full((len(sets), len(rows), len(self.channels), self.samples), np.inf)
        groups: dict[tuple[object, ...], list[_Run]] = {}
        for m, number in enumerate(rows):
            for n, one in enumerate(np.asarray(sets, dtype=float).tolist()):
                run = self._run((n, m), chosen, chosen.rows[number], one)
                if run is None:
                    continue
                if chosen.rows[number].motion:
                    self._motion(run, out)
                else:
                    groups.setdefault((id(run.template), run.window), []).append(run)
        for runs in groups.values():
            self._group(runs, out)
        return out

    def _foot(self, scene: Scene) -> tuple[str, int]:
        """Name and number of the foot that is judged."""
        foot = self.sampling.foot or next(iter(scene.robot.feet))
        return foot, list(scene.robot.feet).index(foot)

    def _run(self, place: tuple[int, int], variant: Variant, row: Row, one: Sequence[float]) -> _Run | None:
        """The run of a row with a set (nu,) of SI values; None where there is no such scene."""
        found = variant.run(dict(zip(self.unknowns, one, strict=True)), row)
        if found is None or not np.isfinite(list(found[1].values())).all():
            return None
        try:
            window = self.sampling.window or scene_period(with_values(*found), np.inf)
        except InputError:
            return None
        return _Run(place, *found, window) if np.isfinite(window) else None

    def _group(self, runs: Sequence[_Run], out: Floats) -> None:
        """Runs of one template and duration, all draws of all rows at once."""
        s, template = self.sampling, runs[0].template
        edges = s.settle + runs[0].window * np.arange(s.windows + 1, dtype=float)
        foot, index = self._foot(template)
        vary = {path: np.repeat([one.values[path] for one in runs], s.draws) for path in runs[0].values}
        if s.draws > 1:
            vary |= {path: np.tile(v, len(runs)) for path, v in _starts(template, foot, s).items()}
        try:
            batch = simulate_batch(
                template, vary, float(edges[-1]), threads=1, accuracy=Accuracy(gap=s.accuracy), shared=self._shared
            )
        except InputError:
            for one in runs if len(runs) > 1 else ():  # one that a scene refuses spoils no other
                self._group([one], out)
            return
        names = [name for name in self.channels if name not in MOTION]
        at = [self.channels.index(name) for name in names]
        found = readings(batch, index, names, edges, s.resolution)
        found[~batch.done] = np.inf
        for k, run in enumerate(runs):
            draws = found[k * s.draws : (k + 1) * s.draws]
            out[*run.place, at] = draws.transpose(1, 0, 2).reshape(len(names), self.samples)

    def _motion(self, run: _Run, out: Floats) -> None:
        """A run whose motion is read, of which nothing else is."""
        s = self.sampling
        try:
            scene = with_values(run.template, run.values)
        except InputError:
            return
        period = scene_period(scene, np.inf)
        moved = motion_of(scene, self._foot(scene)[0], s.settle, run.window, period, Accuracy(gap=s.accuracy))
        for i, name in enumerate(self.channels):
            out[*run.place, i] = moved.get(name, np.nan)


def random_velocities(scene: Scene, foot: str, seed: int, speed: float) -> tuple[float, ...]:
    """Initial velocities (n,) [m/s] of seed number ``seed``: the same kinetic energy in every mode on average, ``v = c
    M^{-1/2} z`` with standard normal ``z``; speed [m/s]: standard deviation of the foot's own."""
    structure = scene.robot.structure
    factor = np.linalg.cholesky(structure.matrices().mass)
    shape = np.random.default_rng(seed).normal(size=structure.size)
    spread = np.linalg.solve(factor, structure.row(scene.robot.feet[foot].point))
    return tuple((np.linalg.solve(factor.T, shape) * speed / np.linalg.norm(spread)).tolist())


def _starts(template: Scene, foot: str, sampling: TableSampling) -> dict[str, Floats]:
    """Initial velocities (draws,) by path: the same ones for every set, of the structure as it is described."""
    drawn = np.array([random_velocities(template, foot, draw, sampling.speed) for draw in range(sampling.draws)])
    return {f"initial.velocity.{i}": drawn[:, i] for i in range(drawn.shape[1])}
