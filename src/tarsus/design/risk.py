"""Risk: many grounds' costs as one number, the lower the better."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.units import parse_quantity

__all__ = ["MEAN", "NOMINAL", "WORST", "Risk", "cvar", "risk_of"]

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Risk:
    """The mean of the worst share ``tail`` of all grounds (conditional value at risk).

    name: as typed; tail: 1 is the mean of all grounds, 0 the worst ground alone, however unlikely, and None the nominal
    ground alone.
    """

    name: str
    tail: float | None

    def __call__(self, costs: Floats, weights: Floats) -> Floats:
        """One number (n,) a candidate, of costs (n, ng) on grounds of weights (ng,) of sum 1; the first ground is the
        nominal one."""
        if self.tail is None:
            return costs[:, 0]
        if self.tail == 0.0:
            return costs.max(axis=1)
        if self.tail == 1.0:
            return costs @ weights
        order = np.argsort(-costs, axis=1)
        own = weights[order]
        taken = np.clip(self.tail - (np.cumsum(own, axis=1) - own), 0.0, own)
        ordered = np.where(
            taken > 0.0, np.take_along_axis(costs, order, axis=1), 0.0
        )  # 0 times infinity is 0
        return (taken * ordered).sum(axis=1) / self.tail


NOMINAL, WORST, MEAN = Risk("nominal", None), Risk("worst", 0.0), Risk("mean", 1.0)


def cvar(level: float) -> Risk:
    """The mean of the worst share 1 - level of all grounds, 0 <= level < 1."""
    return Risk(f"cvar:{level:g}", 1.0 - level)


def risk_of(word: str | Risk) -> Risk:
    """The risk of a word: worst, mean, nominal, or cvar:q with 0 <= q < 1. Raises InputError for any other."""
    if isinstance(word, Risk):
        return word
    for one in (NOMINAL, WORST, MEAN):
        if word == one.name:
            return one
    head, colon, tail = word.partition(":")
    if head == "cvar" and colon:
        try:
            level = parse_quantity(tail, "1")
        except InputError as error:
            raise InputError([f"risk: {one}" for one in error.problems]) from None
        if 0.0 <= level < 1.0:
            return cvar(level)
    raise InputError(f"risk: expected worst, cvar:q with 0 <= q < 1, mean or nominal, got '{word}'")
