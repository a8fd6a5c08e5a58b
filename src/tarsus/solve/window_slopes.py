"""Derivatives of windows by differences of windows beside them, event by event and sample by sample."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from tarsus.core import arrays as a
from tarsus.core.states import SampledStates
from tarsus.solve.differences import LEAST, STEP, better_step
from tarsus.solve.window_alike import Lost, NoSlope, alike, events_of
from tarsus.solve.window_copies import Copies, Lane
from tarsus.solve.window_differences import Differences, WindowValues
from tarsus.solve.window_run import Ran, WindowStarts, gathered

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]

AT_END = 1e-3
"""Last part of a window in which an event that another lacks is taken to come to that just beyond the end: over a step
events move by far less."""
SEEN = 8
"""Moments of each window that are looked at beside those that are asked for: at one alone a slope may be small by
chance, and neither what it changes by nor the noise then says anything."""
NARROW = 1e-2
"""Part of the first step of a second pair, where events of the first differ from the window's own."""
FARTHEST = 1e3
"""Times the first step to which another may be lengthened, for a number that is hardly felt: by a hundredth of it."""
UNSEEN = 10.0 * STEP
"""Part by which slopes that show no bend for noise may change over a first step all the same."""
SHOWN = ("x", "v", "gap", "rate", "resistive", "smooth", "pull")
"""What of sampled states has derivatives."""


class WindowFlag(NamedTuple):
    """That a window, by its number, has no derivative by a number, by its place, from a time [s] on; foot: whose event
    it is, -1 of none."""

    window: int
    number: int
    doubt: NoSlope
    time: float
    foot: int

    def __str__(self) -> str:
        foot = f"foot {self.foot}" if self.foot >= 0 else "the robot"
        return self.doubt.value.format(foot=foot, time=f"{self.time:.6g} s")


@dataclass(frozen=True)
class WindowSlopes:
    """Derivatives of a window, or of several, by P numbers, last axis; NaN from a moment on at which there is none.

    names (P,): paths, then ``state.i`` and ``t0``; states: of displacements and velocities (n, nt, P), and of gaps,
    gap rates, forces and pulls of the feet (m, nt, P), at fixed times; rows (ne, 12, P): of the event rows;
    state_errors and row_errors: what these may be off by; flags: why some are not there.
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
            self.names, self.states.part(samples), self.rows[events], self.state_errors.part(samples),
            self.row_errors[events], own,
        )  # fmt: skip


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
    starts: WindowStarts

    @cached_property
    def times(self) -> Floats:
        """Of samples (ns,) [s]."""
        return self.starts.times

    @property
    def moments(self) -> Floats:
        """Of events (ne,) [s]."""
        return self.own.events[:, a.E_TIME]

    def each_sample(self, values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Values (nw,) for all samples."""
        return np.repeat(values, np.diff(self.own.first))

    def each_event(self, values: Floats) -> Floats:
        """Values (nw,) for all events."""
        return np.repeat(values, np.diff(self.own.begin))

    @cached_property
    def shown(self) -> Floats:
        """Values (c, ns) of samples."""
        return _shown(self.own.states)

    @cached_property
    def _keys(self) -> npt.NDArray[np.complex128]:
        """Samples in order, window by window: of complex numbers the real part, here the window, goes before."""
        window = self.each_sample(np.arange(len(self.own.codes)))
        return np.asarray(window + 1j * self.times, dtype=np.complex128)

    def side(self, other: Ran, doubt: NoSlope = NoSlope.OTHERWISE) -> _Side:
        """What other windows show of these."""
        late = self.starts.ends - AT_END * (self.starts.ends - self.starts.t0)
        place, since, lost = alike(self.own, other, late, doubt)
        has, states = place >= 0, other.states
        rows = np.where(has[:, None], _taken(other.events, place), self.own.events)
        crossed = self._crossed(self.moments, rows[:, a.E_TIME])
        valid = (
            ~crossed
            & (self.times < self.each_sample(since))
            & (states.held == self.own.states.held).all(axis=0)
        )
        if states.contact is not None:
            valid &= (states.contact == self.own.states.contact).all(axis=0)
        return _Side(_shown(states), valid, rows, has & (self.moments < self.each_event(since)), lost)

    def _crossed(self, here: Floats, there: Floats) -> Flags:
        """Samples between two moments of some event."""
        of = events_of(self.own)
        low = np.searchsorted(self._keys, of + 1j * np.minimum(here, there), side="left")
        high = np.searchsorted(self._keys, of + 1j * np.maximum(here, there), side="right")
        out = np.zeros(len(self.times), dtype=bool)
        for k in np.flatnonzero((low < high) & (here != there)).tolist():
            out[low[k] : high[k]] = True
        return out

    @cached_property
    def _other(self) -> _Side:
        return self.side(self.finer, NoSlope.UNSURE)

    def values(self, sides: Sequence[_Side], weights: Floats) -> tuple[WindowValues, WindowValues]:
        """Of samples, and of events (12, ne); weights (n,): of coordinates."""
        one, two, finer = *sides, self._other
        sizes = np.cumsum([0, *(len(getattr(self.own.states, name)) for name in SHOWN)]).tolist()
        every = np.ones(sizes[-1])
        every[: 2 * len(weights)] = np.tile(weights, 2)
        each = [slice(k, k + 1) for k in range(a.EVENT_WIDTH)]
        return (
            WindowValues(
                self.shown, np.where(finer.valid, finer.shown, self.shown), (one.shown, two.shown),
                np.array([one.valid, two.valid]), self.own.first, [slice(*ends) for ends in pairwise(sizes)], every,
            ),
            WindowValues(
                self.own.events.T, finer.rows.T, (one.rows.T, two.rows.T), np.array([one.has, two.has]),
                self.own.begin, each, np.ones(a.EVENT_WIDTH),
            ),
        )  # fmt: skip

    def lost(self, sides: Sequence[_Side]) -> Lost:
        """From when on there are no derivatives, where events of any part."""
        out = Lost.none(len(self.own.codes))
        for one in (side.lost for side in (self._other, *sides)):
            for w in np.flatnonzero(one.time < out.time).tolist():
                out.or_from(float(one.time[w]), w, int(one.foot[w]), one.doubt[w])
        return out

    def add_kinks(self, lost: Lost, samples: Flags, events: Flags) -> None:
        """Nor are there any where all samples to the end have a kink, or from the first event on that has: of a single
        sample, an edge of a drive lies there."""
        for w in np.flatnonzero(samples[self.own.first[1:] - 1]).tolist():
            begin, end = self.own.first[w : w + 2]
            smooth = np.flatnonzero(~samples[begin:end])
            first = begin + (smooth[-1] + 1 if len(smooth) else 0)
            time, foot = float(self.times[first]), -1
            own = np.arange(*self.own.begin[w : w + 2])
            kinked = own[events[own]]
            if len(kinked) and self.moments[kinked[0]] <= time:
                time, foot = float(self.moments[kinked[0]]), int(self.own.events[kinked[0], a.E_FOOT])
            lost.or_from(time, w, foot, NoSlope.KINKED)


def _taken(values: Floats, at: Integers) -> Floats:
    """Values at places, of none anything."""
    return values[np.maximum(at, 0)] if len(values) else np.zeros((len(at), *values.shape[1:]))


def _shown(states: SampledStates) -> Floats:
    return np.concatenate([getattr(states, name) for name in SHOWN])


@dataclass(frozen=True)
class _LaneSlopes:
    """Derivatives of the windows of a lane: samples (2, c, ns) and rows (2, 12, ne), each with errors, and from when on
    there are none; bent and noise (nl,): parts of slopes."""

    samples: Floats
    rows: Floats
    lost: Lost
    bent: Floats
    noise: Floats

    @property
    def error(self) -> Floats:
        return self.bent**2 + self.noise


@dataclass(frozen=True)
class Differenced:
    """Windows, the same in other steps, and the derivatives of the first by what lies beside them."""

    copies: Copies
    own: Ran
    finer: Ran

    def slopes(self, names: tuple[str, ...]) -> WindowSlopes:
        """All of them, in the order of names; of each number one pair of windows, or two."""
        every, count = np.arange(len(self.own.codes)), len(names)
        first = self.copies.lanes([(k, 1.0, every) for k in range(count)])
        best = {lane.number: (lane.windows, self._found(lane)) for lane in first}
        for lane in self.copies.lanes([one for k, of in best.items() for one in self._again(k, *of)]):
            windows, found = best[lane.number]
            best[lane.number] = windows, self._better(windows, found, lane)
        return self._gathered(names, best)

    @property
    def _weights(self) -> Floats:
        """By how much a coordinate (n,) moves feet."""
        moves = np.abs(self.copies.plan.system.normals).max(axis=1, initial=0.0)
        return np.where(moves > 0.0, moves, 1.0)

    def _base(self, windows: Integers) -> _Base:
        if len(windows) < len(self.own.codes):
            return _Base(
                self.own.taken(windows), self.finer.taken(windows), self.copies.starts.taken(windows)
            )
        return self._whole

    @cached_property
    def _whole(self) -> _Base:
        return _Base(self.own, self.finer, self.copies.starts)

    def _found(self, lane: Lane) -> _LaneSlopes:
        """Derivatives by what a lane came to."""
        base = self._base(lane.windows)
        n, steps = len(self.copies.plan.system.mass), lane.steps
        sides = [base.side(ran) for ran in lane.ran]
        if self.copies.by.t0 and lane.number == self.copies.moment:
            for side, place in zip(sides, lane.places, strict=True):
                side.valid[base.times < base.each_sample(base.starts.t0 + place * steps)] = False
        samples, rows = (Differences(values, lane.places) for values in base.values(sides, self._weights))
        bent, noise = (_filled(np.fmax.reduce(one[:2])) for one in (samples.bents, samples.noises))
        lost = base.lost(sides)
        base.add_kinks(lost, np.asarray(samples.kinked[: 2 * n].any(axis=0)), rows.kinked[a.E_TIME])
        parts = []
        for one, gone in (
            (samples, base.times >= base.each_sample(lost.time)),
            (rows, base.moments >= base.each_event(lost.time)),
        ):
            error = one.error(bent) + one.values.each(lane.rounded) * np.abs(one.slope)
            found = np.array([one.slope, error]) / one.values.each(steps)
            found[:, one.kinked | gone] = np.nan
            parts.append(found)
        return _LaneSlopes(parts[0], parts[1], lost, bent, noise + lane.rounded)

    def _again(self, number: int, windows: Integers, found: _LaneSlopes) -> list[tuple[int, float, Integers]]:
        """Second pairs: narrow ones of windows where events differ, and where the first pair leaves too much another
        step for all others."""
        lost = np.isfinite(found.lost.time)
        out = [(number, NARROW, windows[lost])] if lost.any() else []
        if not lost.all() and float(np.median(found.error[~lost])) > self.copies.by.enough:
            noise = float(np.median(found.noise[~lost]))
            bent = max(float(np.median(found.bent[~lost])), min(noise, UNSEEN))
            factor = float(np.clip(better_step(bent, noise), LEAST, FARTHEST))
            if factor != 1.0:
                out.append((number, factor, windows[~lost]))
        return out

    def _better(self, windows: Integers, first: _LaneSlopes, lane: Lane) -> _LaneSlopes:
        """The first pair's, with those of a second one where that is followed longer, or as long and better."""
        second, at = self._found(lane), np.searchsorted(windows, lane.windows)
        longer = second.lost.time > first.lost.time[at]
        chosen = np.flatnonzero(
            longer | ((second.lost.time == first.lost.time[at]) & (second.error < first.error[at]))
        )
        base = self._base(windows)
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

    def _gathered(
        self, names: tuple[str, ...], best: Mapping[int, tuple[Integers, _LaneSlopes]]
    ) -> WindowSlopes:
        own, flags = self.own, list[WindowFlag]()
        samples = np.zeros((2, len(self._whole.shown), len(self._whole.times), len(names)))
        rows = np.zeros((2, a.EVENT_WIDTH, len(own.events), len(names)))
        for number, (windows, found) in best.items():
            samples[:, :, gathered(own.first, windows)[0], number] = found.samples
            rows[:, :, gathered(own.begin, windows)[0], number] = found.rows
            flags += [
                WindowFlag(
                    int(windows[w]),
                    number,
                    found.lost.doubt[w],
                    float(found.lost.time[w]),
                    int(found.lost.foot[w]),
                )
                for w in np.flatnonzero(found.lost.time < np.inf).tolist()
            ]
        sizes = np.cumsum([len(getattr(own.states, name)) for name in SHOWN])
        states = [_sampled(np.split(part, sizes[:-1]), own.states.held) for part in samples]
        slopes, errors = rows.swapaxes(1, 2)
        return WindowSlopes(
            names, states[0], slopes, states[1], errors, tuple(sorted(flags, key=lambda one: one[:2]))
        )


def _sampled(parts: Sequence[Floats], held: Flags) -> SampledStates:
    x, v, gap, rate, resistive, smooth, pull = parts
    return SampledStates(x, v, gap, rate, resistive, smooth, pull, held)


def _filled(parts: Floats) -> Floats:
    """Parts (nw,) of windows; of one without any the largest of all others."""
    return np.where(np.isnan(parts), np.nanmax(parts, initial=0.0), parts)
