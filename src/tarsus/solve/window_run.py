"""Windows as the engine runs them: many of one plan in one call, each from its own state at its own time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from tarsus.base.errors import InputError
from tarsus.core.states import SampledStates, states_of
from tarsus.plan.rows import Rows
from tarsus.solve.contacts import CARRIED, MOMENTS, Contacts
from tarsus.solve.engine import Continuations, Tables, Times, advance_many, end_to_end

if TYPE_CHECKING:
    from tarsus.base.workers import Workers
    from tarsus.core import _native
    from tarsus.plan.lowering import Plan

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]

TOGETHER = 16
"""Windows that a thread runs at least: fewer take less time than a thread takes to start."""


@dataclass(frozen=True)
class WindowStart:
    """Where one window starts, and what is asked of it.

    state (2n,): displacements and velocities [m, m/s]; t0 [s]: when it starts, at 0 or later, the drives' time; times
    (nt,) [s]: when outputs are wanted, in order, none before the start: the window ends with the last one; contacts:
    what the feet do at the start, by default none is held, or (m, k) what they carry on from a window before
    (`Window.feet`); data: number of the row of data that it runs on, or of what enters it.
    """

    state: npt.ArrayLike
    t0: float
    times: npt.ArrayLike
    contacts: Contacts | Floats = field(default_factory=Contacts)
    data: int = 0


@dataclass(frozen=True)
class WindowStarts:
    """Starts of nw windows as arrays: state (nw, 2n), t0 (nw,), sources (nw, 2): which of some data each runs on, and
    its row there, first (nw + 1,) of each one's times, feet (nw, m, k): what feet carry on to it."""

    state: Floats
    t0: Floats
    sources: Integers
    first: Integers
    times: Floats
    feet: Floats

    @classmethod
    def of(cls, plan: Plan, starts: Sequence[WindowStart], data: Sequence[Rows]) -> WindowStarts:
        """Raises InputError where a start does not fit the plan, or names data that are not there."""
        m, size, end = plan.feet, 2 * len(plan.system.mass), np.cumsum([0, *map(len, data)])
        states = [np.asarray(one.state, dtype=float) for one in starts]
        times = [np.atleast_1d(np.asarray(one.times, dtype=float)) for one in starts]
        for w, (one, state, when) in enumerate(zip(starts, states, times, strict=True)):
            problems = _problems(one, state, when, m, size)
            if not 0 <= one.data < end[-1]:
                problems.append(f"data: there is no number {one.data} (data are numbered 0 to {end[-1] - 1})")
            if problems:
                raise InputError(problems if len(starts) == 1 else [f"window {w}: {text}" for text in problems])
        feet = [
            one.contacts.carried(m, one.t0) if isinstance(one.contacts, Contacts) else one.contacts for one in starts
        ]
        number = np.array([one.data for one in starts], dtype=np.int64)
        source = np.searchsorted(end, number, side="right") - 1
        return cls(
            np.array(states).reshape(-1, size),
            np.array([one.t0 for one in starts], dtype=float),
            np.stack([source, number - end[source]], axis=1),
            np.cumsum([0, *map(len, times)], dtype=np.int64),
            np.concatenate([*times, np.zeros(0)]),
            np.array(feet, dtype=float).reshape(-1, m, len(CARRIED)),
        )

    def __len__(self) -> int:
        return len(self.t0)

    @property
    def ends(self) -> Floats:
        """Last time (nw,) [s] of each."""
        return self.times[self.first[1:] - 1]

    def taken(self, windows: Integers) -> WindowStarts:
        """Some of the windows."""
        if _all_of(windows, len(self)):
            return self
        at, first = gathered(self.first, windows)
        parts = {one.name: getattr(self, one.name)[windows] for one in fields(self) if one.name not in _TIMES}
        return WindowStarts(**parts, first=first, times=self.times[at])

    @classmethod
    def joined(cls, parts: Sequence[WindowStarts]) -> WindowStarts:
        """Several, one after the other."""
        whole = {one.name: np.concatenate([getattr(p, one.name) for p in parts]) for one in fields(cls)}
        return cls(**{**whole, "first": end_to_end([np.diff(p.first) for p in parts])})

    def denser(self, count: int) -> tuple[WindowStarts, Integers]:
        """The same with so many more times in each window; and where its own are among all."""
        window = np.repeat(np.arange(len(self)), count)
        between = np.tile((np.arange(count) + 0.5) / count, len(self))
        more = self.t0[window] + between * (self.ends - self.t0)[window]
        times = np.concatenate([self.times, more])
        of = np.concatenate([np.repeat(np.arange(len(self)), np.diff(self.first)), window])
        order = np.lexsort((times, of))
        place = np.empty_like(order)
        place[order] = np.arange(len(order))
        first = self.first + count * np.arange(len(self.first))
        return replace(self, times=times[order], first=first), place[: len(self.times)]

    def later(self, by: Floats) -> WindowStarts:
        """The same with starts later by so long (nw,) [s], at states and with times as they are, none before it. What
        begins with the window does so later; what began before has begun by then."""
        t0 = self.t0 + by
        own, then = self.t0[:, None, None], t0[:, None, None]
        feet, moments = self.feet.copy(), self.feet[..., MOMENTS]
        feet[..., MOMENTS] = np.where(moments == own, then, np.minimum(moments, then))
        return replace(self, t0=t0, times=np.maximum(self.times, np.repeat(t0, np.diff(self.first))), feet=feet)


_TIMES = ("first", "times")


def _problems(one: WindowStart, state: Floats, times: Floats, feet: int, size: int) -> list[str]:
    """Sentences on where a window's start or times do not fit a plan of so many feet and numbers of a state."""
    problems = []
    if isinstance(one.contacts, Contacts):
        problems += one.contacts.faults(feet, one.t0)
    elif np.shape(one.contacts) != (feet, len(CARRIED)):
        problems.append(f"contacts: expected {feet} rows of {len(CARRIED)} numbers, as a window before left them")
    if state.shape != (size,) or not np.isfinite(state).all():
        problems.append(f"state: expected {size} finite numbers, displacements and velocities")
    if not (math.isfinite(one.t0) and one.t0 >= 0.0):
        problems.append(f"t0: expected a time of 0 s or later, got {one.t0:g} s")
    ordered = times.ndim == 1 and len(times) > 0 and not np.any(np.diff(times) < 0.0)
    if not (ordered and one.t0 <= times[0] and one.t0 < times[-1] < math.inf):
        problems.append("times: expected times in order, none before the start and the last after it")
    return problems


@dataclass(frozen=True)
class Ran:
    """What windows came to: codes (nw,); events (ne, 12), those of window w from begin[w] to begin[w + 1]; states at
    times (nt,) [s] of all, end to end, those of window w from first[w] to first[w + 1]; ends (nw, 2n) and feet
    (nw, m, k)."""

    codes: Integers
    events: Floats
    begin: Integers
    states: SampledStates
    times: Floats
    first: Integers
    ends: Floats
    feet: Floats

    def taken(self, windows: Integers) -> Ran:
        """Some of them, in any order."""
        if _all_of(windows, len(self.codes)):
            return self
        events, begin = gathered(self.begin, windows)
        at, first = gathered(self.first, windows)
        return Ran(
            self.codes[windows],
            self.events[events],
            begin,
            self.states.part(at),
            self.times[at],
            first,
            self.ends[windows],
            self.feet[windows],
        )

    def at(self, samples: Integers, first: Integers) -> Ran:
        """With some of the samples alone, those of each window from first on."""
        return replace(self, states=self.states.part(samples), times=self.times[samples], first=first)

    @classmethod
    def joined(cls, parts: Sequence[Ran]) -> Ran:
        """Several, one after the other."""
        if len(parts) == 1:
            return parts[0]
        whole: dict[str, Any] = {
            name: np.concatenate([getattr(one, name) for one in parts])
            for name in ("codes", "events", "times", "ends", "feet")
        }
        whole |= {name: end_to_end([np.diff(getattr(one, name)) for one in parts]) for name in ("begin", "first")}
        return cls(states=all_states([one.states for one in parts]), **whole)


def _all_of(windows: Integers, count: int) -> bool:
    """Whether these are all windows as they stand."""
    return len(windows) == count and bool((windows == np.arange(count)).all())


def gathered(first: Integers, windows: Integers) -> tuple[Integers, Integers]:
    """Numbers of what windows have, end to end, and where each one's begin, from where those of all begin."""
    counts = np.diff(first)[windows]
    begin = end_to_end([counts])
    return np.arange(begin[-1]) + np.repeat(first[:-1][windows] - begin[:-1], counts), begin


def all_states(parts: Sequence[SampledStates]) -> SampledStates:
    """Samples of several windows."""

    def whole(name: str) -> Any:
        values = [getattr(one, name) for one in parts]
        return None if values[0] is None else np.concatenate(values, axis=1)

    return SampledStates(*(whole(one.name) for one in fields(SampledStates)))


def run_windows(
    plan: Plan,
    tables: Tables,
    data: Sequence[Rows],
    starts: WindowStarts,
    settings: _native.Settings,
    threads: Workers = None,
    *,
    forces: bool = True,
) -> Ran:
    """Run windows of a plan, on all threads where there are many; forces: whether states of a walker have gaps and
    forces of its feet."""
    parts = Continuations(starts.state, starts.t0, starts.ends, starts.feet, starts.sources)
    times = Times(starts.times, starts.first)
    made = advance_many(plan, tables, settings, data, parts, times, together=TOGETHER, threads=threads)
    if plan.legs is None:
        n, slides = len(plan.system.mass), plan.system.tangents is not None
        states, _ = states_of(made.samples, n, plan.feet, slides)
    elif forces:
        states = _walked(plan, starts, data, made.samples)
    else:
        from tarsus.solve.motion import walked

        states = walked(plan, made.samples)
    begin = np.concatenate([[0], made.event_end]).astype(np.int64)
    return Ran(made.codes, made.events, begin, states, starts.times, starts.first, made.states, made.feet)


def _walked(plan: Plan, starts: WindowStarts, data: Sequence[Rows], samples: Floats) -> SampledStates:
    """States of a walker by its samples, window by window on data of its own."""
    from tarsus.solve.motion import RunLaws, unpacked

    sources, of = np.unique(starts.sources, axis=0, return_inverse=True)
    of = np.repeat(of.ravel(), np.diff(starts.first))
    parts, order = [], []
    for k, (source, row) in enumerate(sources.tolist()):
        own = np.flatnonzero(of == k)
        acting = RunLaws(plan, data[source].taken(slice(row, row + 1)))
        parts.append(unpacked(acting, samples[own], starts.times[own])[0])
        order.append(own)
    return parts[0] if len(parts) == 1 else all_states(parts).part(np.argsort(np.concatenate(order)))
