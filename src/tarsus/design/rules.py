"""Rules from what a robot senses to what it does: a few comparisons, which a microcontroller makes in no time.

A rule is a binary tree (Breiman et al., Classification and Regression Trees, 1984), grown not to tell classes apart
but to lose as little as possible: what a leaf costs is what its one action costs on all that comes to it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Rule", "grown"]

Floats = NDArray[np.float64]

QUANTILES = 15
"""Thresholds tried between the values of each sense."""
SMALLEST = 0.05
"""Share of what a rule is grown on that must come to every leaf: fewer tell chance."""
WORTH = 0.002
"""Share of the mean cost that a split must save."""


@dataclass(frozen=True)
class Rule:
    """Do ``action``; or, with a threshold, ask ``below`` where the sense of that number is below it, else
    ``above``."""

    action: int
    sense: int = 0
    threshold: float = np.nan
    below: Rule | None = None
    above: Rule | None = None

    def __call__(self, senses: Floats) -> NDArray[np.int64]:
        """Actions (n,) for senses (n, ns)."""
        if self.below is None or self.above is None:
            return np.full(len(senses), self.action)
        small = senses[:, self.sense] < self.threshold
        return np.where(small, self.below(senses), self.above(senses))

    def lines(self, names: Sequence[str], said: tuple[str, ...] = ()) -> list[tuple[str, int]]:
        """Conditions in words with the action of each."""
        if self.below is None or self.above is None:
            return [(" and ".join(said) or "always", self.action)]
        name, at = names[self.sense], f"{self.threshold:.4g}"
        return [
            *self.below.lines(names, (*said, f"{name} < {at}")), *self.above.lines(names, (*said, f"{name} >= {at}"))
        ]  # fmt: skip

    @property
    def leaves(self) -> int:
        """Number of conditions."""
        return 1 if self.below is None or self.above is None else self.below.leaves + self.above.leaves


def grown(senses: Floats, costs: Floats, depth: int) -> Rule:
    """The rule of at most ``depth`` comparisons one after the other that costs least.

    Parameters
    ----------
    senses
        What is sensed (n, ns).
    costs
        What each action would cost there (n, na).
    """
    return _grow(
        senses,
        costs,
        depth,
        max(int(SMALLEST * len(costs)), 1),
        WORTH * len(costs) * float(np.abs(costs.min(axis=1)).mean()),
    )


def _grow(senses: Floats, costs: Floats, depth: int, smallest: int, worth: float) -> Rule:
    total = costs.sum(axis=0)
    leaf = Rule(int(np.argmin(total)))
    if depth == 0 or len(costs) < 2 * smallest:
        return leaf
    best: tuple[float, int, float] | None = None
    for sense in range(senses.shape[1]):
        own = senses[:, sense]
        for threshold in np.unique(np.quantile(own, np.linspace(0.0, 1.0, QUANTILES + 2)[1:-1])):
            small = own < threshold
            if min(small.sum(), (~small).sum()) < smallest:
                continue
            cost = float(costs[small].sum(axis=0).min() + costs[~small].sum(axis=0).min())
            if best is None or cost < best[0]:
                best = cost, sense, float(threshold)
    if best is None:
        return leaf
    _, sense, threshold = best
    small = senses[:, sense] < threshold
    below = _grow(senses[small], costs[small], depth - 1, smallest, worth)
    above = _grow(senses[~small], costs[~small], depth - 1, smallest, worth)
    rule = Rule(leaf.action, sense, threshold, below, above)
    rows = np.arange(len(costs))
    saved = float(total.min() - costs[rows, rule(senses)].sum())
    return rule if saved > worth else leaf
