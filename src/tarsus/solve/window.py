"""Windows: a plan run from any moments and states, with outputs at any times, and derivatives of these."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from tarsus.base.errors import InputError
from tarsus.base.events import FootState
from tarsus.core import _native
from tarsus.core import arrays as a
from tarsus.core.modes import NODES, ModeBook
from tarsus.core.replay import SampledStates, shown_states
from tarsus.plan.lowering import ahead_only
from tarsus.plan.slots import Rows, rows_of
from tarsus.solve.acting import Acting
from tarsus.solve.codes import EVENT_TYPE, ResultCode, event_places, structured_events, without_marks
from tarsus.solve.contacts import CARRIED, Contacts
from tarsus.solve.engine import RECORDED, Accuracy, book_of, settings_of, tables_of
from tarsus.solve.lanes import Doubt, copies_of, doubted
from tarsus.solve.motion import unpacked
from tarsus.solve.tangents import DataTangents, Direction, Entering, entering

if TYPE_CHECKING:
    from tarsus.model.scene import Scene
    from tarsus.plan.lowering import Plan

__all__ = [
    "Contacts",
    "Window",
    "WindowBatch",
    "WindowGradients",
    "WindowSlopes",
    "WindowStart",
    "simulate_window",
    "simulate_windows",
]

Floats = npt.NDArray[np.float64]


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
class WindowGradients:
    """By what windows are differentiated.

    entered: what enters them, with derivatives by numbers of a scene (`tarsus.solve.tangents.entering`), all by the
    same numbers; of windows that differ in their data several, of which each window names its own. state: by the start
    state, whose displacements and velocities are then ``state.0`` to ``state.{2n - 1}``; t0: by the moment of the
    start, with the start state and the times of outputs as they are. Contacts and flights that begin with the window
    begin later with it.
    """

    entered: Sequence[Entering] = ()
    state: bool = True
    t0: bool = True

    @classmethod
    def of(
        cls,
        scene: Scene,
        plan: Plan,
        paths: Sequence[str] | Mapping[str, Direction],
        duration: float,
        *,
        state: bool = True,
        t0: bool = True,
    ) -> WindowGradients:
        """By numbers of the scene of a plan at paths, or along directions by name, over windows that end by
        ``duration`` [s]. Raises InputError as `tarsus.solve.tangents.entering` does."""
        return cls((entering(scene, plan, paths, duration),), state, t0)

    def names(self, coordinates: int) -> tuple[str, ...]:
        """Names of the numbers, in the order of derivatives, of a structure of so many coordinates."""
        paths = self.entered[0].paths if self.entered else ()
        states = tuple(f"state.{i}" for i in range(2 * coordinates)) if self.state else ()
        return (*paths, *states, *(("t0",) if self.t0 else ()))


@dataclass(frozen=True)
class WindowSlopes:
    """Derivatives of a window, or of several, by P numbers, last axis; NaN from an event on at which there is none.

    names (P,): paths, then ``state.i`` and ``t0``; states: of displacements and velocities (n, nt, P), and of gaps,
    gap rates, forces and pulls of the feet (m, nt, P), at fixed times; rows (ne, 12, P): of the event rows; flags:
    number of a window, of an event of it (as many as it has: after the last one), reason
    (`tarsus.solve.lanes.Doubt`), number of a name.
    """

    names: tuple[str, ...]
    states: SampledStates
    rows: Floats
    flags: tuple[tuple[int, int, Doubt, int], ...]


@dataclass(frozen=True)
class Window:
    """A plan run from a given state.

    times (nt,) [s]; states: displacements, velocities, gaps, forces and pulls at the times; code: how it ended, no
    energy account being asked for; rows: every event as the engine has it; end (2n,): displacements and velocities at
    its end, events of that moment included; feet (m, k): what feet carry on from there; slopes: derivatives where asked
    for.
    """

    acting: Acting
    times: Floats
    states: SampledStates
    code: ResultCode
    rows: Floats
    end: Floats
    feet: Floats
    slopes: WindowSlopes | None = None

    @cached_property
    def events(self) -> npt.NDArray[np.void]:
        """Events in time order, fields as those of a run."""
        return without_marks(structured_events(self.rows))

    def event_slopes(self, name: str) -> Floats:
        """Derivatives (ne, P) of a field of `events`, in their order."""
        assert self.slopes is not None
        return self.slopes.rows[event_places(self.rows)[name], (EVENT_TYPE.names or ()).index(name)]

    @property
    def flags(self) -> Mapping[str, tuple[str, ...]]:
        """Why derivatives by a number are not to be had of what comes after some moment, by name; none as a rule."""
        assert self.slopes is not None
        found: dict[str, list[str]] = {}
        for _, event, reason, number in self.slopes.flags:
            foot = f"foot {int(self.rows[event, a.E_FOOT])}" if event < len(self.rows) else "a foot"
            time = self.rows[event, a.E_TIME] if event < len(self.rows) else self.times[-1]
            found.setdefault(self.slopes.names[number], []).append(doubted(reason, foot, time))
        return MappingProxyType({name: tuple(dict.fromkeys(texts)) for name, texts in found.items()})

    def repeated(self, after: float) -> npt.NDArray[np.void]:
        """As `events`, of a motion that repeats with the window, after so long [s]: the flight that the window's end
        cuts is the one that its start cuts."""
        found = structured_events(self.rows)
        before = found.copy()
        before["apex_time"] -= after
        return without_marks(np.concatenate([before, found]))[len(self.events) :]

    @cached_property
    def forces(self) -> Mapping[str, Floats]:
        """Force [N] (m, nt) of every smooth law on the feet by name, positive along the normal."""
        return self.acting.forces(self.states.gap, self.states.rate, self.states.held, self.times)


@dataclass(frozen=True)
class WindowBatch(Sequence[Window]):
    """Windows of one plan, one after the other; each of them is there by its number.

    starts: where each started; data: the rows of data that they ran on, by number; times (nt,) [s]: of all, end to
    end, those of window w from first[w] to first[w + 1]; states and slopes: at these; rows: event rows of all, those of
    window w from begin[w] to begin[w + 1]; codes: how each ended; ends (nw, 2n) and feet (nw, m, k): as `Window.end`
    and `Window.feet`.
    """

    plan: Plan
    starts: Sequence[WindowStart]
    data: Mapping[int, Rows]
    times: Floats
    first: npt.NDArray[np.int64]
    states: SampledStates
    rows: Floats
    begin: npt.NDArray[np.int64]
    codes: tuple[ResultCode, ...]
    ends: Floats
    feet: Floats
    slopes: WindowSlopes | None = None

    def __len__(self) -> int:
        return len(self.starts)

    def __getitem__(self, window: Any) -> Any:
        if isinstance(window, slice):
            return [self[w] for w in range(*window.indices(len(self)))]
        w = range(len(self))[window]
        at, events = slice(*self.first[w : w + 2]), slice(*self.begin[w : w + 2])
        slopes = None
        if self.slopes is not None:
            flags = (flag for flag in self.slopes.flags if flag[0] == w)
            own = tuple((0, event, reason, number) for _, event, reason, number in flags)
            slopes = WindowSlopes(
                self.slopes.names, self.slopes.states.part(at), self.slopes.rows[events], own
            )
        one = self.starts[w]
        acting = Acting(self.plan, self.data[one.data].starting(np.asarray(one.state, dtype=float)))
        return Window(
            acting, self.times[at], self.states.part(at), self.codes[w], self.rows[events], self.ends[w], self.feet[w],
            slopes,
        )  # fmt: skip


def simulate_window(
    plan: Plan,
    state: npt.ArrayLike,
    t0: float,
    times: npt.ArrayLike,
    contacts: Contacts | Floats | None = None,
    *,
    rows: Rows | None = None,
    gradients: WindowGradients | None = None,
    shared: ModeBook | _native.LegTables | None = None,
    accuracy: Accuracy = RECORDED,
) -> Window:
    """Run a plan from a given state, with all its laws, drives and rules, and give outputs at any times: the case of
    one of `simulate_windows`, whose words these are.

    Raises
    ------
    InputError
        For states, times or contacts that do not fit the plan.
    """
    start = WindowStart(state, t0, times, Contacts() if contacts is None else contacts)
    return simulate_windows(plan, [start], rows=rows, gradients=gradients, shared=shared, accuracy=accuracy)[
        0
    ]


def simulate_windows(
    plan: Plan,
    starts: Sequence[WindowStart],
    *,
    rows: Rows | None = None,
    gradients: WindowGradients | None = None,
    shared: ModeBook | _native.LegTables | None = None,
    accuracy: Accuracy = RECORDED,
) -> WindowBatch:
    """Run many windows of one plan in one call of the engine, each from its own state at its own time.

    Parameters
    ----------
    plan
        The plan of a scene (`tarsus.plan.lowering.lower_scene`).
    starts
        Where each window starts, and when outputs are wanted of it.
    rows
        Rows of data in place of the plan's (`tarsus.plan.slots.rows_for`), of which each window names its own; their
        initial states and periods are not used. Not with ``gradients`` by numbers of a scene, which have theirs.
    gradients
        By what there are exact first derivatives of all outputs and events; by nothing unless given.
    shared
        Contact modes of the plan's structure, or step tables of its legs, to share with other windows; made for a
        duration not below the last time.
    accuracy
        Tolerances; those of a single run by default.

    Raises
    ------
    InputError
        For states, times or contacts that do not fit the plan, data that are not there, and derivatives of
        walkers whose legs move across the way.
    """
    by = gradients or WindowGradients(state=False, t0=False)
    data = [one.row for one in by.entered] or [rows_of(plan) if rows is None else rows]
    given = _Given.of(plan, starts, sum(map(len, data)))
    end = float(given.times.max(initial=0.0))
    names = by.names(len(plan.system.mass))
    if names:
        ahead_only(plan, "windows of a run have derivatives")
    batch = _Batch(plan, given, data, by, names, settings_of(plan, end, accuracy, record=plan.legs is None))
    if plan.legs is None:
        codes, events, ends, samples, *slopes, finals, feet = batch.modal(
            shared if isinstance(shared, ModeBook) else book_of(plan, end)
        )
        states = shown_states(samples, plan.feet, plan.system.tangents is not None)
    else:
        tables = shared if isinstance(shared, _native.LegTables) else tables_of(plan, end)
        codes, events, ends, samples, *slopes, finals, feet = batch.legged(tables)
        states = _walked(plan, given, data, samples)
    begin = np.concatenate([[0], ends])
    found = _slopes(plan, given, names, states, events, begin, slopes) if names else None
    return WindowBatch(
        plan, starts, _singles(data, given.data), given.times, given.first, states, events, begin,
        tuple(ResultCode.of(int(code)) for code in codes), finals, feet.reshape(len(starts), plan.feet, -1), found,
    )  # fmt: skip


def _singles(data: Sequence[Rows], wanted: npt.NDArray[np.int64]) -> dict[int, Rows]:
    """Rows of data one by one, by number, those that are wanted: of thousands a call has a few."""
    first = np.cumsum([0, *map(len, data)])
    out = {}
    for number in np.unique(wanted).tolist():
        k = int(np.searchsorted(first, number, side="right")) - 1
        r = number - int(first[k])
        out[number] = data[k] if len(data[k]) == 1 else data[k].taken(slice(r, r + 1))
    return out


@dataclass(frozen=True)
class _Given:
    """Starts of nw windows as arrays: state (nw, 2n), t0 (nw,), held, leaving, since (nw, m), data (nw,), first
    (nw + 1,) of each one's times, carried (nw, m, k) by the feet of those that go on."""

    state: Floats
    t0: Floats
    held: npt.NDArray[np.uint8]
    leaving: npt.NDArray[np.uint8]
    since: Floats
    data: npt.NDArray[np.int64]
    first: npt.NDArray[np.int64]
    times: Floats
    carried: Floats

    @classmethod
    def of(cls, plan: Plan, starts: Sequence[WindowStart], data: int) -> _Given:
        """Raises InputError where a start does not fit the plan, or names data beyond so many."""
        m, size = plan.feet, 2 * len(plan.system.mass)
        states = [np.asarray(one.state, dtype=float) for one in starts]
        times = [np.atleast_1d(np.asarray(one.times, dtype=float)) for one in starts]
        for w, (one, state, when) in enumerate(zip(starts, states, times, strict=True)):
            problems = _problems(one, state, when, m, size)
            if not 0 <= one.data < data:
                problems.append(f"data: there is no number {one.data} (data are numbered 0 to {data - 1})")
            if problems:
                raise InputError(
                    problems if len(starts) == 1 else [f"window {w}: {text}" for text in problems]
                )
        begun = [_begun(one, m) for one in starts]
        held = np.array([one[0] for one in begun], dtype=np.uint8).reshape(-1, m)
        leaving = np.array([one[1] for one in begun], dtype=np.uint8).reshape(-1, m)
        since = np.array([one[2] for one in begun], dtype=float).reshape(-1, m)
        return cls(
            np.array(states).reshape(-1, size), np.array([one.t0 for one in starts], dtype=float), held, leaving, since,
            np.array([one.data for one in starts], dtype=np.int64),
            np.cumsum([0, *map(len, times)], dtype=np.int64), np.concatenate([*times, np.zeros(0)]),
            np.array([one[3] for one in begun], dtype=float).reshape(-1, m, len(CARRIED)),
        )  # fmt: skip

    def native(self, sources: npt.NDArray[np.int64]) -> tuple[Any, ...]:
        """As the engine takes them; sources (nw, 2): what each runs on, and its row there."""
        return (
            self.state, self.t0, self.held, self.leaving, self.since, np.ascontiguousarray(sources), self.first,
            self.times, self.carried,
        )  # fmt: skip


def _begun(one: WindowStart, feet: int) -> tuple[Any, Any, Any, Floats]:
    """Held, leaving and since (m,), and what is carried on (m, k), NaN where nothing is."""
    if isinstance(one.contacts, Contacts):
        return (*one.contacts.begin(feet, one.t0)[1:], np.full((feet, len(CARRIED)), np.nan))
    held, since = (one.contacts[:, CARRIED.index(name)] for name in ("contact", "since"))
    return held != FootState.AIR, np.zeros(feet), since, one.contacts


def _problems(one: WindowStart, state: Floats, times: Floats, feet: int, size: int) -> list[str]:
    """Sentences on where a window's start or times do not fit a plan of so many feet and numbers of a state."""
    problems = []
    if isinstance(one.contacts, Contacts):
        problems += one.contacts.faults(feet, one.t0)
    elif np.shape(one.contacts) != (feet, len(CARRIED)):
        problems.append(
            f"contacts: expected {feet} rows of {len(CARRIED)} numbers, as a window before left them"
        )
    if state.shape != (size,) or not np.isfinite(state).all():
        problems.append(f"state: expected {size} finite numbers, displacements and velocities")
    if not (math.isfinite(one.t0) and one.t0 >= 0.0):
        problems.append(f"t0: expected a time of 0 s or later, got {one.t0:g} s")
    ordered = times.ndim == 1 and len(times) > 0 and not np.any(np.diff(times) < 0.0)
    if not (ordered and one.t0 <= times[0] and one.t0 < times[-1] < math.inf):
        problems.append("times: expected times in order, none before the start and the last after it")
    return problems


@dataclass(frozen=True)
class _Batch:
    """What the engine is asked: windows of a plan, their data, and by what they are differentiated."""

    plan: Plan
    given: _Given
    data: Sequence[Rows]
    by: WindowGradients
    names: tuple[str, ...]
    settings: _native.Settings

    @property
    def blocks(self) -> range:
        """First numbers of every eight."""
        return range(0, len(self.names), a.LANES)

    @cached_property
    def sources(self) -> npt.NDArray[np.int64]:
        """What each window runs on (nw,), and its row there."""
        own, none = self.given.data, np.zeros_like(self.given.data)
        return np.stack([own, none] if self.by.entered else [none, own], axis=1)

    def entered(self) -> list[tuple[Any, Rows, list[DataTangents]]]:
        """Signals, rows and derivatives of what the windows run on, without marks of periods."""
        n, out = len(self.plan.system.mass), []
        for k, rows in enumerate(self.data):
            scales = rows.scales.copy()
            scales[:, 2] = math.inf
            own = self.by.entered[k].data if self.by.entered else DataTangents.none(rows, 0, 1)
            whole = own.with_start(2 * n if self.by.state else 0, self.by.t0) if self.names else own
            out.append(
                (rows.signals, replace(rows, scales=scales), [whole.lanes(first) for first in self.blocks])
            )
        return out

    def modal(self, book: ModeBook) -> Sequence[Any]:
        laws = self.plan.laws
        structural = [
            (k, p // a.LANES, one.derived(p, book), p % a.LANES)
            for k, one in enumerate(self.by.entered)
            for p in one.structure
        ]
        return _native.windows_modal(
            book.native, NODES, laws.native, laws.by_programs, self.settings, self.entered(), structural,
            self.given.native(self.sources),
        )  # fmt: skip

    def legged(self, tables: _native.LegTables) -> Sequence[Any]:
        laws, legs = self.plan.laws, self.plan.legs
        assert legs is not None
        copies = [
            (k, p // a.LANES, body, copied, weight, p % a.LANES)
            for k, one in enumerate(self.by.entered)
            for p in one.perturbed
            for body, copied, weight in copies_of(one, p, tables)
        ]
        return _native.windows_legged(
            legs.native, tables, NODES, laws.native, laws.by_programs, self.settings, self.entered(), copies,
            len(self.names), self.given.native(self.sources),
        )  # fmt: skip


def _walked(plan: Plan, given: _Given, data: Sequence[Rows], samples: Floats) -> SampledStates:
    """States of a walker by its samples, window by window on data of its own."""
    parts = []
    number = np.repeat(given.data, np.diff(given.first))
    for k, one in _singles(data, given.data).items():
        own = np.flatnonzero(number == k)
        if len(own):
            parts.append((own, unpacked(Acting(plan, one), samples[own], given.times[own])[0]))
    if len(parts) == 1:
        return parts[0][1]
    out = {}
    for name in SampledStates.__dataclass_fields__:
        some = [getattr(states, name) for _, states in parts]
        if some[0] is None:
            continue
        out[name] = np.empty((len(some[0]), len(given.times)), dtype=some[0].dtype)
        for (own, _), values in zip(parts, some, strict=True):
            out[name][:, own] = values
    return SampledStates(**out)


def _slopes(
    plan: Plan,
    given: _Given,
    names: tuple[str, ...],
    states: SampledStates,
    events: Floats,
    begin: npt.NDArray[np.int64],
    found: Sequence[Any],
) -> WindowSlopes:
    """Derivatives of all windows from what the engine has in blocks of eight."""
    by_events, by_samples, flags = found
    n, m, count = len(plan.system.mass), plan.feet, len(names)
    rows = np.concatenate([one.reshape(-1, a.EVENT_WIDTH, a.LANES) for one in by_events], axis=2)[..., :count]
    width = 2 * n + 5 * m
    samples = np.concatenate([one.reshape(-1, width, a.LANES).swapaxes(0, 1) for one in by_samples], axis=2)[
        ..., :count
    ]
    kept = []
    for w, event, reason, lane in np.asarray(flags).astype(np.int64).tolist():
        if lane >= count or reason == Doubt.APART:
            continue
        lanes = slice(None) if lane < 0 else lane
        own, at = slice(*begin[w : w + 2]), slice(*given.first[w : w + 2])
        e = min(own.start + event, own.stop)
        since = events[e, a.E_TIME] if e < own.stop else np.inf
        rows[e : own.stop, :, lanes] = np.nan
        samples[:, at.start + np.searchsorted(given.times[at], since) : at.stop, lanes] = np.nan
        kept += [(w, e - own.start, Doubt(reason), number) for number in (range(count) if lane < 0 else [lane])]
    motion, feet = samples[: 2 * n], samples[2 * n :].reshape(5, m, -1, count)
    gap, rate, resistive, smooth, pull = feet
    shown = SampledStates(motion[:n], motion[n:], gap, rate, resistive, smooth, pull, states.held)
    return WindowSlopes(names, shown, rows, tuple(kept))
