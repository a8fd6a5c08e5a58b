"""Records by windows that are tied: each starts where the one before ended, but for what no model has of a motion.

Windows with free starts forget, at every cut, what the motion before tells of the motion after. Tied within some
standard deviations, as in multiple shooting (Bock and Plitt 1984), they lose nothing, and their cost stays smooth where
that of one window over the whole record is not. The starts of a record are eliminated together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.fit.normal_equations import Descent, NormalEquations, descend
from tarsus.fit.record_problem import Flown, RecordFit, RecordProblem, Segment, free_of
from tarsus.solve import WindowBatch

TAIL = 4.0
"""Times its noise from which a residual costs the logarithm of its size only: noise is beyond once in 16,000 samples,
and what is beyond otherwise is a sample on the wrong side of an impact. A current or a velocity jumps there by a
hundred times its noise within a fifth of a sample, so that this one sample's cost is a step, without a slope, which
outbids all the samples by which the moment of the impact is found."""
SETTLED = 0.1
"""Standard errors to the minimum at which a descent ends: an interval is then as wide to a hundredth, and every step of
many windows costs as much as their simulation some hundred times."""


@dataclass(frozen=True)
class Knowledge:
    """What is known of the numbers: centre (np,) and information (np, np), in their standard deviations beforehand."""

    centre: Floats
    information: Floats

    @classmethod
    def beforehand(cls, count: int) -> Knowledge:
        """That of so many numbers before any record."""
        return cls(np.zeros(count), np.eye(count))

    @classmethod
    def of(cls, centre: Floats, covariance: Floats) -> Knowledge:
        """That of numbers with a covariance (np, np)."""
        return cls(centre, np.asarray(np.linalg.inv(covariance), dtype=np.float64))

    @property
    def covariance(self) -> Floats:
        """Covariance (np, np)."""
        return np.asarray(np.linalg.inv(self.information), dtype=np.float64)


def solve_tied(
    problem: RecordProblem,
    segments: Sequence[Segment],
    moved: Floats,
    ties: Floats,
    *,
    rounds: int = 12,
    known: Knowledge | None = None,
) -> RecordFit:
    """Fit segments of records, each record's one after the other without gaps and in order.

    moved (np,): numbers to begin with; ties (2n,): standard deviations [m, m/s] of a start about the end of the window
    before; known: what is known of the numbers, no more than beforehand unless given. Residuals beyond `TAIL` count for
    the logarithm of their size.
    """
    before = known or Knowledge.beforehand(len(moved))
    tied = _Tied(problem, tuple(segments), ties)
    prior = before.centre, before.information
    found = descend(
        lambda own, at, _: tied.equations(own, at), np.zeros((len(tied.of), tied.wide)), moved,
        prior=prior, costs=lambda own, at, _: tied.costs(own, at),
        how=Descent(rounds=rounds, settled=SETTLED, far=problem.far),
    )  # fmt: skip
    fit = problem.fitted(segments, found, tied.each(found.own), found.shared, prior)
    jumps = [one for numbers in tied.of for one in tied.jumps(fit.windows, numbers)]
    return replace(fit, jumps=np.concatenate(jumps) if jumps else np.zeros(0))


def _tailed(off: Floats) -> tuple[float, Floats]:
    """What residuals (n,) cost, c^2 (1 + 2 ln |r|/c) beyond the tail's c and r^2 within, and weights (n,) with which
    their least squares have the slopes of this."""
    size = np.maximum(np.abs(off) / TAIL, 1.0)
    inner = off / size
    return float(inner @ inner + 2.0 * TAIL**2 * np.log(size).sum()), 1.0 / size


class _Tied:
    """Segments by record; starts of all segments of a record are its own unknowns, (records, wide)."""

    def __init__(self, problem: RecordProblem, segments: tuple[Segment, ...], ties: Floats) -> None:
        self.problem, self.segments, self.ties = problem, segments, ties
        records = list(dict.fromkeys(one.record for one in segments))
        self.of = [[k for k, one in enumerate(segments) if one.record == r] for r in records]
        self.size = len(ties)
        self.wide = self.size * max(len(one) for one in self.of)

    def each(self, own: Floats) -> Floats:
        """Own unknowns (nw, 2n) of the segments from those of the records."""
        out = np.zeros((len(self.segments), self.size))
        for mine, numbers in zip(own, self.of, strict=True):
            out[numbers] = mine[: len(numbers) * self.size].reshape(len(numbers), -1)
        return out

    def jumps(self, batch: WindowBatch, numbers: Sequence[int]) -> list[Floats]:
        """By how many standard deviations each start but the first of a record is off the end before."""
        out = []
        for before, k in pairwise(numbers):
            at = batch.first[before + 1] - 1
            end = np.concatenate([batch.states.x[:, at], batch.states.v[:, at]])
            out.append((np.asarray(batch.starts[k].state) - end) / self.ties)
        return out

    def costs(self, own: Floats, moved: Floats) -> Floats:
        """Sums of squares of the records; infinite where a scene does not take the numbers."""
        starts = self.each(own)
        try:
            flown = self.problem.flown(self.segments, starts, moved)
        except InputError:
            return np.full(len(self.of), np.inf)
        left = self.problem.left_of(self.segments, flown)
        squares = np.array([_tailed(np.concatenate(each))[0] for each in left])
        return np.array([
            squares[numbers].sum() + float(starts[numbers[0]] @ starts[numbers[0]])
            + sum(float(one @ one) for one in self.jumps(flown.batch, numbers))
            for numbers in self.of
        ])  # fmt: skip

    def equations(self, own: Floats, moved: Floats) -> NormalEquations:
        """Normal equations of the records, window by window: a start meets those beside it and the numbers only."""
        names, size = tuple(self.problem.priors), self.size
        starts = self.each(own)
        flown = self.problem.flown(self.segments, starts, moved, names)
        left = self.problem.left_of(self.segments, flown)
        slopes = self.problem.slopes_of(self.segments, flown, names)
        records, every = len(self.of), self.wide + len(names)
        shared = np.arange(self.wide, every)
        normal, right = np.zeros((records, every, every)), np.zeros((records, every))
        cost, count = np.zeros(records), np.full(records, -float(self.wide))
        for r, numbers in enumerate(self.of):
            parts = [(np.arange(size), starts[numbers[0]], np.eye(size))]
            for w, k in enumerate(numbers):
                mine = np.concatenate([np.arange(w * size, (w + 1) * size), shared])
                off = np.concatenate(left[k])
                squares, share = _tailed(off)
                parts.append((mine, share * off, share[:, None] * slopes[k]))
                cost[r] += squares - float((share * off) @ (share * off))
            tied = zip(self.jumps(flown.batch, numbers), self._ties(flown, numbers, names), strict=True)
            for w, (off, by) in enumerate(tied):
                parts.append((np.concatenate([np.arange(w * size, (w + 2) * size), shared]), off, by))
            for columns, off, by in parts:
                normal[r][np.ix_(columns, columns)] += by.T @ by
                right[r][columns] -= by.T @ off
                cost[r] += off @ off
                count[r] += off.size
        return NormalEquations.split(normal, right, cost, count, self.wide)

    def _ties(self, flown: Flown, numbers: Sequence[int], names: Sequence[str]) -> list[Floats]:
        """Slopes (2n, 4n + np) of each of the gaps by both starts and the numbers; an end that has none moves with
        nothing."""
        out = []
        for before, k in pairwise(numbers):
            by_start, by_numbers = self.problem.end_slopes(self.segments, flown, before, names)
            row = np.hstack([-by_start, free_of(flown.plans[k], self.segments[k]), -by_numbers])
            out.append(row / self.ties[:, None])
        return out
