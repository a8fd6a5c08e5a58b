"""The grounds of a box that hurt gaits most: an even spread for all of them together, then uphill from the worst."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.design.kept import Kept
from tarsus.design.over import Box

__all__ = ["Strike", "strike"]

Floats = NDArray[np.float64]

FIRST_STEP, SHRINK = 0.1, 0.6
"""Steps uphill: at first a tenth of the box's sides, then by this factor shorter; after eight times below 0.2 %."""
YOUNG = 6
"""Grounds tried about the worst one in every step uphill."""


@dataclass(frozen=True)
class Strike:
    """What was found of k gaits: costs (k, no), the worst of each objective, and the grounds (k, no, np) they are on;
    tried: how many grounds each gait was put on."""

    costs: Floats
    grounds: Floats
    tried: int


def strike(kept: Kept, points: Floats, box: Box, count: int, steps: int, seed: int) -> Strike:
    """Search a box for the worst grounds of gaits at points (k, nu): on ``count`` grounds spread evenly and the
    corners, the same for all, then in ``steps`` uphill from the worst of each."""
    rng = np.random.default_rng([seed, 31])
    spread = np.concatenate([box.first(), box.spread(count, seed=int(rng.integers(2**31)))])
    cube = (spread - box.low) / (box.high - box.low)
    k, ng, nb = len(points), len(cube), len(box.paths)
    found = _each(kept, box, np.repeat(points, ng, axis=0), np.tile(cube, (k, 1))).reshape(k, ng, -1)
    no = found.shape[2]
    at = found.argmax(axis=1)
    worst, where = found.max(axis=1), cube[at]  # (k, no), (k, no, np)
    moving = [j for j in range(no) if kept.walks.objectives[j].grounded]
    step = FIRST_STEP
    for _ in range(steps if moving else 0):
        centre = where[:, moving][:, :, None, :]
        moved = centre + step * rng.standard_normal((k, len(moving), YOUNG, nb))
        moved = np.abs(moved)
        moved = np.clip(np.where(moved > 1.0, 2.0 - moved, moved), 0.0, 1.0)
        who = np.repeat(np.arange(k), len(moving) * YOUNG)
        costs = _each(kept, box, points[who], moved.reshape(-1, nb)).reshape(k, -1, no)
        flat = moved.reshape(k, -1, nb)
        for j in moving:
            best = costs[:, :, j].argmax(axis=1)
            rows = np.arange(k)
            higher = costs[rows, best, j] > worst[:, j]
            worst[higher, j] = costs[rows, best, j][higher]
            where[higher, j] = flat[rows, best][higher]
        step *= SHRINK
    return Strike(worst, box.at(where.reshape(-1, nb)).reshape(k, no, nb), ng + steps * len(moving) * YOUNG)


def _each(kept: Kept, box: Box, points: Floats, cube: Floats) -> Floats:
    values = box.at(cube)
    return kept.each(points, {path: np.ascontiguousarray(values[:, i]) for i, path in enumerate(box.paths)})
