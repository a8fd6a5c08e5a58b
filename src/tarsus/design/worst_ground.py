"""Worst grounds by cutting planes: a design is searched on a few grounds, the box is searched for the ground that hurts
it most, that ground is added, and so on until none is found that is more than 2 % worse.

After the outer approximations of semi-infinite programming (Blankenship and Falk, J. Optim. Theory Appl. 19, 1976).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from tarsus.design.over import Box
from tarsus.design.search import Archive, Budget, descend

__all__ = ["CLOSED", "Attack", "Round", "attack", "close_gap"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
D = TypeVar("D")

CLOSED = 0.02
"""The gap is closed where no ground is found that is worse by more than this share."""

Hurt = Callable[[Floats], Floats]
"""Scores (n,) of one design on grounds (n, np)."""


@dataclass(frozen=True)
class Attack:
    """What a search of the box found: its worst ground (np,) and the score there; grounds (n, np): the worst of each
    region, the worst first; tried: how many grounds were."""

    ground: Floats
    score: float
    grounds: Floats
    tried: int


def attack(
    box: Box, hurt: Hurt, count: int, rng: np.random.Generator, budget: Budget | None = None
) -> Attack:
    """Search a box for the ground that hurts a design most: an even spread of ``count``, then uphill from the worst of
    several regions."""
    budget = budget or Budget(islands=6, generations=18, offspring=8)
    cube = (box.spread(count, seed=int(rng.integers(2**31))) - box.low) / (box.high - box.low)

    def cost(_: Ints, points: Floats) -> Floats:
        return -hurt(box.at(points))

    archive = Archive.empty(len(box.paths))
    none = np.zeros(len(cube), dtype=np.int64)
    archive.add(none, cube, cost(none, cube))
    first = archive.best(budget.islands, near=0.1)
    descend(cost, archive, archive.numbers[first], archive.points[first], budget, rng, step=0.05)
    rows = archive.best(3, near=0.1)
    found = box.at(archive.points[rows])
    return Attack(found[0], -float(archive.costs[rows[0]]), found, len(archive.costs))


@dataclass(frozen=True)
class Round:
    """One round: grounds that were active, score on them, worst score found in the box."""

    grounds: int
    score: float
    worst: float

    @property
    def gap(self) -> float:
        return self.worst / max(self.score, 1e-30) - 1.0


def close_gap(
    improve: Callable[[Floats], tuple[Floats, list[D]]],
    strike: Callable[[D], Attack],
    first: Floats,
    rounds: int,
) -> tuple[D, Attack, list[Round]]:
    """Cutting planes until the gap is closed, or for so many rounds.

    Parameters
    ----------
    improve
        From active grounds (ng, np) to scores (k,) of the best designs on them, the best first, and these designs.
    strike
        From a design to the attack on it.
    first
        The grounds (ng, np) to begin with.

    Returns
    -------
    tuple
        The design with the lowest worst score that was found, the attack on it, and the rounds.
    """
    grounds, history = first, []
    best: tuple[D, Attack] | None = None
    for _ in range(rounds):
        scores, designs = improve(grounds)
        attacks = [strike(design) for design in designs]
        order = int(np.argmin([one.score for one in attacks]))
        if best is None or attacks[order].score < best[1].score:
            best = designs[order], attacks[order]
        history.append(Round(len(grounds), float(scores[order]), attacks[order].score))
        if history[-1].gap <= CLOSED and order == 0:
            break
        new = [one.grounds[:2] for one, score in zip(attacks, scores, strict=True) if one.score > score]
        if not new:
            break
        grounds = np.concatenate([grounds, *new[:2]])
    assert best is not None
    return *best, history
