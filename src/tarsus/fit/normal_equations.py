"""Damped least squares of many records at once: each has unknowns of its own, and all may share some.

scipy's ``least_squares`` takes one problem at a time and knows nothing of what records share: here a batch of records
goes down side by side, each with a damping of its own, and where they share unknowns their own ones are eliminated
first (Schur complement), so that a thousand records of ten unknowns and two shared ones cost a thousand small systems
instead of one of ten thousand rows. Damping multiplies the diagonal (Marquardt 1963); unknowns at a bound that a step
would push out are held.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats

STUCK = 1e8
"""Damping beyond which a record is left where it is: steps are then 1e-8 of a Gauss-Newton step, far below what any
interval could show, and still none of them gained."""
RIDGE = 1e-12
"""Share of its diagonal that is added to a matrix that is inverted undamped: rounding of its products is 1e-15 of it,
and a direction that nothing determines then stays where it is instead of making the matrix singular."""


@dataclass(frozen=True)
class NormalEquations:
    """Normal equations of nr records with q own unknowns each and p that all share.

    own (nr, q, q), across (nr, q, p), shared (nr, p, p): products of the slopes; right_own (nr, q), right_shared
    (nr, p): of slopes and residuals, downhill; cost (nr,): sum of squared residuals; count (nr,): degrees of freedom.
    """

    own: Floats
    across: Floats
    shared: Floats
    right_own: Floats
    right_shared: Floats
    cost: Floats
    count: Floats

    @classmethod
    def of(cls, residuals: Sequence[Floats], slopes: Sequence[Floats], own: int) -> NormalEquations:
        """Of records: residuals (n,) over their noise, model less measurement, and slopes (n, q + p) of them, the
        ``own`` first q columns by the record's own unknowns. Numbers of residuals may differ."""
        normal = np.array([one.T @ one for one in slopes])
        right = np.array([-(one.T @ left) for one, left in zip(slopes, residuals, strict=True)])
        cost = np.array([float(one @ one) for one in residuals])
        return cls.split(normal, right, cost, np.array([float(one.size - own) for one in residuals]), own)

    @classmethod
    def split(cls, normal: Floats, right: Floats, cost: Floats, count: Floats, own: int) -> NormalEquations:
        """Of products (nr, q + p, q + p) of the slopes by the ``own`` first q unknowns and those shared, and of slopes
        and residuals (nr, q + p), downhill."""
        return cls(
            normal[:, :own, :own],
            normal[:, :own, own:],
            normal[:, own:, own:],
            right[:, :own],
            right[:, own:],
            cost,
            count,
        )

    def __len__(self) -> int:
        return len(self.cost)

    def chosen(self, part: NDArray[np.bool_] | NDArray[np.intp]) -> NormalEquations:
        """Those of some records."""
        return NormalEquations(*(getattr(self, one.name)[part] for one in fields(self)))

    def replaced(self, part: NDArray[np.bool_], other: NormalEquations) -> NormalEquations:
        """These with others in the place of the records of ``part`` (nr,)."""
        out = []
        for one in fields(self):
            array = getattr(self, one.name).copy()
            array[part] = getattr(other, one.name)
            out.append(array)
        return NormalEquations(*out)

    def reduced(self) -> tuple[Floats, Floats]:
        """Information (nr, p, p) and score (nr, p) of each record about the shared ones, its own taken along."""
        solved = np.linalg.solve(ridged(self.own), self.across)
        information = self.shared - np.einsum("rqa,rqb->rab", self.across, solved)
        return information, self.right_shared - np.einsum("rqa,rq->ra", solved, self.right_own)

    def step(
        self,
        damping: Floats | float = 0.0,
        information: Floats | None = None,
        right: Floats | None = None,
        *,
        held: bool = False,
    ) -> tuple[Floats, Floats]:
        """Steps of the own unknowns (nr, q) and of the shared ones (p,).

        damping (nr,) of each record, that of the shared ones being the largest; information (p, p) and right (p,): what
        is known of the shared ones besides, and which way that pulls; held: the shared ones stay.
        """
        damp = np.broadcast_to(np.asarray(damping, dtype=float), self.cost.shape)
        own, size = _damped(ridged(self.own), damp), self.across.shape[2]
        shared = np.zeros(size)
        if size and not held:
            solved = np.linalg.solve(own, self.across)
            whole = (self.shared - np.einsum("rqa,rqb->rab", self.across, solved)).sum(axis=0)
            score = (self.right_shared - np.einsum("rqa,rq->ra", solved, self.right_own)).sum(axis=0)
            whole = _damped(whole[None], np.array([damp.max(initial=0.0)]))[0]
            if information is not None:
                whole = whole + information
            shared = np.linalg.solve(ridged(whole[None])[0], score + (0.0 if right is None else right))
        steps = np.linalg.solve(own, (self.right_own - self.across @ shared)[..., None])[..., 0]
        return np.asarray(steps, dtype=np.float64), shared

    def held_at(self, held: NDArray[np.bool_]) -> NormalEquations:
        """The same where some own unknowns (nr, q) do not move."""
        free = ~held
        own = np.where(free[:, :, None] & free[:, None], self.own, 0.0)
        places = np.arange(own.shape[1])
        own[:, places, places] = np.where(held, 1.0, own[:, places, places])
        across = np.where(free[:, :, None], self.across, 0.0)
        return replace(self, own=own, across=across, right_own=np.where(free, self.right_own, 0.0))

    def ridged(self, ridge: Floats) -> NormalEquations:
        """The same with a matrix (q, q) added to every record's: another damping, or what is known besides."""
        return replace(self, own=self.own + ridge)

    def eliminated(self) -> NormalEquations:
        """The same of the shared ones alone, with the own unknowns where the records want them."""
        information, score = self.reduced()
        wanted = np.linalg.solve(ridged(self.own), self.right_own[..., None])[..., 0]
        return replace(
            self,
            own=self.own[:, :0, :0],
            across=self.across[:, :0],
            shared=information,
            right_own=wanted[:, :0],
            right_shared=score,
            cost=self.cost - np.einsum("rq,rq->r", self.right_own, wanted),
        )

    def gathered(self, first: int, known: Floats) -> NormalEquations:
        """All records as one, their own unknowns eliminated: its own ones are the shared ones from number ``first`` on,
        of which there is the information ``known`` besides; the others stay shared."""
        information, score = (one.sum(axis=0)[None] for one in self.reduced())
        return NormalEquations(
            information[:, first:, first:] + known,
            information[:, first:, :first],
            information[:, :first, :first],
            score[:, first:],
            score[:, :first],
            self.cost.sum(keepdims=True),
            self.count.sum(keepdims=True),
        )

    def covariance(self) -> Floats:
        """Covariance (nr, q, q) of the own unknowns, those shared being known: one over the information."""
        return np.asarray(np.linalg.inv(ridged(self.own)), dtype=np.float64)


def _damped(matrices: Floats, damping: Floats) -> Floats:
    diagonal = np.einsum("rqq->rq", matrices)[:, :, None] * np.eye(matrices.shape[1])
    return matrices + damping[:, None, None] * diagonal


def ridged(matrices: Floats, part: float = RIDGE) -> Floats:
    """Matrices (nr, q, q) with a part of their diagonals added."""
    diagonal = np.einsum("rqq->rq", matrices)
    # of its own entry, for unknowns in different units differ by many orders; nothing else has one of zero
    most = diagonal.max(axis=1, initial=np.finfo(float).tiny, keepdims=True)
    share = np.where(diagonal > 0.0, diagonal, most)
    return matrices + part * share[:, :, None] * np.eye(matrices.shape[1])


Equations = Callable[[Floats, Floats, NDArray[np.intp]], NormalEquations]
"""What is fitted: normal equations at own unknowns (n, q) and shared ones (p,) of the records of these numbers (n,)."""
CostFunction = Callable[[Floats, Floats, NDArray[np.intp]], Floats]
"""Its sums of squares (n,) alone, where they are much cheaper than slopes."""


@dataclass(frozen=True)
class Descent:
    """How a descent goes, and when it ends.

    rounds: steps tried at most; settled: it ends when the next Gauss-Newton step is less than so many standard errors
    long (in all directions together, by the scatter of the residuals where that is larger than their noise), or gained
    as little: a hundredth moves no interval that anybody reads; damping: of the first step; far (p,): longest step of a
    shared unknown; low, high (q,): bounds of the own unknowns.
    """

    rounds: int = 50
    settled: float = 0.01
    damping: float = 1e-3
    far: Floats | float = np.inf
    low: Floats | float = -np.inf
    high: Floats | float = np.inf


@dataclass(frozen=True)
class Minimum:
    """Where a descent ended: own unknowns (nr, q), shared ones (p,), equations there, which records settled (nr,), and
    how many rounds it took."""

    own: Floats
    shared: Floats
    equations: NormalEquations
    settled: NDArray[np.bool_]
    rounds: int


def descend(
    equations: Equations,
    own: Floats,
    shared: Floats | None = None,
    *,
    prior: tuple[Floats, Floats] | None = None,
    costs: CostFunction | None = None,
    how: Descent | None = None,
) -> Minimum:
    """Least squares of nr records by damped Gauss-Newton steps.

    Parameters
    ----------
    equations
        Normal equations at any place.
    own
        First own unknowns (nr, q), in any unit; q may be 0.
    shared
        First shared ones (p,); without them every record goes down by itself, with a damping of its own.
    prior
        What is known of the shared ones: centre (p,) and information (p, p).
    costs
        Sums of squares alone: then slopes are asked for only where a step gained.
    how
        How, and when it ends.
    """
    way = how or Descent()
    own, shared = own.astype(float), np.zeros(0) if shared is None else shared.astype(float)
    groups = np.zeros(len(own), dtype=np.intp) if len(shared) else np.arange(len(own))
    count = min(len(own), 1) if len(shared) else len(own)
    damping, done, settled = (np.full(count, way.damping), np.zeros(count, dtype=bool), np.zeros(count, dtype=bool))
    good = equations(own, shared, np.arange(len(own)))
    tried = 0
    while tried < way.rounds and not done.all():
        tried += 1
        left = np.flatnonzero(~done[groups])
        mine, numbers = good.chosen(left), groups[left]
        live = np.unique(numbers)
        step, move, near = _step(mine, own[left], shared, damping[numbers], prior, way)
        place, there = np.clip(own[left] + step, way.low, way.high), shared + move
        new = equations(place, there, left) if costs is None else None
        cost = new.cost if new is not None else np.asarray(costs(place, there, left))  # pyright: ignore[reportOptionalCall]
        gain = _by_group(mine.cost - cost, numbers, count) + _of_prior(shared, prior) - _of_prior(there, prior)
        better = gain > 0.0  # what is no number is not
        taken = better[numbers]
        if taken.any():
            own[left[taken]], shared = place[taken], there
            if new is None:
                new = equations(place[taken], there, left[taken])
            else:
                new = new.chosen(taken)
            good = good.replaced(np.isin(np.arange(len(own)), left[taken]), new)
        small = way.settled**2
        close = (_by_group(near, numbers, count) < small) | (better & (gain < small * _scale(mine, numbers, count)))
        settled[live] = close[live]
        damping[live] *= np.where(better, 0.1, 10.0)[live]
        done |= settled | (damping > STUCK)
    return Minimum(own, shared, good, settled[groups], tried)


def _step(
    mine: NormalEquations,
    own: Floats,
    shared: Floats,
    damping: Floats,
    prior: tuple[Floats, Floats] | None,
    way: Descent,
) -> tuple[Floats, Floats, Floats]:
    """Steps within the bounds, and how many standard errors long an undamped one would be, squared, by record."""
    information = right = None
    if prior is not None:
        information, right = prior[1], prior[1] @ (prior[0] - shared)
    free = _freed(mine, own, damping, information, right, way.low, way.high)
    step, move = free.step(damping, information, right)
    whole, all_ = free.step(0.0, information, right)
    long = np.einsum("rq,rq->r", whole, free.right_own) + free.right_shared @ all_
    scale = np.maximum(1.0, mine.cost / np.maximum(mine.count, 1.0))
    if right is not None:
        long = long + (right @ all_) / max(len(long), 1)
    return step, np.clip(move, -way.far, way.far), np.maximum(long / scale, 0.0)


def _freed(
    equations: NormalEquations,
    own: Floats,
    damping: Floats | float,
    information: Floats | None,
    right: Floats | None,
    low: Floats | float,
    high: Floats | float,
) -> NormalEquations:
    """The equations where own unknowns at a bound that a step would push out do not move."""
    held = np.zeros(own.shape, dtype=bool)
    free = equations
    for _ in range(own.shape[1]):
        step, _ = free.step(damping, information, right)
        out = ~held & (((own <= low) & (step < 0.0)) | ((own >= high) & (step > 0.0)))
        if not out.any():
            break
        held |= out
        free = equations.held_at(held)
    return free


def held_step(equations: NormalEquations, own: Floats, low: Floats | float, high: Floats | float) -> Floats:
    """Steps (nr, q) of records that share nothing, from own unknowns within bounds; those at one that a step would
    push out are held."""
    return _freed(equations, own, 0.0, None, None, low, high).step()[0]


def _by_group(values: Floats, numbers: NDArray[np.intp], count: int) -> Floats:
    return np.bincount(numbers, values, minlength=count).astype(float)


def _scale(mine: NormalEquations, numbers: NDArray[np.intp], count: int) -> Floats:
    """Squared scatter of the residuals over their noise, at least 1, by group."""
    freedom = _by_group(mine.count, numbers, count)
    return np.maximum(1.0, _by_group(mine.cost, numbers, count) / np.maximum(freedom, 1.0))


def _of_prior(shared: Floats, prior: tuple[Floats, Floats] | None) -> float:
    if prior is None:
        return 0.0
    off = shared - prior[0]
    return float(off @ prior[1] @ off)
