"""Normal equations of many flights that share a film and nothing else: a flight's own unknowns are eliminated
first."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["NormalEquations"]

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class NormalEquations:
    """Normal equations of all flights: own (nr, q, q), across (nr, q, 2), shared (nr, 2, 2), right sides, costs."""

    own: Floats
    across: Floats
    shared: Floats
    right_own: Floats
    right_shared: Floats
    cost: Floats
    count: Floats
    residuals: tuple[Floats, ...]
    flights: tuple[Floats, ...]

    def where(self, chosen: NDArray[np.bool_], other: NormalEquations) -> NormalEquations:
        """This system for the chosen flights (nr,), another one for the rest."""
        mixed: list[Floats] = [
            np.where(chosen.reshape(-1, *[1] * (np.ndim(mine) - 1)), mine, theirs)
            for mine, theirs in zip(self._arrays(), other._arrays(), strict=True)
        ]
        residuals, flights = (
            tuple(a if yes else b for a, b, yes in zip(mine, theirs, chosen, strict=True))
            for mine, theirs in ((self.residuals, other.residuals), (self.flights, other.flights))
        )
        return NormalEquations(*mixed, residuals=residuals, flights=flights)

    def of(self, chosen: NDArray[np.bool_]) -> NormalEquations:
        """The system of the chosen flights (nr,) alone."""
        residuals, flights = (
            tuple(one for one, yes in zip(every, chosen, strict=True) if yes)
            for every in (self.residuals, self.flights)
        )
        return NormalEquations(*(one[chosen] for one in self._arrays()), residuals=residuals, flights=flights)

    def _arrays(self) -> tuple[Floats, ...]:
        return self.own, self.across, self.shared, self.right_own, self.right_shared, self.cost, self.count

    def reduced(self) -> tuple[Floats, Floats]:
        """Information (nr, 2, 2) and score (nr, 2) about the film, with each flight's unknowns taken along."""
        solved = np.linalg.solve(self.own, self.across)
        information = self.shared - np.einsum("rqa,rqb->rab", self.across, solved)
        score = self.right_shared - np.einsum("rqa,rq->ra", solved, self.right_own)
        return information, score

    def solve(
        self, prior: Floats, right: Floats, damping: Floats, film_damping: float
    ) -> tuple[Floats, Floats]:
        """Steps of the unknowns (nr, q), damped flight by flight (nr,), and of the film (2,); an infinite damping
        holds the film."""
        diagonal = np.einsum("rqq->rq", self.own)[:, :, None] * np.eye(self.own.shape[1])
        own = self.own + damping[:, None, None] * diagonal
        step = np.zeros(2)
        if np.isfinite(film_damping):
            solved = np.linalg.solve(own, self.across)
            information = (self.shared - np.einsum("rqa,rqb->rab", self.across, solved)).sum(axis=0)
            score = (self.right_shared - np.einsum("rqa,rq->ra", solved, self.right_own)).sum(axis=0)
            step = np.linalg.solve(information * (1.0 + film_damping * np.eye(2)) + prior, score + right)
        unknowns = np.linalg.solve(own, (self.right_own - self.across @ step)[..., None])[..., 0]
        return unknowns, step
