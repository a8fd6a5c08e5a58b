"""Derivatives of windows, and of runs, which are windows from their start, by differences of perturbed copies, event by
event and sample by sample."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from tarsus.core import arrays as a
from tarsus.core.states import SampledStates
from tarsus.plan.lowering import Plan
from tarsus.solve.differences import LEAST, STEP, Differences, MotionValues, better_step
from tarsus.solve.window_run import Ran, gathered

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]

TOGETHER = 2**15
"""Samples of windows whose derivatives are formed at once: of some fifty values each they take 13 MB an array."""
NARROW = 1e-2
"""Part of a step of another pair, where events of the first differ from the window's own: what nobody could set is no
side of a threshold."""
UNSEEN = 10.0 * STEP
"""Part by which slopes that show no bend for noise may change over a first step all the same."""
SHOWN = ("x", "v", "gap", "rate", "resistive", "smooth", "pull", "friction")
"""What of sampled states has derivatives, where there is any."""
JUDGED = [a.E_TIME, a.E_BEFORE]
"""What of events it is judged by how much motions respond, where there are no samples: what the others follow from."""


class NoSlope(Enum):
    """Why there is no derivative of what comes after some moment; the value is a sentence."""

    OTHERWISE = "{foot} touches or leaves the ground otherwise from {time} on where the number is a little another"
    KINKED = "to both sides of the number {foot} moves otherwise at {time}: an edge or a threshold lies there"
    UNSURE = "what {foot} does at {time} is within the error of a step"
    STOPPED = "with the number a little another the motion stops before its end"

    def said(self, foot: str, time: float) -> str:
        """The sentence."""
        return self.value.format(foot=foot, time=f"{time:.6g} s")


class Lost(NamedTuple):
    """From when on windows have no derivative: times (nw,) [s], infinite of those that have one to the end, feet, -1
    of none, and reasons."""

    time: Floats
    foot: Integers
    doubt: list[NoSlope]

    @classmethod
    def none(cls, count: int) -> Lost:
        """That none has lost any."""
        return cls(np.full(count, np.inf), np.full(count, -1, dtype=np.int64), [NoSlope.OTHERWISE] * count)

    @classmethod
    def first(cls, each: Sequence[Lost]) -> Lost:
        """From the earliest of several moments on."""
        out = cls.none(len(each[0].time))
        for one in each:
            for w in np.flatnonzero(one.time < out.time).tolist():
                out.or_from(float(one.time[w]), w, int(one.foot[w]), one.doubt[w])
        return out

    def part(self, windows: slice) -> Lost:
        """That of some windows."""
        return Lost(self.time[windows], self.foot[windows], self.doubt[windows])

    def or_from(self, time: float, window: int, foot: int, doubt: NoSlope) -> None:
        """Note that one has none from a time on, unless it has none from an earlier one."""
        if time < self.time[window]:
            self.time[window], self.foot[window], self.doubt[window] = time, foot, doubt


class EventsAlike(NamedTuple):
    """Events of other windows as those of windows: place (ne,) of the other's, -1 of none; since (nw,): from when on
    [s] they are not the same; lost: where that is no matter of the end."""

    place: Integers
    since: Floats
    lost: Lost

    @classmethod
    def of(cls, own: Ran, other: Ran, late: Floats, doubt: NoSlope) -> EventsAlike:
        """Foot by foot the same kinds of events one after the other: feet far from each other may change places. late
        (nw,) [s]: from when on events may be missing."""
        columns, nw = [a.E_FOOT, a.E_KIND], len(own.codes)
        out = cls(np.full(len(own.events), -1, dtype=np.int64), np.full(nw, np.inf), Lost.none(nw))
        same = np.diff(own.begin) == np.diff(other.begin)
        alike = np.flatnonzero(same)
        here, first = gathered(own.begin, alike)
        there, _ = gathered(other.begin, alike)
        differs = (own.events[here][:, columns] != other.events[there][:, columns]).any(axis=1)
        out.place[here] = there
        apart = np.unique(np.searchsorted(first, np.flatnonzero(differs), side="right") - 1)
        for w in [*alike[apart].tolist(), *np.flatnonzero(~same).tolist()]:
            time, foot = out._match(own, other, w)
            out.since[w] = time
            if time < late[w]:
                out.lost.or_from(time, w, foot, doubt)
        for w in np.flatnonzero(own.codes != other.codes).tolist():
            out.since[w] = -np.inf
            out.lost.or_from(-np.inf, w, -1, NoSlope.STOPPED)
        return out

    def _match(self, own: Ran, other: Ran, window: int) -> tuple[float, int]:
        """Put the events of one window into places; from when on [s] there are others, and which foot begins with it,
        -1 of none."""
        mine, theirs = (np.arange(*one.begin[window : window + 2]) for one in (own, other))
        self.place[mine], parting = -1, (np.inf, -1)
        feet = own.events[mine, a.E_FOOT], other.events[theirs, a.E_FOOT]
        for foot in np.unique(np.concatenate(feet)):
            here, there = (of[feet_of == foot] for of, feet_of in zip((mine, theirs), feet, strict=True))
            count = min(len(here), len(there))
            same = own.events[here[:count], a.E_KIND] == other.events[there[:count], a.E_KIND]
            alike = count if same.all() else int(np.argmin(same))
            self.place[here[:alike]] = there[:alike]
            rest = ((own, here[alike:]), (other, there[alike:]))
            after = [float(of.events[at[0], a.E_TIME]) for of, at in rest if len(at)]
            parting = min(parting, (min(after, default=np.inf), int(foot)))
        return parting


class Lane(NamedTuple):
    """Perturbed copies of some windows, two of each, along one number: its place among all, the part of the first step
    that the steps are, the windows (nl,), places (2,) in steps, of which the nearest is one away, steps (nl,), the part
    (nl,) of them that is rounded off, what both came to, and from when on (nl,) [s] each counts."""

    number: int
    factor: float
    windows: Integers
    places: Floats
    steps: Floats
    rounded: Floats
    ran: tuple[Ran, Ran]
    since: tuple[Floats, Floats] | None = None
    runs: tuple[Any, ...] = ()

    def stacks_with(self, other: Lane) -> bool:
        """Whether derivatives by both can be formed at once."""
        apart = self.since is not None or other.since is not None or self.runs or other.runs
        return not apart and np.array_equal(self.places, other.places)


Wanted = tuple[int, float, Integers]
"""A lane of a number, at a part of the first step and for some windows."""


def weights_of(plan: Plan) -> Floats:
    """By how much a coordinate (n,) moves feet."""
    moves = np.abs(plan.system.normals).max(axis=1, initial=0.0)
    return np.where(moves > 0.0, moves, 1.0)


class WindowFlag(NamedTuple):
    """That a window, by its number, has no derivative by a number, by its place, from a time [s] on; foot: whose event
    it is, -1 of none."""

    window: int
    number: int
    doubt: NoSlope
    time: float
    foot: int

    def __str__(self) -> str:
        return self.doubt.said(f"foot {self.foot}" if self.foot >= 0 else "the robot", self.time)


@dataclass(frozen=True)
class WindowSlopes:
    """Derivatives of a window, or of several, by P numbers, last axis; NaN from a moment on at which there is none.

    names (P,): paths, then ``state.i`` and ``t0``; states: of displacements and velocities (n, nt, P), and of gaps,
    gap rates, forces and pulls of the feet (m, nt, P), at fixed times; rows (ne, 12, P): of the event rows;
    state_errors and row_errors: their possible errors; flags: why some are not there.
    """

    names: tuple[str, ...]
    states: SampledStates
    rows: Floats
    state_errors: SampledStates
    row_errors: Floats
    flags: tuple[WindowFlag, ...]

    def at(self, samples: Integers) -> WindowSlopes:
        """At some of the times."""
        return replace(self, states=self.states.part(samples), state_errors=self.state_errors.part(samples))

    def part(self, window: int, samples: slice, events: slice) -> WindowSlopes:
        """Those of one window."""
        own = tuple(one._replace(window=0) for one in self.flags if one.window == window)
        return WindowSlopes(
            self.names,
            self.states.part(samples),
            self.rows[events],
            self.state_errors.part(samples),
            self.row_errors[events],
            own,
        )


class _Side(NamedTuple):
    """One side of a lane: values (c, ns) of its samples and which (ns,) are on the same side of all events as the
    windows' own; its events (ne, 12) as theirs and which (ne,) it has; from when on they part."""

    shown: Floats
    valid: Flags
    rows: Floats
    has: Flags
    lost: Lost


@dataclass(frozen=True)
class _Base:
    """Windows and the same in other steps."""

    own: Ran
    finer: Ran
    late: Floats

    @property
    def moments(self) -> Floats:
        """Of events (ne,) [s]."""
        return self.own.events[:, a.E_TIME]

    def each_sample(self, values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Values (nw,) for all samples."""
        return np.repeat(values, np.diff(self.own.first))

    def each_event(self, values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Values (nw,) for all events."""
        return np.repeat(values, np.diff(self.own.begin))

    @cached_property
    def shown(self) -> Floats:
        """Values (c, ns) of samples."""
        return shown_rows(self.own.states)

    @cached_property
    def _keys(self) -> npt.NDArray[np.complex128]:
        """Samples in order, window by window: of complex numbers the real part, here the window, goes before."""
        window = self.each_sample(np.arange(len(self.own.codes)))
        return np.asarray(window + 1j * self.own.times, dtype=np.complex128)

    def side(self, other: Ran, doubt: NoSlope = NoSlope.OTHERWISE, since: Floats | None = None) -> _Side:
        """What other windows show of these, of samples from some moments (nw,) on."""
        alike, states, times = (EventsAlike.of(self.own, other, self.late, doubt), other.states, self.own.times)
        has = alike.place >= 0
        rows = np.where(has[:, None], _taken(other.events, alike.place), self.own.events)
        valid = (
            ~self._crossed(self.moments, rows[:, a.E_TIME])
            & (times < self.each_sample(alike.since))
            & (states.held == self.own.states.held).all(axis=0)
        )
        if states.contact is not None:
            valid &= (states.contact == self.own.states.contact).all(axis=0)
        if since is not None:
            valid &= times >= self.each_sample(since)
        has &= self.moments < self.each_event(alike.since)
        return _Side(shown_rows(states), valid, rows, has, alike.lost)

    def _crossed(self, here: Floats, there: Floats) -> Flags:
        """Samples between two moments of some event."""
        of = self.each_event(np.arange(len(self.own.codes)))
        low = np.searchsorted(self._keys, of + 1j * np.minimum(here, there), side="left")
        high = np.searchsorted(self._keys, of + 1j * np.maximum(here, there), side="right")
        out = np.zeros(len(self.own.times), dtype=bool)
        for k in np.flatnonzero((low < high) & (here != there)).tolist():
            out[low[k] : high[k]] = True
        return out

    @cached_property
    def other(self) -> _Side:
        return self.side(self.finer, NoSlope.UNSURE)

    def values(self, sides: Sequence[_Side], weights: Floats) -> tuple[MotionValues, MotionValues]:
        """Of samples, and of events (12, ne); weights (n,): of coordinates."""
        one, two, finer = *sides, self.other
        sizes = np.cumsum([0, *map(len, _shown(self.own.states).values())]).tolist()
        every = np.ones(sizes[-1])
        every[: 2 * len(weights)] = np.tile(weights, 2)
        each = [slice(k, k + 1) for k in range(a.EVENT_WIDTH)]
        return (
            MotionValues(
                self.shown,
                np.where(finer.valid, finer.shown, self.shown),
                (one.shown, two.shown),
                np.array([one.valid, two.valid]),
                self.own.first,
                [slice(*ends) for ends in pairwise(sizes)],
                every,
            ),
            MotionValues(
                self.own.events.T,
                finer.rows.T,
                (one.rows.T, two.rows.T),
                np.array([one.has, two.has]),
                self.own.begin,
                each,
                np.ones(a.EVENT_WIDTH),
                of_events=True,
            ),
        )

    def kinks(self, samples: Flags, events: Flags) -> Lost:
        """There are no derivatives where all samples to the end have a kink, nor from the first event on that has: of a
        single sample, an edge of a drive lies there."""
        out, first = Lost.none(len(self.own.codes)), self.own.first
        window = self.each_event(np.arange(len(self.own.codes)))
        for k in np.flatnonzero(events).tolist():
            row = self.own.events[k]
            out.or_from(float(row[a.E_TIME]), int(window[k]), int(row[a.E_FOOT]), NoSlope.KINKED)
        for w in np.flatnonzero(np.diff(first) > 1).tolist() if samples.any() else []:
            begin, end = first[w : w + 2]
            smooth = np.flatnonzero(~samples[begin:end])
            if samples[end - 1]:
                since = begin + (smooth[-1] + 1 if len(smooth) else 0)
                out.or_from(float(self.own.times[since]), w, -1, NoSlope.KINKED)
        return out


def _taken(values: Floats, at: Integers) -> Floats:
    """Values at places, of none anything."""
    return values[np.maximum(at, 0)] if len(values) else np.zeros((len(at), *values.shape[1:]))


def _shown(states: SampledStates) -> dict[str, Floats]:
    each = {name: getattr(states, name) for name in SHOWN}
    return {name: one for name, one in each.items() if one is not None}


def shown_rows(states: SampledStates) -> Floats:
    """Rows (c, ns) of all that has derivatives."""
    return np.concatenate(list(_shown(states).values()))


def as_states(rows: Floats, like: SampledStates) -> SampledStates:
    """The rows as states."""
    shown = _shown(like)
    parts = np.split(rows, np.cumsum(list(map(len, shown.values())))[:-1])
    return SampledStates(**dict(zip(shown, parts, strict=True)), held=like.held, contact=like.contact)


def no_states(coordinates: int, feet: int) -> SampledStates:
    """Those of no sample."""
    n, m = np.zeros((coordinates, 0)), np.zeros((feet, 0))
    return SampledStates(n, n, m, m, m, m, m, m.astype(bool))


@dataclass(frozen=True)
class LaneSlopes:
    """Derivatives of the windows of a lane: samples (2, c, ns) and rows (2, 12, ne), each with errors, and from when on
    there are none; bent and noise (nl,): parts of slopes; reasons: all why there are none, of the sides, of the windows
    in other steps, and kinks."""

    lane: Lane
    samples: Floats
    rows: Floats
    lost: Lost
    bent: Floats
    noise: Floats
    reasons: tuple[Lost, ...]

    @property
    def error(self) -> Floats:
        return self.bent**2 + self.noise

    def part(self, lane: Lane, windows: slice, samples: slice, events: slice) -> LaneSlopes:
        """Those of one of the lanes that these are of."""
        reasons = tuple(one.part(windows) for one in self.reasons)
        return LaneSlopes(
            lane,
            self.samples[:, :, samples],
            self.rows[:, :, events],
            self.lost.part(windows),
            self.bent[windows],
            self.noise[windows],
            reasons,
        )


@dataclass(frozen=True)
class Differenced:
    """Windows, the same in other steps, and the derivatives of the first by their perturbed copies.

    late (nw,) [s]: from when on an event may be missing that comes just beyond a window's end; lanes: makes lanes, none
    of numbers that may not vary so far; weights (n,): by how much coordinates move feet.
    enough: part of slopes that their errors may be before other pairs are made, in better steps; tries: how often that
    is; farthest: times the first step to which another may be lengthened.
    """

    own: Ran
    finer: Ran
    late: Floats
    lanes: Callable[[Sequence[Wanted]], list[Lane]]
    weights: Floats
    enough: float
    tries: int
    farthest: float

    def best(self, count: int) -> dict[int, LaneSlopes]:
        """Derivatives by each of so many numbers: of one pair of windows, or of better ones."""
        every = np.arange(len(self.own.codes))
        last = self._of_all(self.lanes([(k, 1.0, every) for k in range(count)]))
        best = {one.lane.number: one for one in last}
        for _ in range(self.tries):
            wanted = [again for one in last for again in self._again(one)]
            last = self._of_all(self.lanes(wanted))
            for one in last:
                best[one.lane.number] = self._better(best[one.lane.number], one)
        return best

    def _of_all(self, lanes: Sequence[Lane]) -> list[LaneSlopes]:
        """Derivatives by what lanes came to, of as many at once as `TOGETHER` has room for."""
        out, stack, filled = list[LaneSlopes](), list[Lane](), 0
        for lane in lanes:
            samples = int(np.diff(self.own.first)[lane.windows].sum())
            if stack and not (lane.stacks_with(stack[0]) and filled + samples <= TOGETHER):
                out += self._stacked(stack)
                stack, filled = [], 0
            stack.append(lane)
            filled += samples
        return out + (self._stacked(stack) if stack else [])

    def _stacked(self, lanes: Sequence[Lane]) -> list[LaneSlopes]:
        """Derivatives by what some lanes came to, as of one lane of all their windows."""
        if len(lanes) == 1:
            return [self.found(lanes[0])]
        first = lanes[0]
        windows, steps, rounded = (
            np.concatenate([getattr(one, name) for one in lanes]) for name in ("windows", "steps", "rounded")
        )
        sides = Ran.joined([one.ran[0] for one in lanes]), Ran.joined([one.ran[1] for one in lanes])
        found = self.found(first._replace(windows=windows, steps=steps, rounded=rounded, ran=sides))
        edges = np.cumsum([0, *(len(one.windows) for one in lanes)])
        samples, events = (
            np.concatenate([[0], np.cumsum(np.diff(begin)[windows])])[edges]
            for begin in (self.own.first, self.own.begin)
        )
        return [
            found.part(lane, slice(*edges[k : k + 2]), slice(*samples[k : k + 2]), slice(*events[k : k + 2]))
            for k, lane in enumerate(lanes)
        ]

    def _base(self, windows: Integers) -> _Base:
        if np.array_equal(windows, np.arange(len(self.own.codes))):
            return self._whole
        return _Base(self.own.taken(windows), self.finer.taken(windows), self.late[windows])

    @cached_property
    def _whole(self) -> _Base:
        return _Base(self.own, self.finer, self.late)

    def found(self, lane: Lane, bent: Floats | None = None) -> LaneSlopes:
        """Derivatives by what a lane came to; bent (nl,): by which part slopes change over a step, where that is known
        from elsewhere, and kinks with it."""
        base = self._base(lane.windows)
        since = lane.since or (None, None)
        sides = [base.side(ran, since=when) for ran, when in zip(lane.ran, since, strict=True)]
        samples, rows = (Differences(values, lane.places) for values in base.values(sides, self.weights))
        judge, fields = (samples, [0, 1]) if len(base.own.times) else (rows, JUDGED)
        own, noise = (_filled(np.fmax.reduce(one[fields])) for one in (judge.bents, judge.noises))
        known = bent is not None
        bent = own if bent is None else bent
        reasons = [*(side.lost for side in sides), base.other.lost]
        if not known:
            kinked = samples.kinked[: 2 * len(self.weights)].any(axis=0)
            reasons.append(base.kinks(np.asarray(kinked), np.asarray(rows.kinked[JUDGED].any(axis=0))))
        lost = Lost.first(reasons)
        parts = []
        for one, gone in (
            (samples, base.own.times >= base.each_sample(lost.time)),
            (rows, base.moments >= base.each_event(lost.time)),
        ):
            error = one.error(bent) + one.values.each(lane.rounded) * np.abs(one.slope)
            found = np.array([one.slope, error]) / one.values.each(lane.steps)
            found[:, gone | (one.kinked & (not known))] = np.nan
            parts.append(found)
        return LaneSlopes(lane, parts[0], parts[1], lost, bent, noise + lane.rounded, tuple(reasons))

    def _again(self, found: LaneSlopes) -> Iterator[Wanted]:
        """Other pairs: narrow ones of windows where events differ, and where this one leaves too much another step for
        all others."""
        lane, lost = found.lane, np.isfinite(found.lost.time)
        factors = [(NARROW, lost)] if lost.any() else []
        if not lost.all() and float(np.median(found.error[~lost])) > self.enough:
            noise = float(np.median(found.noise[~lost]))
            bent = max(float(np.median(found.bent[~lost])), min(noise, UNSEEN))
            factors.append((better_step(bent, noise), ~lost))
        for factor, which in factors:
            new = float(np.clip(lane.factor * factor, LEAST, self.farthest))
            if new != lane.factor:
                yield lane.number, new, lane.windows[which]

    def _better(self, first: LaneSlopes, second: LaneSlopes) -> LaneSlopes:
        """The first pair's, with those of a second one where that is followed longer, or as long and better; the second
        errs by as much as the two differ beyond the error of the first, for no bend over its step may show it."""
        windows, at = first.lane.windows, np.searchsorted(first.lane.windows, second.lane.windows)
        base = self._base(windows)
        for part, own, begin in (
            (first.samples, second.samples, base.own.first),
            (first.rows, second.rows, base.own.begin),
        ):
            had = part[:, :, gathered(begin, at)[0]]
            own[1] = np.where(np.isnan(own[1]), np.nan, np.fmax(own[1], np.abs(own[0] - had[0]) - had[1]))
        longer = second.lost.time > first.lost.time[at]
        better = longer | ((second.lost.time == first.lost.time[at]) & (second.error < first.error[at]))
        if better.all() and len(better) == len(windows):
            return second
        chosen = np.flatnonzero(better)
        for part, own, begin in (
            (first.samples, second.samples, base.own.first),
            (first.rows, second.rows, base.own.begin),
        ):
            to, _ = gathered(begin, at[chosen])
            of, _ = gathered(np.concatenate([[0], np.cumsum(np.diff(begin)[at])]), chosen)
            part[:, :, to] = own[:, :, of]
        for k in chosen.tolist():
            w = int(at[k])
            first.lost.time[w], first.lost.foot[w] = second.lost.time[k], second.lost.foot[k]
            first.lost.doubt[w] = second.lost.doubt[k]
            first.bent[w], first.noise[w] = second.bent[k], second.noise[k]
        return first

    def slopes(self, names: tuple[str, ...]) -> WindowSlopes:
        """All of them, in the order of names."""
        own, flags, count = self.own, list[WindowFlag](), len(names)
        samples = np.zeros((2, len(self._whole.shown), len(self._whole.own.times), count))
        rows = np.zeros((2, a.EVENT_WIDTH, len(own.events), count))
        for number, found in self.best(count).items():
            windows, lost = found.lane.windows, found.lost
            samples[:, :, gathered(own.first, windows)[0], number] = found.samples
            rows[:, :, gathered(own.begin, windows)[0], number] = found.rows
            flags += [
                WindowFlag(int(windows[w]), number, lost.doubt[w], float(lost.time[w]), int(lost.foot[w]))
                for w in np.flatnonzero(lost.time < np.inf).tolist()
            ]
        states, state_errors = (as_states(part, own.states) for part in samples)
        slopes, errors = rows.swapaxes(1, 2)
        flags.sort(key=lambda one: one[:2])
        return WindowSlopes(names, states, slopes, state_errors, errors, tuple(flags))


def _filled(parts: Floats) -> Floats:
    """Parts (nw,) of windows; of one without any the largest of all others."""
    return np.where(np.isnan(parts), np.nanmax(parts, initial=0.0), parts)
