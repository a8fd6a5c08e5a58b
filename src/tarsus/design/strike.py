"""The grounds of a box that hurt gaits most: an even spread for all of them together, then uphill from the worst."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import beta

from tarsus.design.kept import Kept
from tarsus.design.over import Box

__all__ = ["Certificate", "Strike", "strike"]

Floats = NDArray[np.float64]

FIRST_STEP, SHRINK = 0.1, 0.6
"""Steps uphill: at first a tenth of the box's sides, then by this factor shorter; after eight times below 0.2 %."""
YOUNG = 6
"""Grounds tried about the worst one in every step uphill."""


@dataclass(frozen=True)
class Strike:
    """What was found of k gaits: costs (k, no), the worst of each objective, and the grounds (k, no, np) they are on;
    tried: how many grounds each gait was put on; first (k, ng, no): costs on the grounds before the climb."""

    costs: Floats
    grounds: Floats
    tried: int
    first: Floats


@dataclass(frozen=True)
class Certificate:
    """A look at a box after everything else: grounds drawn by chance that a gait was put on, and those of them that
    were worse than its known worst by more than is allowed (of the gait that had most)."""

    grounds: int
    worse: int

    @property
    def share(self) -> float:
        """Upper end of the 95 % interval of the box's share that is so much worse (Clopper and Pearson 1934): about
        3 / grounds where none was."""
        return float(beta.ppf(0.95, self.worse + 1, self.grounds - self.worse)) if self.worse < self.grounds else 1.0


def strike(
    kept: Kept,
    points: Floats,
    box: Box,
    count: int,
    steps: int,
    seed: int,
    *,
    islands: int = 1,
    by_chance: bool = False,
) -> Strike:
    """Search a box for the worst grounds of gaits at points (k, nu): on ``count`` grounds, the same for all, then in
    ``steps`` uphill from the worst of each in ``islands`` regions. The grounds are corners and an even spread, or
    drawn by chance alone."""
    rng = np.random.default_rng([seed, 31])
    if by_chance:
        cube = rng.random((count, len(box.paths)))
    else:
        spread = np.concatenate([box.first(), box.spread(count, seed=int(rng.integers(2**31)))])
        cube = (spread - box.low) / (box.high - box.low)
    k, ng, nb = len(points), len(cube), len(box.paths)
    first = _each(kept, box, np.repeat(points, ng, axis=0), np.tile(cube, (k, 1))).reshape(k, ng, -1)
    no = first.shape[2]
    worst, where = first.max(axis=1), cube[first.argmax(axis=1)]  # (k, no), (k, no, np)
    moving = [j for j in range(no) if kept.walks.objectives[j].grounded]
    starts = [[_apart(first[i, :, j], cube, islands) for j in moving] for i in range(k)]
    peaks = cube[np.array(starts, dtype=np.int64).reshape(k, len(moving), islands)]
    tops = np.full(peaks.shape[:3], -np.inf)
    step, rows = FIRST_STEP, np.arange(k)
    for _ in range(steps if moving else 0):
        peaks[:, :, 0] = where[:, moving]  # one climbs from the worst of all, whoever found it
        moved = peaks[:, :, :, None] + step * rng.standard_normal((k, len(moving), islands, YOUNG, nb))
        moved = np.abs(moved)
        moved = np.clip(np.where(moved > 1.0, 2.0 - moved, moved), 0.0, 1.0)
        who = np.repeat(rows, len(moving) * islands * YOUNG)
        costs = _each(kept, box, points[who], moved.reshape(-1, nb)).reshape(*moved.shape[:4], no)
        for m, j in enumerate(moving):
            own = costs[:, m, :, :, j]
            best = own.argmax(axis=2)[:, :, None]
            higher = np.take_along_axis(own, best, axis=2)[:, :, 0]
            at = np.take_along_axis(moved[:, m], best[..., None], axis=2)[:, :, 0]
            better = higher > tops[:, m]
            peaks[:, m], tops[:, m] = np.where(better[..., None], at, peaks[:, m]), np.maximum(higher, tops[:, m])
            every, flat = costs.reshape(k, -1, no)[:, :, j], moved.reshape(k, -1, nb)
            most = every.argmax(axis=1)
            worse = every[rows, most] > worst[:, j]
            worst[worse, j], where[worse, j] = every[rows, most][worse], flat[rows, most][worse]
        step *= SHRINK
    tried = ng + steps * len(moving) * islands * YOUNG
    return Strike(worst, box.at(where.reshape(-1, nb)).reshape(k, no, nb), tried, first)


def _apart(costs: Floats, cube: Floats, count: int) -> list[int]:
    """Numbers of the worst of grounds (ng, np) by costs (ng,), each a step from the others; the worst again where there
    are fewer."""
    chosen: list[int] = []
    for row in np.argsort(-np.nan_to_num(costs, nan=-np.inf), kind="stable"):
        if all(np.abs(cube[row] - cube[one]).max() > FIRST_STEP for one in chosen):
            chosen.append(int(row))
        if len(chosen) == count:
            break
    return chosen + chosen[:1] * (count - len(chosen))


def _each(kept: Kept, box: Box, points: Floats, cube: Floats) -> Floats:
    values = box.at(cube)
    return kept.each(points, {path: np.ascontiguousarray(values[:, i]) for i, path in enumerate(box.paths)})
