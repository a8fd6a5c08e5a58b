"""Sets of unknowns to what an instrument would read: runs of one template are simulated together, and neither threads
nor neighbours change one."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.spec import get_value, with_values
from tarsus.base.workers import Workers, is_executor, spread, workers
from tarsus.calibrate.description import TableSampling
from tarsus.calibrate.motion import motion_of
from tarsus.calibrate.readings import MOTION, readings, table_readings
from tarsus.calibrate.scenes import Row, Variant
from tarsus.fit.case import Case
from tarsus.measure.periods import scene_period
from tarsus.model.scene import Scene
from tarsus.solve import Accuracy, Shared, simulate_batch

Ints = NDArray[np.intp]

DIFFERENCE = 1e-3
"""Step of differences of readings, in parts of an unknown's bounds: what a search's accuracy leaves of 1e-5 is a
hundredth of that."""


TOGETHER = 64
"""Most sets that a thread simulates together: what is done once for many runs costs little then, and their events fit
into memory. Workers share the sets of a question evenly."""


@dataclass(frozen=True)
class _Runs:
    """Rows of sets, ready to run: their places (k, 2) (set, row), template, floats (k,) by path, transient and window
    [s]."""

    places: Ints
    template: Scene
    values: Mapping[str, Floats]
    settle: float
    window: float

    def __len__(self) -> int:
        return len(self.places)

    def at(self, chosen: Ints) -> _Runs:
        """Some of them."""
        return replace(
            self, places=self.places[chosen], values={p: v[chosen] for p, v in self.values.items()}
        )

    def scene(self, k: int = 0) -> Scene:
        """The scene of one. Raises InputError where it refuses a value."""
        return with_values(self.template, {path: float(v[k]) for path, v in self.values.items()})

    @classmethod
    def joined(cls, parts: Sequence[_Runs]) -> _Runs:
        """Runs of one template and times together; what some do not set is the template's."""
        first = parts[0]
        own = {path: None for one in parts for path in one.values}
        own = {path: float(get_value(first.template, path)) for path in own}
        values = {
            path: np.concatenate([one.values.get(path, np.full(len(one), own[path])) for one in parts])
            for path in own
        }
        return replace(first, places=np.concatenate([one.places for one in parts]), values=values)


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
        return np.concatenate(list(found)).astype(np.float32)

    def __getstate__(self) -> dict[str, Any]:
        """Without the workers: who got it is one of them."""
        return {**self.__dict__, "threads": 1}

    def _some(self, variant: int, rows: tuple[int, ...], sets: Floats) -> Floats:
        chosen = self.variants[variant]
        out = np.full((len(sets), len(rows), len(self.channels), self.samples), np.inf)
        unknowns = dict(zip(self.unknowns, np.asarray(sets, dtype=float).T, strict=True))
        groups: dict[tuple[object, ...], list[_Runs]] = {}
        for m, number in enumerate(rows):
            row = chosen.rows[number]
            for runs in self._runs(m, row, chosen.columns(unknowns, row)):
                if row.motion:
                    self._motion(runs, out)
                else:
                    groups.setdefault((id(row.template), runs.settle, runs.window), []).append(runs)
        for parts in groups.values():
            self._group(_Runs.joined(parts), out)
        return out

    def slopes(self, variant: int, one: Floats, rows: Sequence[int], span: Floats) -> Floats:
        """Derivatives (rows, channels, samples, nu) of the readings of a set (nu,) by its SI values; zero where there
        is none: of counts, at kinks, of what no window has.

        Rows that the engine has no derivatives of, or whose motion is read, are differenced over 2e-3 of the bounds'
        span (nu,).
        """
        chosen = self.variants[variant]
        names = [name for name in self.channels if name not in MOTION]
        at = [i for i, name in enumerate(self.channels) if name not in MOTION]

        def of(number: int) -> Floats | None:
            row = chosen.rows[number]

            def values(x: Floats) -> dict[str, float]:
                return chosen.values(dict(zip(self.unknowns, x.tolist(), strict=True)), row)

            columns = {path: np.array([value]) for path, value in values(one).items()}
            runs = self._runs(0, row, columns)
            if not runs or row.motion:
                return None
            found = self._window_slopes(runs[0], values, one, span, names)
            if found is None:
                return None
            out = np.zeros((len(self.channels), self.samples, len(one)))
            out[at] = found
            return out

        found = dict(zip(rows, spread(of, list(rows), self.threads), strict=True))
        other = [number for number in rows if found[number] is None]
        if other:
            found |= dict(zip(other, self._differences(variant, one, other, span), strict=True))
        return np.nan_to_num(np.array([found[number] for number in rows]), posinf=0.0, neginf=0.0)

    def _window_slopes(
        self,
        runs: _Runs,
        values: Callable[[Floats], dict[str, float]],
        one: Floats,
        span: Floats,
        names: list[str],
    ) -> Floats | None:
        """Derivatives (names, samples, nu) of window readings of a row; None where the engine has none, or where the
        windows move."""
        s, template = self.sampling, runs.template
        foot = s.foot or next(iter(template.robot.feet))
        index = list(template.robot.feet).index(foot)
        edges = runs.settle + runs.window * np.arange(s.windows + 1, dtype=float)
        starts = _starts(template, foot, s) if s.draws > 1 else {}
        parts = []
        for draw in range(s.draws):
            begun = {path: float(column[draw]) for path, column in starts.items()}
            case = Case(
                with_values(template, begun) if begun else template, values, float(edges[-1]),
                Accuracy(gap=s.accuracy), self._shared,
            )  # fmt: skip
            made = case.run(one, span)
            if made is None or (s.settle is None and made.period_moves):
                return None
            slopes = made.slopes_of(lambda table: table_readings(table, index, names, edges, s.resolution))
            parts.append(np.nan_to_num(slopes))
        return np.concatenate(parts, axis=1)

    def _differences(self, variant: int, one: Floats, rows: list[int], span: Floats) -> Floats:
        """Differences (rows, channels, samples, nu) of readings to both sides of a set (nu,)."""
        steps = DIFFERENCE * span * np.eye(len(one))
        found = self(variant, np.concatenate([one + steps, one - steps]), rows).astype(float)
        ahead, behind = found[: len(one)], found[len(one) :]
        both = np.isfinite(ahead) & np.isfinite(behind)  # what was not read on both sides has no slope
        changes = np.subtract(ahead, behind, out=np.zeros_like(ahead), where=both)
        return np.moveaxis(changes, 0, -1) / (2.0 * DIFFERENCE * span)

    def _runs(self, m: int, row: Row, values: Mapping[str, Floats]) -> list[_Runs]:
        """Runs of row m with floats (ns,) by path, those of one transient and window together; none of sets that have
        values which no scene takes."""
        s, whole = self.sampling, np.isfinite(list(values.values())).all(axis=0)
        sets = np.flatnonzero(whole) if values else np.arange(0)
        runs = _Runs(np.stack([sets, np.full(len(sets), m)], axis=1), row.template, values, 0.0, 0.0)
        runs = replace(runs, values={path: column[sets] for path, column in values.items()})
        if s.settle is not None and s.window is not None:
            return [replace(runs, settle=s.settle, window=s.window)] if len(sets) else []
        found: dict[float, list[int]] = {}
        for k in range(len(runs)):
            try:
                found.setdefault(scene_period(runs.scene(k), np.inf), []).append(k)
            except InputError:
                continue
        out = []
        for period, chosen in found.items():
            settle = s.settle if s.settle is not None else (s.settle_periods or 0.0) * period
            window = s.window if s.window is not None else (s.window_periods or 0.0) * period
            if np.isfinite(settle + window):
                out.append(replace(runs.at(np.array(chosen)), settle=settle, window=window))
        return out

    def _group(self, runs: _Runs, out: Floats) -> None:
        """Runs of one template and duration, all draws of all rows at once."""
        s, template = self.sampling, runs.template
        foot = s.foot or next(iter(template.robot.feet))
        index = list(template.robot.feet).index(foot)
        edges = runs.settle + runs.window * np.arange(s.windows + 1, dtype=float)
        accuracy = Accuracy(gap=s.accuracy)
        vary = {path: np.repeat(column, s.draws) for path, column in runs.values.items()}
        if s.draws > 1:
            vary |= {path: np.tile(v, len(runs)) for path, v in _starts(template, foot, s).items()}
        names = [name for name in self.channels if name not in MOTION]
        at = [i for i, name in enumerate(self.channels) if name not in MOTION]
        try:
            batch = simulate_batch(
                template, vary, float(edges[-1]), threads=1, accuracy=accuracy, shared=self._shared
            )
        except InputError:
            for k in range(len(runs)) if len(runs) > 1 else ():  # one that a scene refuses spoils no other
                self._group(runs.at(np.array([k])), out)
            return
        found = readings(batch, index, names, edges, s.resolution)
        found[~batch.done] = np.inf
        for k, (n, m) in enumerate(runs.places.tolist()):
            draws = found[k * s.draws : (k + 1) * s.draws]
            out[n, m, at] = draws.transpose(1, 0, 2).reshape(len(names), self.samples)

    def _motion(self, runs: _Runs, out: Floats) -> None:
        """Runs whose motion is read, of which nothing else is."""
        for k, (n, m) in enumerate(runs.places.tolist()):
            try:
                scene = runs.scene(k)
            except InputError:
                continue
            foot = self.sampling.foot or next(iter(scene.robot.feet))
            accuracy, period = Accuracy(gap=self.sampling.accuracy), scene_period(scene, np.inf)
            moved = motion_of(scene, foot, runs.settle, runs.window, period, accuracy)
            for i, name in enumerate(self.channels):
                out[n, m, i] = moved.get(name, np.nan)


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
    drawn = np.array(
        [random_velocities(template, foot, draw, sampling.speed) for draw in range(sampling.draws)]
    )
    return {f"initial.velocity.{i}": drawn[:, i] for i in range(drawn.shape[1])}
