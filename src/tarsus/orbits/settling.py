"""Runs that go on until they repeat: seen at eight phases of every drive period, each as long as it takes.

A run has settled with multiple k where its last max(2 k, 4) periods equal those k before to `SETTLED` of the motion's
size: gaps, what a walker gets on, and velocities in the metric of the kinetic energy, M = L L^T, u = L^T v.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tarsus.base.workers import Workers
from tarsus.measure.counts import COUNTS
from tarsus.solve import Trajectories, Window

Floats = NDArray[np.float64]

PHASES = 8
"""Phases of a drive period at which a motion is seen, none at a half, a quarter or an eighth of it, where drives have
their edges."""
MOST_MULTIPLE = 16
"""Largest multiple of the drive period that is distinguished from none."""
KEPT = 3 * MOST_MULTIPLE
"""Drive periods that are compared: the last two of the longest multiple and the one before them."""
ROUND = 8
"""Drive periods between two looks."""
SETTLED = 1e-6
"""Difference, of the motion's size, below which periods are equal: a hundred times what a step's error is of it."""
ALIKE = 1e-3
"""Difference, of the motion's size, below which two settled motions are one: what is left of a multiplier of 0.999 when
periods are equal to `SETTLED`."""
TWIN = 1e-9
"""Difference of twins at first, of the size of the velocities."""
TWINS = 96
"""Drive periods after which twins are compared: a growth of 1.25 a period makes 1e-9 a difference of 1."""


@dataclass
class Settling:
    """Runs on their way: period [s] of the drive, of all or of each (nr,); offset (nr,) [s]: when each one's drive
    begins a period; walks: whether coordinate 0 is the way.

    passed (nr,): drive periods behind; seen (nr, KEPT, PHASES, m + n + 1): gaps, progress along the way and u of the
    last ones; counts (nr, KEPT) by name in `COUNTS`: number of impacts, energy lost in them [J], sum of their approach
    speeds [m/s], numbers of bounces, captures and rests; multiple (nr,): 0 of runs that have not settled.
    """

    runs: Trajectories
    period: float | Floats
    offset: Floats
    walks: bool
    threads: Workers = None
    passed: NDArray[np.intp] = field(init=False)
    seen: Floats = field(init=False)
    counts: dict[str, Floats] = field(init=False)
    multiple: NDArray[np.intp] = field(init=False)

    def __post_init__(self) -> None:
        count, n, m = len(self.runs), len(self.runs.plan.system.mass), self.runs.plan.feet
        self.passed, self.multiple = np.zeros((2, count), dtype=np.intp)
        self.seen = np.full((count, KEPT, PHASES, m + n + 1), np.nan)
        self.counts = {name: np.zeros((count, KEPT)) for name in COUNTS}
        self.periods = np.broadcast_to(np.asarray(self.period, dtype=float), count)
        self._way = self.runs.state[:, 0].copy()
        self._root = np.linalg.cholesky(np.asarray(self.runs.plan.system.mass, dtype=float))

    def settle(self, most: int, progress: Callable[[int, int, str], None] | None = None) -> None:
        """Let every run go on until it repeats, or for so many drive periods."""
        while len(going := np.flatnonzero((self.multiple == 0) & (self.passed < most) & self.runs.done)):
            self.go(going)
            for r in going.tolist():
                self.multiple[r] = self._multiple(r)
            if progress is not None:
                settled = int((self.multiple > 0).sum())
                progress(settled, len(self.runs), f"starts that have settled after {int(self.passed.max())} periods")

    def go(self, chosen: NDArray[np.intp]) -> None:
        """Let some runs go on for `ROUND` periods."""
        phases = (np.arange(ROUND * PHASES) + 0.5) / PHASES
        times = [self.offset[r] + self.periods[r] * (self.passed[r] + phases) for r in chosen.tolist()]
        for r, window in zip(chosen.tolist(), self.runs.advance(times, chosen, self.threads), strict=True):
            if self.runs.done[r]:
                self._note(r, window)

    def _note(self, r: int, window: Window) -> None:
        states = window.states
        way = states.x[0] if self.walks else np.zeros(len(window.times))
        progress = np.diff(way, prepend=self._way[r] if self.walks else 0.0)
        self._way[r] = way[-1]
        rows = np.concatenate([states.gap, progress[None], self._root.T @ states.v]).T
        self.seen[r] = np.concatenate([self.seen[r, ROUND:], rows.reshape(ROUND, PHASES, -1)])
        events = window.events
        number = (events["time"] - self.offset[r]) / self.periods[r] - self.passed[r] + 0.5 / PHASES
        number = np.clip(number.astype(int), 0, ROUND - 1)
        for name, of in self.counts.items():
            of[r] = np.append(of[r, ROUND:], COUNTS[name].of(events, number, ROUND))
        self.passed[r] += ROUND

    def sizes(self, r: int) -> Floats:
        """Sizes (m + n + 1,) of a run's numbers: of its lengths and of its velocities u."""
        m, plan = self.runs.plan.feet, self.runs.plan
        place = max(plan.length, float(np.nanmax(np.abs(self.seen[r, ..., :m]), initial=0.0)))
        floor = place / self.periods[r] * float(np.sqrt(np.diag(plan.system.mass).mean()))
        speed = max(floor, float(np.nanmax(np.abs(self.seen[r, ..., m + 1 :]))))
        return np.repeat([place, speed], [m + 1, self.seen.shape[-1] - m - 1])

    def _multiple(self, r: int) -> int:
        """The smallest multiple with which a run repeats; 0 without one, and where it still closes in on a motion of a
        smaller one: near a flip every other period is equal long before every one is."""
        seen = self.seen[r] / self.sizes(r)

        def apart(k: int) -> float:
            last = max(2 * k, 4)
            return float(np.abs(seen[-last:] - seen[-last - k : -k]).max())

        k = next((k for k in range(1, MOST_MULTIPLE + 1) if apart(k) <= SETTLED), 0)
        return 0 if any(k % j == 0 and apart(j) <= ALIKE for j in range(1, k)) else k

    def alike(self, r: int, other: Settling, q: int) -> bool:
        """Whether a settled run and one of others', or of these, are one motion, whichever period it begins with."""
        k = int(self.multiple[r])
        if k == 0 or k != other.multiple[q]:
            return False
        size = np.maximum(self.sizes(r), other.sizes(q))
        own, its = self.seen[r, -k:] / size, other.seen[q, -k:] / size
        return any(bool(np.abs(own - np.roll(its, j, axis=0)).max() <= ALIKE) for j in range(k))

    def chaotic(self, chosen: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Of runs that have not settled, which part from a twin that differs by `TWIN`."""
        if not len(chosen):
            return np.zeros(0, dtype=bool)
        pair = np.concatenate([chosen, chosen])
        both = Settling(self.runs.of_runs(pair), self.periods[pair], self.offset[pair], self.walks, self.threads)
        both.passed[:] = self.passed[pair]
        for i in range(len(chosen)):
            both.runs.state[i] += self._perturbation(int(chosen[i]))
        for _ in range(TWINS // ROUND):
            both.go(np.flatnonzero(both.runs.done))
        half = len(chosen)
        apart = [np.abs((both.seen[i] - both.seen[half + i]) / both.sizes(i)).max() for i in range(half)]
        return np.array(apart) > ALIKE

    def _perturbation(self, r: int) -> Floats:
        """A small velocity (2n,) that leaves feet on the ground alone: of a walker's body, which no foot fixes."""
        plan, n = self.runs.plan, len(self.runs.plan.system.mass)
        held = np.asarray(plan.system.normals, dtype=float)[:, self.runs.held[r]].T
        way = np.ones(n)
        if plan.legs is not None:
            way[len(plan.legs.body.body_mass) :] = 0.0
        way -= np.linalg.pinv(held) @ (held @ way) if len(held) else 0.0
        size = self.sizes(r)[-1] / float(np.sqrt(np.diag(plan.system.mass).mean()))
        return np.concatenate([np.zeros(n), TWIN * size * way])
