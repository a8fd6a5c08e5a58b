"""Records by windows that are tied: each starts where the one before ended, but for what no model has of a motion.

Windows with free starts forget, at every cut, what the motion before says of the motion after. Tied within some
standard deviations, as in multiple shooting (Bock and Plitt 1984), they lose nothing, and their cost stays smooth where
that of one window over the whole record is not. Starts are eliminated along the chain (`tarsus.fit.chain_equations`).
Slopes of a window cost some fifty times what the window costs, and are kept as long as they predict it: from fit to fit
only windows that are new, or bent, are differentiated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.fit.chain_equations import ChainEquations
from tarsus.fit.normal_equations import STUCK
from tarsus.fit.record_problem import Flown, RecordFit, RecordProblem, Segment, free_of

TAIL = 4.0
"""Times its noise from which a residual costs the logarithm of its size only: noise is beyond once in 16,000 samples,
and what is beyond otherwise is a sample on the wrong side of an impact. A current or a velocity jumps there by a
hundred times its noise within a fifth of a sample, so that this one sample's cost is a step, without a slope, which
outbids all the samples by which the moment of the impact is found."""
SETTLED = 0.1
"""Standard errors to the minimum at which a descent ends: an interval is then as wide to a hundredth."""
DAMPING = 1e-3
"""Of the first step of a descent."""
BENT, UNSEEN = 0.2, 0.1
"""Part of what slopes predict of a window by which they may miss it, and root mean square of the miss over the noise
that nobody sees, before they are formed anew: steps shrink fivefold all the same, and an estimate errs by no more than
that part of its standard error."""
AT_END = 0.25
"""Part of both that is left in the end: a twentieth of a standard error, half of what a descent ends at."""


MISLED = 0.75
"""Share of what the cost of a step is off its prediction that is made good at a time: what is left shrinks fourfold."""


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

    def pull(self, moved: Floats) -> Floats:
        """Which way (np,) it pulls numbers (np,)."""
        return self.information @ (self.centre - moved)

    def cost(self, moved: Floats) -> float:
        """Sum of squares of numbers (np,) about it."""
        off = moved - self.centre
        return float(off @ self.information @ off)


class WindowPulls(NamedTuple):
    """What parts of the records say of the numbers, starts eliminated: information (n, np, np) and score (n, np) in the
    numbers' standard deviations beforehand, downhill; window (n,): whose samples a part is, with what was known of its
    start, or, where tied (n,), its tie to the one before."""

    information: Floats
    score: Floats
    window: NDArray[np.intp]
    tied: NDArray[np.bool_]


class _Slopes(NamedTuple):
    """A window about a place: its start (2n,) and numbers (np,), what it leaves there (k,), and slopes of this (k, 2n +
    np) and of the state at its end (2n, 2n + np) by both, in standard deviations."""

    state: Floats
    moved: Floats
    off: Floats
    by: Floats
    end: Floats

    def among(self, old: RecordProblem, new: RecordProblem) -> _Slopes:
        """The same in the standard deviations of another problem, whose numbers begin with those of the old one."""
        pairs = [(old.priors[name], new.priors[name]) for name in old.priors]
        values = [np.array(a.placed(by)) for (a, _), by in zip(pairs, self.moved.tolist(), strict=True)]
        moved = np.array([float(b.offsets(value)) for (_, b), value in zip(pairs, values, strict=True)])
        unit = [float(a.rates(value) / b.rates(value)) for (a, b), value in zip(pairs, values, strict=True)]
        scale = np.concatenate([np.ones(len(self.state)), unit])[: self.by.shape[1]]
        more = np.zeros(len(new.priors) - len(moved))
        return _Slopes(self.state, np.append(moved, more), self.off, self.by * scale, self.end * scale)

    def predict(self, state: Floats, moved: Floats, off: Floats, spread: Floats, exact: bool) -> bool:
        """Whether they predict what the window leaves (k,) at another place well enough, on the way or in the end."""
        step = np.concatenate([(state - self.state) / spread, moved - self.moved])
        change = self.by @ step[: self.by.shape[1]]
        share = np.minimum(_tailed(off)[1], _tailed(self.off + change)[1])
        missed = np.mean((share * (off - self.off - change)) ** 2)
        part = AT_END if exact else 1.0
        return bool(missed <= part**2 * max(UNSEEN**2, BENT**2 * np.mean((share * change) ** 2)))


class _Place(NamedTuple):
    """Windows at starts (nw, 2n) and numbers (np,), in standard deviations: as flown, what each leaves, the gaps (nw,
    2n) of its start from the end before over the ties, zero of a record's first, and what all costs."""

    own: Floats
    moved: Floats
    flown: Flown
    off: list[Floats]
    gaps: Floats
    cost: float


def _tailed(off: Floats) -> tuple[float, Floats]:
    """What residuals (n,) cost, c^2 (1 + 2 ln |r|/c) beyond the tail's c and r^2 within, and weights (n,) with which
    their least squares have the slopes of this."""
    size = np.maximum(np.abs(off) / TAIL, 1.0)
    inner = off / size
    return float(inner @ inner + 2.0 * TAIL**2 * np.log(size).sum()), 1.0 / size


class TiedWindows:
    """Windows of the records of a problem, tied end to start; ties (2n,): standard deviations [m, m/s] of a start about
    the end of the window before. Slopes are kept from fit to fit, and taken from windows that are like these but for
    their ties, for what is known of the numbers, or for some that they lack.

    Raises InputError, of every method, where a scene does not take the numbers.
    """

    def __init__(self, problem: RecordProblem, ties: Floats, like: TiedWindows | None = None) -> None:
        self.problem, self.ties, self.names = problem, ties, tuple(problem.priors)
        self._kept: dict[object, _Slopes] = {}
        if like is not None and like.problem.records is problem.records and like.names == self.names[: len(like.names)]:
            self._kept = {key: one.among(like.problem, problem) for key, one in like._kept.items()}

    def solve(
        self,
        segments: Sequence[Segment],
        moved: Floats,
        *,
        rounds: int = 12,
        known: Knowledge | None = None,
        exact: bool = False,
    ) -> RecordFit:
        """Fit segments of records, each record's one after the other without gaps and in order.

        moved (np,): numbers to begin with; known: what is known of the numbers, no more than beforehand unless given;
        exact: whether it ends with slopes that are those of where it ends. Residuals beyond `TAIL` count for the
        logarithm of their size.
        """
        before = known or Knowledge.beforehand(len(moved))
        at = self.placed(segments, np.zeros((len(segments), len(self.ties))), moved)
        damping, settled = DAMPING, False
        for _ in range(rounds):
            system = self.equations(segments, at)
            information, right = before.information, before.pull(at.moved)
            own, step = system.step(damping, information, right)
            far = self.problem.far
            new = self._tried(segments, at.own + own, at.moved + np.clip(step, -far, far))
            gain = -np.inf if new is None else at.cost + before.cost(at.moved) - new.cost - before.cost(new.moved)
            small = SETTLED**2
            settled = system.length(information, right) < small or 0.0 < gain < small * system.scale
            if new is not None and gain > 0.0:
                at, damping = new, 0.1 * damping
            elif not settled and not self._differentiated(segments, at, self._misled(segments, at, new)):
                damping *= 10.0
            if settled and exact and self._differentiated(segments, at, self._bent(segments, at, exact=True)):
                settled = False
            elif settled or damping > STUCK:
                break
        return self._fit(segments, at, before, settled)

    def placed(self, segments: Sequence[Segment], own: Floats, moved: Floats) -> _Place:
        """Windows at starts (nw, 2n) and numbers (np,)."""
        flown = self.problem.flown(segments, own, moved)
        off = [one.ravel() for one in self.problem.left_of(segments, flown)]
        gaps = np.zeros(own.shape)
        for _, k in _tied(segments):
            last = flown.batch.first[k] - 1
            end = np.concatenate([flown.batch.states.x[:, last], flown.batch.states.v[:, last]])
            gaps[k] = (np.asarray(flown.batch.starts[k].state) - end) / self.ties
        first = own[_firsts(segments)]
        cost = sum(_tailed(one)[0] for one in off) + float(np.sum(gaps**2) + np.sum(first**2))
        return _Place(own, moved, flown, off, gaps, cost)

    def _tried(self, segments: Sequence[Segment], own: Floats, moved: Floats) -> _Place | None:
        try:
            found = self.placed(segments, own, moved)
        except InputError:
            return None
        return found if np.isfinite(found.cost) else None

    def equations(self, segments: Sequence[Segment], at: _Place) -> ChainEquations:
        """Normal equations at a place, with slopes that predict it."""
        slopes = self._slopes(segments, at)
        (n, q), p = at.own.shape, len(self.names)
        own, onward, across = np.zeros((n, q, q)), np.zeros((n, q, q)), np.zeros((n, q, p))
        shared, right_own, right_shared = np.zeros((p, p)), np.zeros((n, q)), np.zeros(p)
        for k in _firsts(segments):
            own[k] += np.eye(q)
            right_own[k] -= at.own[k]
        for k, one in enumerate(slopes):
            share = _tailed(at.off[k])[1]
            by, off = share[:, None] * one.by, share * at.off[k]
            whole, right = by.T @ by, by.T @ off
            own[k] += whole[:q, :q]
            across[k] += whole[:q, q:]
            shared += whole[q:, q:]
            right_own[k] -= right[:q]
            right_shared -= right[q:]
        for before, k, here, there, by in self._ties(segments, at, slopes):
            own[before] += here.T @ here
            own[k] += there.T @ there
            onward[before] += here.T @ there
            across[before] += here.T @ by
            across[k] += there.T @ by
            shared += by.T @ by
            right_own[before] -= here.T @ at.gaps[k]
            right_own[k] -= there.T @ at.gaps[k]
            right_shared -= by.T @ at.gaps[k]
        freedom = sum(one.size for one in at.off)
        return ChainEquations(own, onward, across, shared, right_own, right_shared, at.cost, float(freedom))

    def pulls(self, fit: RecordFit) -> WindowPulls:
        """How far every window and every tie pulls the numbers where a fit ended."""
        segments = fit.segments
        at = self.placed(segments, np.zeros((len(segments), len(self.ties))), fit.moved)
        slopes = self._slopes(segments, at)
        taken, q = self.equations(segments, at).eliminated().taken, len(self.ties)
        firsts = set(_firsts(segments))
        parts = list[tuple[Floats, Floats, int, bool]]()
        for k, one in enumerate(slopes):
            share = _tailed(at.off[k])[1]
            rows = share[:, None] * (one.by[:, q:] - one.by[:, :q] @ taken[k])
            information = rows.T @ rows + (taken[k].T @ taken[k] if k in firsts else 0.0)
            parts.append((information, -rows.T @ (share * at.off[k]), k, False))
        for before, k, here, there, by in self._ties(segments, at, slopes):
            rows = by - here @ taken[before] - there @ taken[k]
            parts.append((rows.T @ rows, -rows.T @ at.gaps[k], k, True))
        each = list(zip(*parts, strict=True))
        return WindowPulls(*(np.array(one) for one in each))

    def _ties(
        self, segments: Sequence[Segment], at: _Place, slopes: Sequence[_Slopes]
    ) -> list[tuple[int, int, Floats, Floats, Floats]]:
        """Of each tie the windows, and slopes of its gap by both starts and the numbers."""
        q, out = len(self.ties), []
        for before, k in _tied(segments):
            end, free = slopes[before].end / self.ties[:, None], free_of(at.flown.plans[k], segments[k])
            out.append((before, k, -end[:, :q], free / self.ties[:, None], -end[:, q:]))
        return out

    def _slopes(self, segments: Sequence[Segment], at: _Place) -> list[_Slopes]:
        """Slopes of all windows, formed anew where those that are kept do not predict what there is."""
        self._differentiated(segments, at, self._bent(segments, at))
        self._completed(segments, at)
        return [self._kept[_key(one)] for one in segments]

    def _completed(self, segments: Sequence[Segment], at: _Place) -> None:
        """Form slopes by numbers that windows which these are like had not."""
        every = len(self.ties) + len(self.names)
        lacking = [k for k, one in enumerate(segments) if self._kept[_key(one)].by.shape[1] < every]
        if not lacking:
            return
        some = [segments[k] for k in lacking]
        width = min(self._kept[_key(one)].by.shape[1] for one in some)
        names = self.names[width - len(self.ties) :]
        flown = self.problem.flown(some, at.own[lacking], at.moved, names, starts_too=False)
        by = self.problem.slopes_of(some, flown, names)
        for j, one in enumerate(some):
            kept, (_, end) = self._kept[_key(one)], self.problem.end_slopes(some, flown, j, names)
            both = np.hstack([kept.by[:, :width], by[j]]), np.hstack([kept.end[:, :width], end])
            self._kept[_key(one)] = kept._replace(by=both[0], end=both[1])

    def _bent(self, segments: Sequence[Segment], at: _Place, *, exact: bool = False) -> list[int]:
        """Windows without slopes that predict what they leave at a place."""
        old = [self._kept.get(_key(one)) for one in segments]
        pairs = zip(old, _states(at), at.off, segments, strict=True)
        return [
            k
            for k, (one, state, off, segment) in enumerate(pairs)
            if one is None or not one.predict(state, at.moved, off, segment.spread, exact)
        ]

    def _misled(self, segments: Sequence[Segment], at: _Place, new: _Place | None) -> list[int]:
        """Windows whose slopes are of another place, and made a step gain nothing: those by which its cost is off what
        was predicted most, to a share `MISLED` of all that it is off; all of them where the step led nowhere."""
        kept = [self._kept[_key(one)] for one in segments]
        states = _states(at)
        elsewhere = np.array(
            [
                not (np.array_equal(one.moved, at.moved) and np.array_equal(one.state, state))
                for one, state in zip(kept, states, strict=True)
            ]
        )
        if new is None:
            return np.flatnonzero(elsewhere).tolist()
        apart = [b - a for a, b in zip(states, _states(new), strict=True)]
        off, steps = np.zeros(len(segments)), list[Floats]()
        for k, (one, segment) in enumerate(zip(kept, segments, strict=True)):
            steps.append(np.concatenate([apart[k] / segment.spread, new.moved - at.moved]))
            predicted = _tailed(at.off[k] + one.by @ steps[k])[0]
            off[k] = abs(_tailed(new.off[k])[0] - predicted)
        for before, k in _tied(segments):
            gap = at.gaps[k] + (apart[k] - kept[before].end @ steps[before]) / self.ties
            off[before] += abs(float(new.gaps[k] @ new.gaps[k] - gap @ gap))
        order = np.argsort(off)[::-1]
        reached = np.cumsum(off[order])
        count = int(np.searchsorted(reached, MISLED * reached[-1])) + 1
        return [int(k) for k in order[:count] if elsewhere[k]]

    def _differentiated(self, segments: Sequence[Segment], at: _Place, which: Sequence[int]) -> bool:
        """Form slopes of some windows anew; whether there were any."""
        if not which:
            return False
        some = [segments[k] for k in which]
        flown = self.problem.flown(some, at.own[list(which)], at.moved, self.names)
        by = self.problem.slopes_of(some, flown, self.names)
        left = self.problem.left_of(some, flown)
        for j, one in enumerate(some):
            state = np.asarray(flown.batch.starts[j].state, dtype=float)
            end = np.hstack(self.problem.end_slopes(some, flown, j, self.names))
            self._kept[_key(one)] = _Slopes(state, at.moved, left[j].ravel(), by[j], end)
        return True

    def _fit(self, segments: Sequence[Segment], at: _Place, known: Knowledge, settled: bool) -> RecordFit:
        left = self.equations(segments, at).eliminated()
        covariance = np.asarray(np.linalg.inv(left.information + known.information), dtype=np.float64)
        ahead = covariance @ (left.score + known.pull(at.moved))
        pairs = zip(segments, at.flown.batch.starts, strict=True)
        return RecordFit(
            at.flown.values,
            at.moved,
            covariance,
            ahead,
            tuple(replace(one, state=np.asarray(start.state, dtype=float), begin=start.t0) for one, start in pairs),
            np.array([float(np.mean(one**2)) if one.size else np.nan for one in at.off]),
            np.array([float(np.abs(one).max(initial=0.0)) for one in at.off]),
            settled,
            np.concatenate([np.zeros(0), *(at.gaps[k] for _, k in _tied(segments))]),
            at.cost + known.cost(at.moved),
        )


def _states(at: _Place) -> list[Floats]:
    """Starts (2n,) of windows."""
    return [np.asarray(one.state, dtype=float) for one in at.flown.batch.starts]


def _key(one: Segment) -> object:
    """What a window's slopes are of, but for its start."""
    return one.record, one.begin, one.span, repr(one.contacts), one.spread.tobytes()


def _firsts(segments: Sequence[Segment]) -> list[int]:
    """Numbers of the first segments of records."""
    of = [None, *(one.record for one in segments)]
    return [k for k, (before, own) in enumerate(pairwise(of)) if before != own]


def _tied(segments: Sequence[Segment]) -> list[tuple[int, int]]:
    """Numbers of segments that follow each other."""
    pairs = pairwise(enumerate(segments))
    return [(a, b) for (a, one), (b, two) in pairs if one.record == two.record]
