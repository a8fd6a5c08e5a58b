"""What a robot's first steps tell of its ground, and the gait that is best by it in expectation.

The robot carries a table: of grounds that were simulated, what its probes sense there and what every gait costs there.
What it senses weighs these grounds by Bayes' rule (all alike before, readings normal about the table's), and it takes
the gait whose expected cost under these weights is least. That is kernel regression of costs on readings (Nadaraya,
Theory Probab. Appl. 9, 1964) in which the width says how far the table's grounds are apart.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

WIDTHS = (0.35, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0)
"""Widths tried, in standard deviations of a reading: below the first a table of some hundred grounds has but one that
is near; beyond the last all are."""
SURE = 2.0
"""Standard errors by which probes must save more than one gait for all grounds: of so many that are tried the best
saves one of them by chance."""


@dataclass(frozen=True)
class GaitChoice:
    """The table. readings (ng, nf): of the probes on each of its grounds, one after the other; costs (ng, k): of each
    gait there; deviations (nf,): of a reading: what weighs a ground half a logarithm less. Without readings the gait
    that is best on the mean is always chosen."""

    readings: Floats
    costs: Floats
    deviations: Floats

    def expected(self, sensed: Floats) -> Floats:
        """Costs (n, k) that are to be expected where readings (n, nf) were sensed."""
        return _expected(_apart(sensed, self.readings, self.deviations), self.costs)

    def __call__(self, sensed: Floats) -> Ints:
        """Numbers (n,) of the gaits that are best by readings (n, nf)."""
        return self.expected(sensed).argmin(axis=1)

    @property
    def shares(self) -> Floats:
        """Share (k,) of the table's grounds on which each gait would be chosen, were its own readings sensed."""
        return np.bincount(self(self.readings), minlength=self.costs.shape[1]) / len(self.costs)


def gait_choice(
    table: Floats, again: Floats, noise: Floats, costs: Floats, most: int
) -> tuple[tuple[int, ...], GaitChoice]:
    """The probes that are worth walking, and the table.

    Probes are added one after the other, each the one with which least is lost on the table's grounds by what is sensed
    in other walks there, each ground judged by all the others; with the width that loses least. Where that saves no
    more than chance nothing is asked.

    Parameters
    ----------
    table, again
        What is sensed (np, ng, ns) by each of np gaits on each ground, in two sets of walks, without noise.
    noise
        As ``again``, with the noise of the senses.
    costs
        Of each gait there (ng, k).
    most
        Probes at most.

    Returns
    -------
    tuple
        Numbers of the probes, in order, and the table of what they sense.
    """
    fixed = costs[:, int(np.argmin(costs.mean(axis=0)))]
    none = GaitChoice(np.zeros((len(costs), 0)), costs, np.zeros(0))
    deviations = np.sqrt((0.5 * (table - again) ** 2 + (noise - again) ** 2).mean(axis=1)) if table.size else table
    scale = np.abs(table).max(axis=1) if table.size else table
    deviations = np.maximum(deviations, 1e-6 * scale)  # a sense that never scatters still compares
    apart = [_apart(sensed, known, own) for sensed, known, own in zip(noise, table, deviations, strict=True)]
    chosen: list[int] = []
    best, lost, width = list(chosen), fixed, 1.0
    total = np.where(np.eye(len(costs), dtype=bool), np.inf, 0.0)  # a ground's own readings are left out
    while len(chosen) < min(most, len(apart)):
        tried = [
            (_lost((total + one) / w**2, costs), number, w)
            for number, one in enumerate(apart)
            for w in WIDTHS
            if number not in chosen
        ]
        found, number, w = min(tried, key=lambda one: float(one[0].mean()))
        chosen.append(number)
        total = total + apart[number]
        if found.mean() < lost.mean():
            best, lost, width = list(chosen), found, w
    saved = fixed - lost
    if not saved.mean() > SURE * saved.std() / np.sqrt(len(saved)):
        return (), none
    readings = np.concatenate([table[one] for one in best], axis=1)
    return tuple(best), GaitChoice(readings, costs, width * np.concatenate([deviations[one] for one in best]))


def _apart(sensed: Floats, known: Floats, deviations: Floats) -> Floats:
    """Half the squared distance (n, ng) of readings (n, nf) from those known (ng, nf): minus the logarithm of their
    likelihood."""
    scale = np.where(deviations > 0.0, deviations, 1.0)
    return 0.5 * (((sensed[:, None] - known[None]) / scale) ** 2).sum(axis=2)


def _expected(apart: Floats, costs: Floats) -> Floats:
    weights = np.exp(apart.min(axis=1, keepdims=True) - apart)
    return weights @ costs / weights.sum(axis=1, keepdims=True)


def _lost(apart: Floats, costs: Floats) -> Floats:
    """Costs (ng,) of what is chosen on each ground."""
    return costs[np.arange(len(costs)), _expected(apart, costs).argmin(axis=1)]
