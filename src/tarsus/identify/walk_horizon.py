"""A record of a walk taken up from its beginning, as far as its motion is predicted, and farther with every fit.

A walk forgets its start at every impact, so that from numbers that are off a prediction follows the record for some
impacts only; as long as it does, the cost is smooth, and a descent finds numbers that follow it farther. So a record is
taken up from the state in which the walker stands: what is predicted to within some tens of its noise is fitted, the
horizon moves to where the prediction leaves the record then, and so on to its end. What has been followed is cut into
windows, tied end to end (`tarsus.fit.record_ties`). Windows long past are no longer fitted: what they tell of the
numbers is kept as a normal distribution.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.fit.record_problem import RecordFit, RecordProblem, Segment
from tarsus.fit.record_ties import Knowledge, TiedWindows
from tarsus.solve import Contacts, WindowStart, simulate_windows

LEAVES, RUN = (20.0, 5.0), 5
"""Times its noise by which a record leaves its prediction, over all channels in the root mean square of so many
samples: far above what noise does, and little enough that no impact is missing or too many yet, as a rule; less where
it is not followed so far."""
MOST, SCATTER, NOISE = 1.1, 5.0, 2.0
"""Mean square over a known noise up to which a window is followed, for ties are loose here, and by how many of its
standard deviations more: of some thousand windows that are followed none is then taken for one that is not; and by how
many a first horizon may leave more than noise before others are tried."""
AHEAD = 64
"""Samples over which a prediction is looked at first."""
EVENTS = 1.5
"""Moments of events in a window at most, for each foot: with more the effect of a number grows so that slopes hold over
a fraction of its interval only, and a descent of all windows creeps (of 12 for two feet by a tenth of one a step)."""
OPEN = 4
"""Windows that are fitted together; what is older moves the numbers no more."""
ROUNDS, AGAIN, GAIN = 2, 8, 0.9
"""Steps of a descent, how often they are repeated, and the share of what was left that is left where they gain."""
DRAWN, TRIED, SPREAD = 24, 4, 0.5
"""Other numbers that are drawn where no descent follows the record, how many of these are gone down from, and their
standard deviations in those of what is known."""


@dataclass(frozen=True)
class FollowedWalk:
    """Windows of a record up to where it is predicted.

    segments: the open ones last; closed: how many are not fitted any more; moved (np,): numbers; known: what all before
    the open ones says of them; covariance (np, np): with the open ones; left (nw,): mean square of what each leaves;
    lost: whether an open one is not followed; cost: of the open ones (`RecordFit.cost`).
    """

    segments: list[Segment]
    closed: int
    moved: Floats
    known: Knowledge
    covariance: Floats
    left: Floats
    lost: bool = False
    cost: float = np.inf

    @property
    def reached(self) -> float:
        """End of the last window [s]."""
        return self.segments[-1].span[1]


@dataclass(frozen=True)
class WalkFollower:
    """Takes up a record of the problem of tied windows by its number; rest, near (2n,): standard deviations [m, m/s] of
    its start and of that of the first window that is still fitted; most: mean square over the noise up to which a
    window is followed, but for its scatter; seed: of what is drawn."""

    windows: TiedWindows
    number: int
    rest: Floats
    near: Floats
    most: float = MOST
    seed: int = 0

    @property
    def problem(self) -> RecordProblem:
        """Of the windows."""
        return self.windows.problem

    def follow(self, moved: Floats, known: Knowledge) -> FollowedWalk:
        """Windows up to the end of the record, from numbers (np,) of which so much is known, or as far as it is
        followed from any that are tried."""
        at = self._begun(moved, known)
        at = at if at.lost else self._grown(at)
        while at.lost:
            other = self._elsewhere(at)
            if other.lost and other.reached <= self._after(at.reached):
                break
            at = other
        good = at.left[at.closed :] < most_of(self.problem, at.segments[at.closed :], self.most)
        kept = max(at.closed + int(good.argmin()) if at.lost else len(good) + at.closed, 1)
        return replace(at, segments=at.segments[:kept], left=at.left[:kept])

    @property
    def _last(self) -> float:
        return float(self.problem.records[self.number].times[-1])

    def _after(self, time: float) -> float:
        """Some samples later."""
        times = self.problem.records[self.number].times
        return float(times[min(np.searchsorted(times, time) + RUN, len(times) - 1)])

    def _begun(self, moved: Floats, known: Knowledge) -> FollowedWalk:
        """The first horizon; of the first record from those numbers that leave least of it, of these and some that are
        drawn: which foot slips first is decided there, and descents hardly come back over it. Where records are taken
        up again it is from some that are drawn alone."""
        soon = self._after(0.0)
        at = FollowedWalk([self._standing(moved, soon)], 0, moved, known, known.covariance, np.ones(1))
        end = max(self._reach(at.segments[0], moved)[0], self._after(soon))
        plain = [] if self.seed and not self.number else [self._further(at, end)]
        if plain and (self.number or self._is_noise(plain[0])):
            return plain[0]
        drawn = self._drawn(at, replace(at.segments[0], span=(0.0, end)))
        begun = (replace(at, segments=[self._standing(one, soon)], moved=one) for one in drawn)
        each = [*plain, *(self._further(one, end) for one in begun)]
        return min(each or [self._further(at, end)], key=lambda one: one.cost)

    def _is_noise(self, at: FollowedWalk) -> bool:
        """Whether the open windows leave no more than noise does, where that is known: a descent that is there came to
        the numbers, or to what nothing so far distinguishes from them."""
        return not at.lost and bool(np.all(at.left < most_of(self.problem, at.segments, 1.0, NOISE)))

    def _grown(self, at: FollowedWalk) -> FollowedWalk:
        """Farther, as long as the record is followed, to its end at most: as far as it is predicted, less far, or past
        what is next, of which some more samples tell."""
        while at.reached < self._last:
            soon = self._after(at.reached)
            ends = [max(end, soon) for end in self._reach(at.segments[-1], at.moved)]
            tried = list[FollowedWalk]()
            for end in dict.fromkeys([*ends, self._after(self._after(soon))]):
                tried.append(self._further(at, end))
                if not tried[-1].lost:
                    break
            if tried[-1].lost:
                return min(tried, key=lambda one: one.reached)
            at = self._closed(tried[-1])
        return at

    def _further(self, at: FollowedWalk, end: float) -> FollowedWalk:
        """Fitted up to a time; lost, its last window not followed, where no robot takes the numbers that it goes down
        from."""
        try:
            return self._fitted(self._until(at, end))
        except InputError:
            return replace(at, left=np.append(at.left[:-1], np.inf), lost=True, cost=np.inf)

    def _standing(self, moved: Floats, end: float) -> Segment:
        """The first window, from the state in which the walker stands; feet that lie on the ground there are held."""
        plan = self.problem.lowered(moved, self.number)[1]
        begun = simulate_windows(plan, [WindowStart(plan.initial, 0.0, [end])])[0].events
        feet = sorted({int(i) for i in begun["foot"][begun["time"] == 0.0]})
        contacts = Contacts(feet, [0.0] * len(feet))
        return Segment(self.number, 0.0, (0.0, end), np.array(plan.initial), self.rest, contacts)

    def _reach(self, segment: Segment, moved: Floats) -> list[float]:
        """When the record leaves the prediction from a segment's start by so many times its noise, for each of
        `LEAVES`: looked for over twice as long as before, until it has."""
        record, length = self.problem.records[self.number], AHEAD
        times = record.times[record.times > segment.begin]
        while True:
            whole = replace(segment, span=(segment.begin, float(times[min(length, len(times)) - 1])))
            left = self.problem.residuals([whole], np.zeros((1, len(segment.state))), moved)[0]
            off = np.convolve(np.mean(left**2, axis=0), np.ones(RUN) / RUN, "same")
            gone = [np.flatnonzero(off > far**2) for far in LEAVES]
            if all(map(len, gone)) or length >= len(times):
                return [float(times[one[0]] if len(one) else whole.span[1]) for one in gone]
            length *= 2

    def _until(self, at: FollowedWalk, end: float) -> FollowedWalk:
        """The same up to a time, the last window in pieces of few events, cut in the longest stretch without one of the
        second half of each: near an event a start changes by more than any noise."""
        last = at.segments[-1]
        plan = self.problem.lowered(at.moved, self.number)[1]
        start = WindowStart(last.state, last.begin, [end], last.contacts)
        times = np.unique(simulate_windows(plan, [start])[0].events["time"])
        samples = np.searchsorted(self.problem.records[self.number].times, times)
        times = times[np.diff(samples, prepend=-1) > 0]  # within one sample a foot that chatters does so once
        times, edges = times[times > last.begin], list[float]()
        most = max(int(EVENTS * plan.feet), 3)
        while len(times) > most:
            later = times[most // 2 : most + 1]
            k = int(np.argmax(np.diff(later)))
            edges.append(float(0.5 * (later[k] + later[k + 1])))
            times = times[times > edges[-1]]
        ends = [*edges, end]
        window = simulate_windows(plan, [replace(start, times=ends)])[0]
        pieces = [replace(last, span=(last.span[0], ends[0]))]
        states = np.vstack([window.states.x, window.states.v]).T
        for edge, after, state in zip(edges, ends[1:], states[:-1], strict=True):
            gone = window.events[window.events["time"] <= edge]
            contacts = last.contacts.after(gone, last.begin, edge)
            pieces.append(Segment(self.number, edge, (edge, after), state, self.near, contacts))
        left = np.concatenate([at.left[: len(at.segments)], np.ones(len(edges))])
        return replace(at, segments=[*at.segments[:-1], *pieces], left=left)

    def _fitted(self, at: FollowedWalk) -> FollowedWalk:
        """The open windows after descents, as long as these gain."""
        cost = worst = np.inf
        for _ in range(AGAIN):
            opened = at.segments[at.closed :]
            fit = self.windows.solve(opened, at.moved, rounds=ROUNDS, known=at.known)
            segments = [*at.segments[: at.closed], *fit.segments]
            left = np.append(at.left[: at.closed], fit.left)
            at = replace(at, segments=segments, moved=fit.moved, covariance=_reached(fit), left=left, cost=fit.cost)
            most = most_of(self.problem, segments[at.closed :], self.most)
            worst = float(np.max(left[at.closed :] / most))
            if worst < 1.0 or worst > GAIN * cost:
                break
            cost = worst
        return replace(at, lost=worst > 1.0)

    def _elsewhere(self, at: FollowedWalk) -> FollowedWalk:
        """The farthest that is come to from other numbers, which are taken from the first open window on: of those that
        are drawn from what is known of them, the few from which this is predicted farthest and best."""
        first = replace(at.segments[at.closed], span=(at.segments[at.closed].span[0], at.reached))
        best = at
        for moved in self._drawn(at, first):
            begun = replace(first, span=(first.span[0], self._after(first.span[0])))
            segments, left = [*at.segments[: at.closed], begun], np.append(at.left[: at.closed], 1.0)
            other = self._grown(replace(at, segments=segments, moved=moved, left=left))
            if not other.lost or other.reached > best.reached:
                best = other
            if not other.lost or other.reached > self._after(at.reached):
                break
        return best

    def _drawn(self, at: FollowedWalk, segment: Segment) -> list[Floats]:
        """Numbers (np,) that are drawn from what is known and from where a walk is, the few by which a segment is
        predicted farthest and best."""
        random = np.random.default_rng([self.seed, self.number, int(1e6 * segment.span[1])])
        drawn = np.concatenate(
            [
                centre + by * random.standard_normal((DRAWN // 2, len(centre))) @ np.linalg.cholesky(spread).T
                for centre, by, spread in (
                    (at.known.centre, SPREAD, at.known.covariance),
                    (at.moved, 1.0 / SPREAD, at.covariance),
                )
            ]
        )
        costs = np.array([self._cost(segment, one) for one in drawn])
        return [drawn[k] for k in np.argsort(costs)[:TRIED] if np.isfinite(costs[k])]

    def _cost(self, segment: Segment, moved: Floats) -> float:
        """What a window leaves, every sample within what is far from its noise; infinite where no robot takes the
        numbers."""
        try:
            left = self.problem.residuals([segment], np.zeros((1, len(segment.state))), moved)[0]
        except InputError:
            return float(np.inf)
        return float(np.mean(np.minimum(left**2, LEAVES[0] ** 2)))

    def _closed(self, at: FollowedWalk) -> FollowedWalk:
        """The same with what is more than a few open windows closed."""
        count = len(at.segments) - at.closed - OPEN
        if count <= 0:
            return at
        old = at.segments[at.closed : at.closed + count]
        fit = self.windows.solve(old, at.moved, rounds=0, known=at.known)
        known = Knowledge.of(at.moved, _reached(fit))
        return replace(at, closed=at.closed + count, known=known)


def _reached(fit: RecordFit) -> Floats:
    """Covariance (np, np) of numbers, with the square of the step that a descent which was not settled had ahead."""
    return fit.covariance + np.outer(fit.ahead, fit.ahead)


def samples_of(problem: RecordProblem, segments: Sequence[Segment]) -> Floats:
    """How many samples (nw,) windows have of each channel."""
    times = [problem.records[one.record].times for one in segments]
    pairs = zip(times, segments, strict=True)
    return np.array([float(np.ptp(np.searchsorted(at, one.span, side="right"))) for at, one in pairs])


def most_of(problem: RecordProblem, segments: Sequence[Segment], most: float, scatter: float = SCATTER) -> Floats:
    """Mean squares (nw,) over the noise up to which windows are followed: so much, and so many standard deviations of
    their scatter."""
    channels = np.array([len(problem.records[one.record].channels) for one in segments])
    count = np.maximum(channels * samples_of(problem, segments), 1.0)
    return np.asarray(most + scatter * np.sqrt(2.0 / count), dtype=np.float64)
