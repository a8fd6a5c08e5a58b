"""The return map: a state at a phase of the drive to the state k drive periods later, with its derivative.

    P: s -> s + k periods,   s = (x, v) at the phase t0,   dP/ds = product of flows and saltation matrices.

The phase is one at which every foot is in the air, if the motion has one: then s is free, and what feet remember of
their contacts is none of it. Else s lies in the subspace in which held feet stay where they are.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.model.drive.waveforms import Constant
from tarsus.plan.lowering import Plan, lower_scene
from tarsus.plan.slots import Rows, rows_for, rows_of, slot
from tarsus.solve.codes import ResultCode
from tarsus.solve.contacts import Contacts, follow_contact
from tarsus.solve.engine import Accuracy, ModeBook, book_of, execute, settings_of, structure_key
from tarsus.solve.lanes import Tangents, tangents
from tarsus.solve.simulate import Shared
from tarsus.solve.tangents import NO_FRICTION, DataTangents, Entering, entering
from tarsus.solve.window import Window, simulate_window

if TYPE_CHECKING:
    from tarsus.model.scene import Scene

Floats = NDArray[np.float64]

FINE = Accuracy(gap=1e-12)
"""Accuracy of windows whose ends are compared with their starts: a multiplier is then known to about 1e-10."""


def drive_period(scene: Scene) -> float:
    """Period [s] after which all drives of a scene repeat.

    Raises InputError where a drive has no period, where none is driven, and where periods have no common multiple below
    a hundred of the longest.
    """
    waves = scene.waveforms
    problems = [
        f"signals.{name}: has no period; a periodic motion needs periodic drives"
        for name, wave in waves.items()
        if wave.period is None and not isinstance(wave, Constant)
    ]
    periods = sorted({wave.period for wave in waves.values() if wave.period is not None})
    if not problems and not periods:
        problems = [f"{scene.name}: no drive is periodic; a periodic motion needs one"]
    if problems:
        raise InputError(problems)
    longest = periods[-1]
    for multiple in range(1, MOST_COMMON + 1):
        shares = [multiple * longest / one for one in periods]
        if all(abs(share - round(share)) <= ALIKE * share for share in shares):
            return multiple * longest
    raise InputError(
        [f"signals: the drives' periods {', '.join(f'{one:g} s' for one in periods)} have no common multiple "
         f"below {MOST_COMMON} of the longest"]
    )  # fmt: skip


MOST_COMMON = 100
"""Multiples of the longest period that are tried as the drives' common one: beyond, a motion is none anyone can see."""
HORIZON = 32
"""Drive periods that step tables are made for: four times the longest motion that is looked for."""
ALIKE = 1e-9
"""Relative difference below which a ratio of periods is a whole number: what is left of decimals in a file."""


@dataclass(frozen=True)
class Returned:
    """Where a state returns to: state (2n,), feet held there, how the window ended, its events in time order as those
    of a motion that repeats; travel [m] of a walker, which its state is less."""

    state: Floats
    contacts: Contacts
    code: ResultCode
    events: NDArray[np.void]
    travel: float = 0.0

    @property
    def kinds(self) -> list[tuple[int, int]]:
        """(foot, kind) of the events, in order."""
        return list(zip(self.events["foot"].tolist(), self.events["kind"].tolist(), strict=True))


@dataclass(frozen=True)
class ReturnMap:
    """Returns of a plan after k drive periods.

    period [s] of the drives; start [s]: a time at the phase of the section, when transients of the drives are over;
    contacts: what the feet do there.
    """

    plan: Plan
    book: ModeBook
    rows: Rows
    period: float
    start: float
    contacts: Contacts
    accuracy: Accuracy = FINE

    @cached_property
    def free(self) -> Floats:
        """Basis (2n, r) of the states that a section can be in, orthonormal in the metrics of `scales`."""
        n = len(self.plan.system.mass)
        held = self.plan.system.normals[:, list(self.contacts.held)].T
        if not len(held):
            return np.eye(2 * n)
        _, values, rows = np.linalg.svd(held)
        null = rows[int((values > 1e-12 * values[0]).sum()) :].T
        return np.block([[null, np.zeros_like(null)], [np.zeros_like(null), null]])

    def __call__(self, state: Floats, multiple: int = 1) -> Returned:
        """The state after ``multiple`` periods."""
        window = self.window(state, [self.start + multiple * self.period])
        found = window.states
        contacts = self.contacts.after(window.events, self.start, float(window.times[-1]))
        events = window.repeated(multiple * self.period)
        return Returned(np.concatenate([found.x[:, 0], found.v[:, 0]]), contacts, window.code, events)

    def window(self, state: Floats, times: ArrayLike) -> Window:
        """The motion from a state at the section, with outputs at times [s] after it."""
        return self._window(state, times, self.contacts)

    def _window(self, state: Floats, times: ArrayLike, contacts: Contacts) -> Window:
        return simulate_window(
            self.plan, state, self.start, times, contacts, rows=self.rows, shared=self.book, accuracy=self.accuracy
        )  # fmt: skip

    def derivative(self, state: Floats, multiple: int = 1) -> Floats:
        """dP/ds (2n, r) along the free directions, from the engine's own steps and events."""
        return (
            self.returning(self.tangents(state, self.by_state(state), [self.start + multiple * self.period]))
            @ self.free
        )

    def by_state(self, state: Floats) -> Entering:
        """What enters a window from a state, with derivatives by all of that."""
        size, rows = len(state), self.rows.starting(state)
        data = DataTangents.none(rows, size)
        data.initial[...] = np.eye(size)
        return Entering(tuple(f"state.{i}" for i in range(size)), rows, data)

    def by_value(self, scene: Scene, path: str, later: float, state: Floats) -> Entering:
        """What enters a window from a state, with derivatives by the number at a path of a scene that has the map's
        value, with which the section is later by ``later`` [s]. Raises InputError as `entering` does."""
        found, size = entering(scene, self.plan, {path: {path: 1.0}}, np.inf), 2 * len(self.plan.system.mass)
        found.data.initial[...] = 0.0
        found.data.start[...] = later
        found.row.scales[:, 2] = np.inf  # no marks of periods among the events
        return replace(found, row=found.row.starting(state[:size]))

    def by_way(self, given: Entering, way: Floats) -> Entering:
        """The same with derivatives along a way (2n,) of states at the section as well."""
        parts = [getattr(given.data, name) for name in given.data.__dataclass_fields__]
        data = DataTangents(
            *(np.concatenate([one, np.zeros((*one.shape[:-1], 1))], axis=-1) for one in parts)
        )
        data.initial[:, -1] = way[: len(data.initial)]
        return Entering((*given.paths, "state"), given.row, data, given.structure, given.perturbed)

    def tangents(self, state: Floats, given: Entering, times: ArrayLike) -> Tangents:
        """Derivatives of the motion from a state at the section, with outputs at times [s] after it."""
        when = np.asarray(times, dtype=float)
        end, begin = float(when[-1]), self.contacts.begin(self.plan.feet, self.start)
        made = execute(
            self.plan, end, rows=given.row, book=self.book, accuracy=self.accuracy, record=True, start=begin
        )
        settings = settings_of(self.plan, end, self.accuracy, record=True)
        return tangents(
            self.plan, self.book, given, made, settings, start=self.start, contacts=self.contacts, times=when
        )  # fmt: skip

    def returning(self, found: Tangents) -> Floats:
        """Of derivatives of a window with outputs at its end, those (2n, P) of the state that it returns to."""
        return found.samples[-1, : 2 * len(self.plan.system.mass)]

    def at_values(self, scene: Scene, phase: float, values: Mapping[str, float], shared: Shared) -> ReturnMap:
        """The map with the same feet on the ground at a phase in drive periods, of a scene with values in place of some
        of its own. Raises InputError as `lower_scene` does."""
        return return_map(scene, phase, self.contacts, values, shared)

    def rate(self, state: Floats, time: float) -> Floats:
        """How fast a state at the section changes at a time [s] after it, where nothing happens, by differences of
        fourth order over a millionth of a period."""
        beside = 1e-6 * self.period
        found = self.window(state, time + beside * np.array([-2.0, -1.0, 1.0, 2.0])).states
        slope = np.array([1.0, -8.0, 8.0, -1.0]) / (12.0 * beside)
        rest = np.zeros(len(state) - 2 * len(found.x))
        return np.concatenate([found.x @ slope, found.v @ slope, rest])

    def carried(self, state: Floats, periods: int) -> tuple[ReturnMap, Floats] | None:
        """What a state becomes after so many periods: the state at a section in the middle of what is then the longest
        flight, and the map there; None where the motion ends before."""
        contacts = self.contacts
        for _ in range(periods):
            window = self._window(state, [self.start + self.period], contacts)
            if window.code is not ResultCode.DONE:
                return None
            state, contacts = (
                end_of(window),
                contacts.after(window.events, self.start, float(window.times[-1])).earlier(self.period),
            )
        return self.sectioned(state, contacts)

    def sectioned(self, state: Floats, contacts: Contacts) -> tuple[ReturnMap, Floats] | None:
        """The map with its section in the middle of the longest flight of the period behind a state with its contacts,
        and the state there; with the section as it is where some foot is always held."""
        window = self._window(state, [self.start + self.period], contacts)
        held = dict(zip(contacts.held, contacts.since or (), strict=True))
        later = middle_of_flight(held, window.events, self.start, self.start + self.period)
        if window.code is not ResultCode.DONE:
            return None
        if later is None or later == self.start:
            return replace(self, contacts=contacts), state
        return replace(self, start=later, contacts=Contacts()), end_of(self._window(state, [later], contacts))

    def speed(self, state: Floats) -> float:
        """Size [m/s] of velocities that others are compared with."""
        return float(self.scales(state)[2 * len(self.plan.system.mass) - 1])

    def scales(self, state: Floats) -> Floats:
        """Sizes (2n,) of displacements [m] and velocities [m/s] that mismatches are compared with."""
        n = len(self.plan.system.mass)
        place = max(self.plan.length, float(np.abs(state[:n]).max(initial=0.0)))
        speed = max(place / self.period, float(np.abs(state[n:]).max(initial=0.0)))
        return np.repeat([place, speed], n)


def end_of(window: Window) -> Floats:
    """Displacements and velocities (2n,) at the last of a window's times."""
    return np.concatenate([window.states.x[:, -1], window.states.v[:, -1]])


def check_memory(plan: Plan) -> None:
    """Raise InputError where feet remember their contacts (a law with `remaining`): what they bring along is no
    part of a map's state; and where volts command what they hold: maps follow the strength by age alone."""
    if plan.laws.remembers:
        raise InputError(
            "there is no return map where feet remember their contacts: what they bring along is not in its state"
        )
    if any(law.by_volts() for law in plan.laws.acting.values() if law.hook == "strength"):
        raise InputError("there is no return map where volts command how strongly feet adhere")


def return_map(
    scene: Scene,
    start: float,
    contacts: Contacts,
    values: Mapping[str, float] | None = None,
    shared: Shared | None = None,
) -> ReturnMap:
    """The return map of a scene, with values in place of some of its own.

    start: when the section is, in drive periods; shared: what maps of the same structure share. Raises InputError as
    `lower_scene` does.
    """
    shared = shared or Shared()
    plan, rows, period, horizon = varied(scene, values or {}, shared)
    if plan.system.tangents is not None:
        raise InputError(NO_FRICTION)
    check_memory(plan)
    book = shared.get(structure_key(plan, horizon), lambda: book_of(plan, horizon))
    return ReturnMap(plan, book, rows, period, start * period, contacts)


def varied(scene: Scene, values: Mapping[str, float], shared: Shared) -> tuple[Plan, Rows, float, float]:
    """Plan and row of a scene with values in place of some of its own, its drives' period [s], and how long tables are
    made for [s]."""
    changed = with_values(scene, dict(values)) if values else scene
    data = all(slot(scene, path) is not None for path in values)
    base = scene if data else changed
    plan = shared.get(("plan", base), lambda: lower_scene(base))
    if data and values:
        rows = rows_for(scene, plan, {path: np.array([value]) for path, value in values.items()}, np.inf)
    else:
        rows = rows_of(plan)
    return plan, rows, drive_period(changed), HORIZON * drive_period(base)


def middle_of_flight(
    held: Mapping[int, float], events: NDArray[np.void], begin: float, end: float
) -> float | None:
    """Time [s] in the middle of the longest time from ``begin`` to ``end`` in which no foot is on the ground; None
    without one. held: the feet on the ground at first; events: those in between, in order."""
    now, since, best, where = dict(held), begin, 0.0, None
    for time, event in [*zip(events["time"].tolist(), events, strict=True), (end, None)]:
        if not now and time - since > best:
            best, where = time - since, 0.5 * (since + time)
        if event is not None:
            follow_contact(now, event)
        since = time
    return where
