"""Fronts: what no other point beats in every cost at once, how much of the space they dominate, and a search for
them.

The search is that of NSGA-II (Deb et al., IEEE Trans. Evol. Comput. 6, 2002): non-dominated sorting with crowding
distance, here with the differences of differential evolution and steps of random length as variation, so that there
is nothing to tune. Only a function from points to costs is known here; it is asked for many points at a time.

pymoo has the same search and more. On three known fronts of 3,000 candidates its own dominates 1.5 to 67 % more than
this one; of gaits it finds 1.5 to 11 % faster ones with 256 candidates, and 11 to 24 % slower ones with the 64 that a
round may have. So this one stays: unknowns whose range closes on itself (phases) move around the circle, and every
point that was asked for is returned.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats, Ints
from tarsus.fit.unknowns import even_points, inside

Costs = Callable[[Floats], Floats]
"""Costs (n, no) of points (n, nu) of the unit cube, the least the best."""

SHORTEST, LONGEST = 1e-4, 0.3
"""Steps about a member of the front, uniform in their logarithm: from what no timer resolves to a third of a range."""


@dataclass(frozen=True)
class FrontSearch:
    """How long to search. scan: points spread evenly at first; population; generations of as many points each."""

    scan: int = 1024
    population: int = 96
    generations: int = 60

    @property
    def candidates(self) -> int:
        """Points asked for in all."""
        return self.scan + self.population * self.generations


def undominated(costs: Floats) -> NDArray[np.bool_]:
    """Which of costs (n, no) no other one is at most as large as in all; of equal ones the first."""
    order = np.lexsort(costs.T[::-1])
    found = np.zeros(len(costs), dtype=bool)
    kept = np.zeros((0, costs.shape[1]))
    for row in order:
        one = costs[row]
        if np.isfinite(one).all() and not (kept <= one).all(axis=1).any():
            kept = np.vstack([kept, one])
            found[row] = True
    return found


def hypervolume(costs: Floats, reference: Floats) -> float:
    """Volume between costs (n, no) and a reference (no,) that is worse than they are; what is not better than it in
    all counts nothing."""
    inside = costs[(costs < reference).all(axis=1)]
    if not len(inside):
        return 0.0
    if costs.shape[1] == 1:
        return float(reference[0] - inside[:, 0].min())
    inside = inside[np.argsort(inside[:, -1], kind="stable")]
    ends = np.append(inside[1:, -1], reference[-1])
    return float(
        sum(
            hypervolume(inside[: i + 1, :-1], reference[:-1]) * (ends[i] - inside[i, -1])
            for i in range(len(inside))
            if ends[i] > inside[i, -1]
        )
    )


def ranks(costs: Floats) -> Ints:
    """Number (n,) of the front that each of costs (n, no) is on, 0 the best; costs that are not finite are on the
    last."""
    found = np.full(len(costs), -1)
    finite = np.asarray(np.isfinite(costs).all(axis=1))
    beats = np.asarray((costs[:, None] <= costs[None]).all(axis=2) & (costs[:, None] < costs[None]).any(axis=2))
    left, rank = finite.copy(), 0
    while left.any():
        best = left & ~np.asarray(beats[left].any(axis=0))
        found[best], rank = rank, rank + 1
        left &= ~best
    found[found < 0] = rank
    return found


def crowding(costs: Floats) -> Floats:
    """How far (n,) the neighbours of each of costs (n, no) on one front are apart; infinite at its ends."""
    apart = np.zeros(len(costs))
    for column in costs.T:
        order = np.argsort(column, kind="stable")
        low, high = float(column[order[0]]), float(column[order[-1]])
        span = high - low if np.isfinite((low, high)).all() else 0.0
        apart[order[[0, -1]]] = np.inf
        if span > 0.0:
            apart[order[1:-1]] += (column[order[2:]] - column[order[:-2]]) / span
    return apart


def farthest(points: Floats, around: NDArray[np.bool_] | bool, count: int) -> Ints:
    """Rows of at most ``count`` distinct points (n, nu) of the unit cube, each the farthest from those before it, from
    the first one on. around (nu,): whether the range of an unknown closes on itself."""
    chosen: list[int] = []
    far = np.full(len(points), np.inf)
    while len(chosen) < count and far.any():
        chosen.append(int(np.argmax(far)))
        apart = np.abs(points - points[chosen[-1]])
        far = np.minimum(far, (np.where(around, np.minimum(apart, 1.0 - apart), apart) ** 2).sum(axis=1))
    return np.array(chosen, dtype=np.int64)


def search_front(
    costs: Costs, unknowns: int, around: NDArray[np.bool_], search: FrontSearch, seed: int, starts: Floats | None = None
) -> tuple[Floats, Floats]:
    """Search for the front of costs.

    Parameters
    ----------
    costs
        See `Costs`; asked for whole generations.
    unknowns, around
        Number of them nu, and whether (nu,) the range of each closes on itself.
    search
        How long.
    seed
        Of all that is random here.
    starts
        Points (ns, nu) to begin with besides the even spread.

    Returns
    -------
    tuple
        Every point (n, nu) that was asked for, and its costs (n, no).
    """
    rng = np.random.default_rng([seed, 21])
    first = even_points(unknowns, search.scan, rng)
    points = first if starts is None or not len(starts) else np.concatenate([starts, first])
    found = costs(points)
    every, values = [points], [found]
    living = _survivors(found, search.population)
    points, found = points[living], found[living]
    for _ in range(search.generations):
        young = _young(points, found, around, search.population, rng)
        scored = costs(young)
        every.append(young)
        values.append(scored)
        points, found = np.concatenate([points, young]), np.concatenate([found, scored])
        living = _survivors(found, search.population)
        points, found = points[living], found[living]
    return np.concatenate(every), np.concatenate(values)


def _survivors(costs: Floats, count: int) -> Ints:
    """Rows of the best: by front, and on the last one that has room those farthest from their neighbours; of equal
    ones only the first."""
    _, distinct = np.unique(costs, axis=0, return_index=True)
    rows = np.sort(distinct)
    if len(rows) > 6 * count:  # sorting is quadratic: what the best of each cost leave far behind never lives
        worse = np.argsort(np.argsort(costs[rows], axis=0), axis=0).min(axis=1)
        fronts = undominated(costs[rows])
        rows = rows[fronts | (worse < 3 * count)]
    number = ranks(costs[rows])
    kept: list[int] = []
    for rank in range(int(number.max()) + 1):
        own = rows[number == rank]
        room = count - len(kept)
        if len(own) > room:
            own = own[np.argsort(-crowding(costs[own]), kind="stable")[:room]]
        kept += own.tolist()
        if len(kept) >= count:
            break
    return np.array(kept, dtype=np.int64)


def _young(points: Floats, costs: Floats, around: NDArray[np.bool_], count: int, rng: np.random.Generator) -> Floats:
    """New points (count, nu): half by differences of others, half by steps of random length from a parent."""
    n, nu = points.shape
    number = ranks(costs)
    apart = np.zeros(n)
    for rank in np.unique(number):
        apart[number == rank] = crowding(costs[number == rank])
    pairs = rng.integers(0, n, (count, 2))
    one, other = pairs.T
    better = (number[one] < number[other]) | ((number[one] == number[other]) & (apart[one] >= apart[other]))
    parent = np.where(better, one, other)
    others = rng.integers(0, n, (count, 3))
    factor = rng.uniform(0.3, 0.9, (count, 1))
    mixed = points[parent] + factor * (points[others[:, 0]] - points[others[:, 1]])
    size = np.exp(rng.uniform(np.log(SHORTEST), np.log(LONGEST), (count, 1)))
    moved = points[parent] + size * rng.standard_normal((count, nu))
    taken = rng.random((count, nu)) < rng.uniform(0.3, 1.0, (count, 1))
    taken[np.arange(count), rng.integers(0, nu, count)] = True
    fresh = np.where((rng.random(count) < 0.5)[:, None], mixed, moved)
    return inside(np.where(taken, fresh, points[parent]), around)
