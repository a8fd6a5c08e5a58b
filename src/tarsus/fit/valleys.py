"""Searching many valleys at once: evolution strategies with covariance adaptation side by side, the worse half given up
again and again; and steps by chance that get shorter, for many starts side by side.

Only a function from points to costs is known here; it is asked for many points at a time. The package cma (`cma_es`)
has one such strategy. These stay because dozens ask for one batch together here, as arrays: 24 of them take 60
generations in 0.04 s of their own, where as many of cma's take 1.7 s and as long again to load.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats, Ints
from tarsus.fit.unknowns import inside

Cost = Callable[[Ints, Floats], Floats]
"""Costs (n,) of points (n, nu) of the unit cube, each in the family of its number (n,)."""

NEAR = 0.08
"""Points nearer than this to a better one (root mean square over the unknowns) are in its valley: a plateau of a
natural period's length is then within a twelfth of it."""
POOL, FEWEST = 60, 1000
"""Valleys are looked for among so many points for each that is wanted, and at least so many: what costs more than these
is no good valley, however far from the others."""
FIRST_STEP = 0.08
"""First standard deviation of an evolution strategy: the size of such a valley."""
LAST_STEP = 3e-5
"""Strategies end below this one: 50 ns of a plateau of 1.6 ms, finer than any timer rounds."""

HALVINGS, LONGER = 6, 1.4
"""Stages after which the worse half of the strategies ends, and how much longer each is than the one before: of as many
points as equal stages cost, twice as many strategies begin. In first stages half as long good valleys are given up."""


@dataclass(frozen=True)
class Budget:
    """How long to search: generations of the last strategy, and points of each in one."""

    generations: int = 60
    offspring: int = 10


@dataclass
class Visited:
    """Every point that was asked for: families (n,), points (n, nu), costs (n,)."""

    numbers: Ints
    points: Floats
    costs: Floats

    @classmethod
    def empty(cls, unknowns: int) -> Visited:
        return cls(np.zeros(0, dtype=np.int64), np.zeros((0, unknowns)), np.zeros(0))

    def add(self, numbers: Ints, points: Floats, costs: Floats) -> None:
        self.numbers = np.concatenate([self.numbers, numbers])
        self.points = np.concatenate([self.points, points])
        self.costs = np.concatenate([self.costs, costs])

    def best(self, count: int, near: float = NEAR) -> Ints:
        """Rows of the ``count`` best points, each in a valley of its own; fewer if there are not so many."""
        chosen: list[int] = []
        left = np.argsort(self.costs, kind="stable")[: max(POOL * count, FEWEST)]
        while len(left) and len(chosen) < count:
            row = int(left[0])
            chosen.append(row)
            apart = ((self.points[left] - self.points[row]) ** 2).sum(axis=1) > near**2 * self.points.shape[1]
            left = left[apart | (self.numbers[left] != self.numbers[row])]
        return np.array(chosen, dtype=np.int64)


def apart(points: Floats, order: Ints, near: float, count: int) -> Ints:
    """The first rows in an order, at most so many, of points (n, nu) of which each is farther than ``near`` in some
    coordinate from all rows before it."""
    chosen: list[int] = []
    for row in order.tolist():
        if len(chosen) == count:
            break
        if all(np.abs(points[row] - points[one]).max() > near for one in chosen):
            chosen.append(row)
    return np.array(chosen, dtype=np.int64)


def shorter_steps(
    cost: Callable[[Floats], Floats],
    points: Floats,
    costs: Floats,
    steps: Sequence[float],
    tried: int,
    rng: np.random.Generator,
    circular: NDArray[np.bool_] | bool = False,
) -> tuple[Floats, Floats]:
    """Local searches from points (k, nu) of costs (k,), side by side: in each of some steps, given by their standard
    deviations, so many points about every best one so far are tried.

    ``cost`` takes points (k, tried, nu) to costs (k, tried). Returns the best points and their costs.
    """
    points, costs, rows = points.copy(), costs.copy(), np.arange(len(points))
    for step in steps:
        around = np.repeat(points[:, None], tried, axis=1)
        moved = inside(around + step * rng.standard_normal(around.shape), circular)
        found = cost(moved)
        at = found.argmin(axis=1)
        better = found[rows, at] < costs
        points[better], costs[better] = moved[rows, at][better], found[rows, at][better]
    return points, costs


def follow_down(
    cost: Cost,
    archive: Visited,
    numbers: Ints,
    starts: Floats,
    budget: Budget,
    rng: np.random.Generator,
    step: float = FIRST_STEP,
) -> None:
    """Evolution strategies with covariance adaptation from the starts (k, nu), side by side; in `HALVINGS` stages, each
    longer than the one before, the worse half of them ends. All points go into the archive."""
    islands = _Islands(numbers, starts, step, budget.offspring)
    ends = np.rint(budget.generations * (LONGER ** np.arange(1, HALVINGS + 1) - 1.0) / (LONGER**HALVINGS - 1.0))
    for generation in range(budget.generations):
        points = islands.ask(rng)
        flat = points.reshape(-1, points.shape[-1])
        asked = np.repeat(islands.numbers, points.shape[1])
        costs = cost(asked, np.clip(flat, 0.0, 1.0))
        archive.add(asked, np.clip(flat, 0.0, 1.0), costs)
        islands.tell(points, costs.reshape(points.shape[:2]))
        if generation + 1 in ends and len(islands.numbers) > 1:
            islands.keep(np.argsort(islands.best, kind="stable")[: (len(islands.numbers) + 1) // 2])
        if np.all(islands.step < LAST_STEP):
            break


class _Islands:
    """k strategies (mu/mu_w, lambda) with their means (k, nu), steps (k,) and covariances (k, nu, nu); after Hansen,
    The CMA evolution strategy: a tutorial (2016), with its default constants."""

    def __init__(self, numbers: Ints, means: Floats, step: float, offspring: int) -> None:
        k, n = means.shape
        self.numbers, self.mean, self.step = numbers, means.copy(), np.full(k, step)
        self.shape = np.tile(np.eye(n), (k, 1, 1))
        self.path, self.step_path = np.zeros((k, n)), np.zeros((k, n))
        self.best = np.full(k, np.inf)
        self.offspring = max(offspring, 4 + int(3 * np.log(max(n, 1))))
        mu = self.offspring // 2
        weights = np.log(mu + 0.5) - np.log(np.arange(1, mu + 1))
        self.weights = weights / weights.sum()
        self.mass = 1.0 / float((self.weights**2).sum())
        m = self.mass
        self.c_step = (m + 2.0) / (n + m + 5.0)
        self.damp = 1.0 + 2.0 * max(0.0, np.sqrt((m - 1.0) / (n + 1.0)) - 1.0) + self.c_step
        self.c_path = (4.0 + m / n) / (n + 4.0 + 2.0 * m / n)
        self.c_one = 2.0 / ((n + 1.3) ** 2 + m)
        self.c_mu = min(1.0 - self.c_one, 2.0 * (m - 2.0 + 1.0 / m) / ((n + 2.0) ** 2 + m))
        self.chi = np.sqrt(n) * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n))
        self.round = 0

    def ask(self, rng: np.random.Generator) -> Floats:
        """Points (k, lambda, nu), reflected into the unit cube."""
        k, n = self.mean.shape
        values, self._vectors = np.linalg.eigh(self.shape)
        self._roots = np.sqrt(np.maximum(values, 1e-20))
        drawn = rng.standard_normal((k, self.offspring, n))
        moved = np.einsum("kij,kj,klj->kli", self._vectors, self._roots, drawn)
        points = self.mean[:, None] + self.step[:, None, None] * moved
        points = np.abs(points)
        return np.where(points > 1.0, np.abs(2.0 - points), points)  # as they were drawn, but for the sides

    def tell(self, points: Floats, costs: Floats) -> None:
        """The points' costs (k, lambda)."""
        self.round += 1
        n = self.mean.shape[1]
        order = np.argsort(costs, axis=1, kind="stable")[:, : len(self.weights)]
        chosen = np.take_along_axis(points, order[:, :, None], axis=1)
        moves = (chosen - self.mean[:, None]) / self.step[:, None, None]
        mean_move = np.einsum("m,kmi->ki", self.weights, moves)
        self.mean = self.mean + self.step[:, None] * mean_move
        white = self._whitened(mean_move)
        c = self.c_step
        self.step_path = (1.0 - c) * self.step_path + np.sqrt(c * (2.0 - c) * self.mass) * white
        length = np.linalg.norm(self.step_path, axis=1)
        calm = length / np.sqrt(1.0 - (1.0 - c) ** (2 * self.round)) < (1.4 + 2.0 / (n + 1.0)) * self.chi
        c = self.c_path
        self.path = (1.0 - c) * self.path + (calm * np.sqrt(c * (2.0 - c) * self.mass))[:, None] * mean_move
        old = 1.0 - self.c_one - self.c_mu + (~calm) * self.c_one * c * (2.0 - c)
        self.shape = (
            old[:, None, None] * self.shape
            + self.c_one * np.einsum("ki,kj->kij", self.path, self.path)
            + self.c_mu * np.einsum("m,kmi,kmj->kij", self.weights, moves, moves)
        )
        self.step = self.step * np.exp(np.minimum(self.c_step / self.damp * (length / self.chi - 1.0), 1.0))
        self.step = np.clip(self.step, 1e-9, 0.3)
        self.best = np.minimum(self.best, costs.min(axis=1))

    def _whitened(self, move: Floats) -> Floats:
        """C^-1/2 times moves (k, nu)."""
        inner = np.einsum("kji,kj->ki", self._vectors, move) / self._roots
        return np.einsum("kij,kj->ki", self._vectors, inner)

    def keep(self, rows: Ints) -> None:
        """Go on with these only."""
        for name in ("numbers", "mean", "step", "shape", "path", "step_path", "best"):
            setattr(self, name, getattr(self, name)[rows])
