"""Risk: many grounds' scores as one number, the lower the better."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.units import parse_quantity

__all__ = ["CVaR", "Mean", "Nominal", "Risk", "Worst", "risk_of"]

Floats = NDArray[np.float64]


class Risk(ABC):
    """Base of the risks."""

    @property
    @abstractmethod
    def name(self) -> str:
        """As typed."""

    @property
    @abstractmethod
    def tail(self) -> float:
        """Share of the worst grounds whose mean it is: 0 the worst alone, 1 the mean of all."""

    @abstractmethod
    def __call__(self, scores: Floats, weights: Floats) -> Floats:
        """One number (n,) a candidate, of scores (n, ng) on grounds of weights (ng,) of sum 1; the first ground is the
        nominal one."""


@dataclass(frozen=True)
class Nominal(Risk):
    """The nominal ground alone."""

    @property
    def name(self) -> str:
        return "nominal"

    @property
    def tail(self) -> float:
        return 0.0

    def __call__(self, scores: Floats, weights: Floats) -> Floats:
        return scores[:, 0]


@dataclass(frozen=True)
class Worst(Risk):
    """The worst ground, however unlikely."""

    @property
    def name(self) -> str:
        return "worst"

    @property
    def tail(self) -> float:
        return 0.0

    def __call__(self, scores: Floats, weights: Floats) -> Floats:
        return scores.max(axis=1)


@dataclass(frozen=True)
class Mean(Risk):
    """The expectation."""

    @property
    def name(self) -> str:
        return "mean"

    @property
    def tail(self) -> float:
        return 1.0

    def __call__(self, scores: Floats, weights: Floats) -> Floats:
        return scores @ weights


@dataclass(frozen=True)
class CVaR(Risk):
    """The expectation of the worst share 1 - level of all grounds (conditional value at risk)."""

    level: float

    @property
    def name(self) -> str:
        return f"cvar:{self.level:g}"

    @property
    def tail(self) -> float:
        return 1.0 - self.level

    def __call__(self, scores: Floats, weights: Floats) -> Floats:
        order = np.argsort(-scores, axis=1)
        sorted_weights = weights[order]
        before = np.cumsum(sorted_weights, axis=1) - sorted_weights
        share = 1.0 - self.level
        taken = np.clip(share - before, 0.0, sorted_weights)
        counted = np.where(
            taken > 0.0, np.take_along_axis(scores, order, axis=1), 0.0
        )  # 0 times infinity is 0
        return (taken * counted).sum(axis=1) / share


def risk_of(word: str | Risk) -> Risk:
    """The risk of a word: worst, mean, nominal, or cvar:q with 0 <= q < 1. Raises InputError for any other."""
    if isinstance(word, Risk):
        return word
    plain = {"worst": Worst(), "mean": Mean(), "nominal": Nominal()}
    if word in plain:
        return plain[word]
    head, colon, tail = word.partition(":")
    if head == "cvar" and colon:
        try:
            level = parse_quantity(tail, "1")
        except InputError as error:
            raise InputError([f"risk: {one}" for one in error.problems]) from None
        if 0.0 <= level < 1.0:
            return CVaR(level)
    raise InputError(f"risk: expected worst, cvar:q with 0 <= q < 1, mean or nominal, got '{word}'")
