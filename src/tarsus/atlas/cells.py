"""Runs of a map's cells until they repeat, natively many at a time: classes, and measures of the settled motions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.atlas.classes import REFUSED, codes_of
from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.base.workers import Workers, spread
from tarsus.model.scene import Scene
from tarsus.model.structure.walker import Walker
from tarsus.orbits.basins import motions_of
from tarsus.orbits.returns import drive_period
from tarsus.orbits.settling import KEPT, Settling
from tarsus.orbits.starts import Box
from tarsus.plan.slots import slot
from tarsus.solve import Shared, Trajectories

Floats = NDArray[np.float64]
Arrays = dict[str, NDArray[Any]]

MOST_PERIODS = 120
"""Drive periods after which a run counts as not settled: a multiplier of 0.9 has made 1e-6 of a deviation by then."""
BEYOND = 200
"""Drive periods that runs may go on afterwards, until twins are distinguished."""
MOST_RUNS = 128
"""Runs that go on together: of a walker of many legs they take some 100 MB."""
OPEN = 16
"""Last drive periods over which a motion that does not repeat is measured: as many as the longest multiple."""
SLIPS = 2048
"""Phases of a drive period at which feet are seen that slide: those of the millipede do for a five-hundredth of it."""

MEASURES = {
    "bounces": ("1", "touchdowns per drive period after which the foot departs at once"),
    "impacts": ("1", "touchdowns per drive period, captures and those that come to rest included"),
    "touchdown_speed": ("m/s", "mean approach speed of the touchdowns"),
    "energy": ("J", "energy lost in touchdowns per drive period"),
    "travel": ("m", "way of a walker per drive period"),
    "slip": ("m", "way that a foot of a walker slides per drive period, mean over its feet"),
    "settled_after": ("1", "drive periods after which the motion repeats"),
    "motions": ("1", "settled motions that the starts of a cell lead to"),
}
"""Measures of a cell: unit, and what it is."""


@dataclass(frozen=True)
class CellRuns:
    """What is asked at a point of a map: a scene, the paths of its axes, and so many starts, spread over the box of
    `tarsus.orbits.starts`; the scene's own start where there is one;
    periods: drive periods after which a run counts as not settled."""

    scene: Scene
    paths: tuple[str, str]
    starts: int = 1
    periods: int = MOST_PERIODS

    @property
    def names(self) -> tuple[str, ...]:
        """Measures that every cell has."""
        left = set() if isinstance(self.scene.robot.structure, Walker) else {"travel", "slip"}
        return tuple(name for name in MEASURES if name not in (left if self.starts > 1 else left | {"motions"}))

    @property
    def together(self) -> int:
        """Points that are done together."""
        return max(MOST_RUNS // self.starts, 1)

    def of(self, points: Floats, workers: Workers = 1) -> Arrays:
        """Of points (k, 2): code (k,) of the class that most starts lead to; codes (k, starts) of each start; measures
        (k, nm) in the order of `names`, of the motion that most starts of that class lead to."""
        jobs = [points[first : first + self.together] for first in range(0, len(points), self.together)]
        parts = list(spread(partial(_cells, self), jobs, workers))
        return {name: np.concatenate([one[name] for one in parts]) for name in parts[0]}

    @cached_property
    def _box(self) -> Box | None:
        return Box.of(self.scene, None) if self.starts > 1 else None

    @cached_property
    def _kept(self) -> tuple[Shared, dict[tuple[float, ...], float]]:
        """What engines share from one job to the next, and drive periods that are known."""
        return Shared(), {}

    def __getstate__(self) -> dict[str, Any]:
        return {name: one for name, one in self.__dict__.items() if name != "_kept"}

    def settled(self, points: Floats) -> list[tuple[NDArray[np.intp], Settling]]:
        """Runs of all starts of points (k, 2), cell by cell, after they have settled or not: their numbers, and the
        runs. Runs that the scene refuses are none of them."""
        values = {path: np.repeat(points[:, i], self.starts) for i, path in enumerate(self.paths)}
        scene = self.scene
        if self._box is not None:
            scene = self._box.scene
            starts = self._box.values(self._box.drawn(self.starts, seed=0))
            values = {path: np.tile(one, len(points)) for path, one in starts.items()} | values
        anew = [path for path in self.paths if slot(scene, path) is None]
        if not anew:
            return self._made(scene, values, np.arange(len(points) * self.starts))
        rows, which = np.unique(np.column_stack([values[path] for path in anew]), axis=0, return_inverse=True)
        found = []
        for i, row in enumerate(rows.tolist()):
            own = np.flatnonzero(which.ravel() == i)
            part = {path: one[own] for path, one in values.items() if path not in anew}
            try:
                variant = with_values(scene, dict(zip(anew, row, strict=True)))
            except InputError:
                continue
            found += self._made(variant, part, own)
        return found

    def _made(
        self, scene: Scene, values: Mapping[str, Floats], numbers: NDArray[np.intp]
    ) -> list[tuple[NDArray[np.intp], Settling]]:
        """Runs of one plan; where the scene refuses some of them, the others in halves."""
        try:
            periods = self._periods(scene, values, len(numbers))
            longest = (self.periods + BEYOND) * float(periods.max())
            runs = Trajectories.of(scene, values, longest, shared=self._kept[0])
        except InputError:
            if len(numbers) == 1:
                return []
            middle = len(numbers) // 2
            return [
                one
                for part in (slice(None, middle), slice(middle, None))
                for one in self._made(scene, {path: v[part] for path, v in values.items()}, numbers[part])
            ]
        walks = isinstance(scene.robot.structure, Walker)
        settling = Settling(runs, periods, np.zeros(len(runs)), walks, threads=1)
        settling.settle(self.periods)
        return [(numbers, settling)]

    def _periods(self, scene: Scene, values: Mapping[str, Floats], count: int) -> Floats:
        """Drive period (nr,) [s] of every run."""
        moving = [path for path in values if path.startswith(("gait.", "signals.")) and _is_time(path)]
        if not moving:
            return np.full(count, drive_period(scene))
        rows, which = np.unique(np.column_stack([values[path] for path in moving]), axis=0, return_inverse=True)
        known = self._kept[1]
        for row in map(tuple, rows.tolist()):
            if row not in known:
                known[row] = drive_period(with_values(scene, dict(zip(moving, row, strict=True))))
        return np.array([known[tuple(row)] for row in rows.tolist()])[which.ravel()]


def _is_time(path: str) -> bool:
    """Whether a number of a drive may change its period: what is no length of force or volts."""
    return not path.endswith((".amplitude", ".offset", ".duty", ".phase"))


def _cells(cells: CellRuns, points: Floats) -> Arrays:
    """As `CellRuns.of`, of points that one thread or process does."""
    k, names = len(points), cells.names
    codes = np.full((k, cells.starts), REFUSED, dtype=np.int16)
    code, measures = codes[:, 0].copy(), np.full((k, len(names)), np.nan)
    for numbers, settling in cells.settled(points):
        cell, start = np.divmod(numbers, cells.starts)
        own = codes_of(settling)
        codes[cell, start] = own
        each = _measures(settling)
        first = np.flatnonzero(np.diff(cell, prepend=-1))
        for a, b in zip(first.tolist(), [*first[1:].tolist(), len(cell)], strict=True):
            runs = np.arange(a, b)
            kinds, counts = np.unique(own[a:b], return_counts=True)
            code[cell[a]] = kinds[np.argmax(counts)]
            motions = motions_of(settling, runs[settling.multiple[a:b] > 0]) if cells.starts > 1 else []
            each["motions"][a:b] = len(motions)
            most = (one[0] for one in motions if own[one[0]] == code[cell[a]])
            chosen = next(most, a + int(np.argmax(own[a:b] == code[cell[a]])))
            measures[cell[a]] = [each[name][chosen] for name in names]
    return {"code": code, "codes": codes, "measures": measures}


def _measures(settling: Settling) -> dict[str, Floats]:
    """Measures (nr,) of every run, per drive period of its motion, NaN where there is none."""
    count, feet = len(settling.runs), settling.runs.plan.feet
    last = np.where(settling.multiple > 0, settling.multiple, OPEN)
    within = np.arange(KEPT) >= KEPT - last[:, None]
    total = {name: np.where(within, of, 0.0).sum(axis=1) for name, of in settling.counts.items()}
    way = np.where(within[..., None], settling.seen[..., feet], 0.0).sum(axis=(1, 2))
    impacts = total["impacts"]
    return {
        "bounces": total["bounces"] / last,
        "impacts": impacts / last,
        "touchdown_speed": np.divide(total["speed"], impacts, out=np.full(count, np.nan), where=impacts > 0.0),
        "energy": total["energy"] / last,
        "travel": way / last,
        "slip": _slips(settling) if settling.walks else np.zeros(count),
        "settled_after": np.where(settling.multiple > 0, settling.passed, np.nan),
        "motions": np.full(count, np.nan),
    }


def _slips(settling: Settling) -> Floats:
    """Way (nr,) [m] that feet slide per drive period of a settled motion; NaN of runs that have not settled."""
    out, chosen = np.full(len(settling.runs), np.nan), np.flatnonzero(settling.multiple)
    if not len(chosen):
        return out
    runs, legs = settling.runs.of_runs(chosen), settling.runs.plan.legs
    assert legs is not None
    body = legs.body
    last, periods = settling.multiple[chosen], settling.periods[chosen]
    times = [
        begin + period * np.arange(k * SLIPS + 1) / SLIPS
        for begin, period, k in zip(runs.time.tolist(), periods.tolist(), last.tolist(), strict=True)
    ]
    along = len(body.body_mass) + 2 * np.asarray(body.leg)
    for r, k, window in zip(chosen.tolist(), last.tolist(), runs.advance(times, threads=1), strict=True):
        held = window.states.held
        path = np.abs(np.diff(window.states.x[along], axis=1)) * (held[:, 1:] & held[:, :-1])
        out[r] = path.sum() / (k * len(along))
    return out
