"""The return map: a state at a phase of the drive to the state k drive periods later, with its derivative.

    P: s -> s + k periods,   s = (x, v) at the phase t0,   dP/ds by differences of returns.

The phase is one at which every foot is in the air, if the motion has one: then s is free, and what feet remember of
their contacts is none of it. Else s lies in the subspace in which held feet stay where they are.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.model.drive.waveforms import Constant
from tarsus.orbits.differences import return_slopes
from tarsus.orbits.sequence import sequence_of
from tarsus.plan.lowering import Plan, lower_scene
from tarsus.plan.rows import Rows, rows_of
from tarsus.plan.slots import rows_for, slot
from tarsus.solve import Accuracy, Contacts, Engine, ResultCode, Shared, Window, WindowStart, simulate_windows

if TYPE_CHECKING:
    from tarsus.model.scene import Scene

Floats = NDArray[np.float64]

FINE = Accuracy(gap=1e-12)
"""Accuracy of windows whose ends are compared with their starts: a multiplier is then known to about 1e-10."""


def drive_period(scene: Scene) -> float:
    """Period [s] after which all drives of a scene, and its ground where that moves, repeat.

    Raises InputError where a drive has no period, where none is driven, and where periods have no common multiple below
    a hundred of the longest.
    """
    waves = scene.waves
    problems = [
        f"{name}: has no period; a periodic motion needs periodic drives"
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
        [
            f"signals: the drives' periods {', '.join(f'{one:g} s' for one in periods)} have no common multiple "
            f"below {MOST_COMMON} of the longest"
        ]
    )


MOST_COMMON = 100
"""Multiples of the longest period that are tried as the drives' common one: beyond, a motion is none anyone can see."""
HORIZON = 32
"""Drive periods that step tables are made for: four times the longest motion that is looked for."""
ALIKE = 1e-9
"""Relative difference below which a ratio of periods is a whole number: what is left of decimals in a file."""


@dataclass(frozen=True)
class Returned:
    """Where a state returns to: state (2n,) at the end of a window, which begins with what feet do at the section, at
    ``start`` [s]; travel [m] of a walker, which its state is less."""

    state: Floats
    window: Window
    begun: Contacts
    start: float
    travel: float = 0.0

    @property
    def code(self) -> ResultCode:
        """How the window ended."""
        return self.window.code

    @property
    def end(self) -> float:
        """When the window ends [s]."""
        return float(self.window.times[-1])

    @cached_property
    def contacts(self) -> Contacts:
        """What the feet do at the end."""
        return self.begun.after(self.window.events, self.start, self.end)

    @cached_property
    def events(self) -> NDArray[np.void]:
        """Events in time order, as those of a motion that repeats."""
        return self.window.repeated(self.end - self.start)

    @cached_property
    def by_foot(self) -> list[tuple[int, int]]:
        """(foot, kind) of the events that distinguish motions, foot by foot: states return continuously where events
        of different feet change their order."""
        return sorted(sequence_of(self.window.events), key=lambda one: one[0])

    def same_events(self, other: Returned) -> bool:
        """Whether every foot does the same on the way as in another return, and both reach their end."""
        return self.code is other.code is ResultCode.DONE and self.by_foot == other.by_foot


@dataclass(frozen=True)
class ReturnMap:
    """Returns of a plan after k drive periods.

    period [s] of the drives; start [s]: a time at the phase of the section, when transients of the drives are over;
    contacts: what the feet do there.
    """

    plan: Plan
    tables: Any
    rows: Rows
    period: float
    start: float
    contacts: Contacts
    accuracy: Accuracy = FINE

    def __post_init__(self) -> None:
        """Raise InputError for a section at which a foot that slides is on the ground: where it sticks is no part of a
        state."""
        if self.contacts.held and self.plan.legs is None and self.plan.system.tangents is not None:
            raise InputError(
                "there is no return map of feet that slide where one of them is always on the ground, but of a walker: "
                "leave out feet.NAME.along or ground.friction"
            )

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
        return self.returns([state], multiple)[0]

    def returns(self, states: Sequence[Floats], multiple: int = 1) -> list[Returned]:
        """What states become after ``multiple`` periods, by one call of the engine."""
        end, n2 = self.start + multiple * self.period, 2 * len(self.plan.system.mass)
        starts = [WindowStart(one[:n2], self.start, [end], self.contacts_at(one)) for one in states]
        windows = simulate_windows(self.plan, starts, rows=self.rows, shared=self.tables, accuracy=self.accuracy)
        return [self.returned(one, window) for one, window in zip(states, windows, strict=True)]

    def returned(self, state: Floats, window: Window) -> Returned:
        """Where a window takes a state to."""
        return Returned(end_of(window), window, self.contacts_at(state), self.start)

    def goes_on(self, back: Returned) -> bool:
        """Whether a return has come to the section with the same feet on the ground."""
        return back.code is ResultCode.DONE and list(back.contacts.held) == list(self.contacts.held)

    def contacts_at(self, state: Floats) -> Contacts:
        """What the feet do at the section in a state."""
        return self.contacts

    def window(self, state: Floats, times: ArrayLike) -> Window:
        """The motion from a state at the section, with outputs at times [s] after it."""
        return self._window(state[: 2 * len(self.plan.system.mass)], times, self.contacts_at(state))

    def _window(self, state: Floats, times: ArrayLike, contacts: Contacts) -> Window:
        starts = [WindowStart(state, self.start, times, contacts)]
        return simulate_windows(self.plan, starts, rows=self.rows, shared=self.tables, accuracy=self.accuracy)[0]

    def derivative(self, state: Floats, multiple: int = 1, own: Returned | None = None, *, fine: bool = True) -> Floats:
        """dP/ds (2n, r) along the free directions, by differences; own: the return of the state, where it is known;
        fine: to 1e-9 rather than to 1e-8, by twice as many returns."""
        sizes = self.sizes(state)
        directions = self.free * sizes

        def copies(steps: Sequence[tuple[int, float]]) -> list[Returned]:
            return self.returns([state + step * directions[:, k] for k, step in steps], multiple)

        own = own or self(state, multiple)
        return return_slopes(own, copies, len(sizes), self.scales(state), fine=fine) / sizes

    def at_values(self, scene: Scene, phase: float, values: Mapping[str, float], shared: Shared) -> Self:
        """The map with the same feet on the ground at a phase in drive periods, of a scene with values in place of some
        of its own. Raises InputError as `lower_scene` does."""
        plan, rows, period, horizon = varied(scene, values, shared)
        tables = Engine(plan, horizon, shared).tables
        return replace(self, plan=plan, tables=tables)._on(rows, period, phase)

    def at_each(self, scene: Scene, phase: float, path: str, values: Floats, shared: Shared) -> list[Self]:
        """The same at each of some values of one number, which are looked up together where they are data."""
        first = self.at_values(scene, phase, {path: float(values[0])}, shared)
        if slot(scene, path) is None:
            rest = values[1:].tolist()
            return [first, *(self.at_values(scene, phase, {path: one}, shared) for one in rest)]
        rows = rows_for(scene, first.plan, {path: values}, np.inf)
        periods = [drive_period(with_values(scene, {path: one})) for one in values.tolist()]
        return [first._on(rows.taken(slice(k, k + 1)), one, phase) for k, one in enumerate(periods)]

    def _on(self, rows: Rows, period: float, phase: float) -> Self:
        """The map on other data, at a phase in drive periods of their own; contacts keep their age."""
        start, contacts = phase * period, self.contacts
        since = None if contacts.since is None else [start + (one - self.start) for one in contacts.since]
        return replace(
            self, rows=rows, period=period, start=start, contacts=Contacts(contacts.held, since, contacts.leaving)
        )

    def propagated(self, state: Floats, periods: int) -> tuple[ReturnMap, Floats] | None:
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
        later = contacts.middle_of_flight(window.events, self.start, self.start + self.period)
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

    def sizes(self, state: Floats) -> Floats:
        """The same (r,) along the free directions."""
        return np.sqrt((self.free**2).T @ self.scales(state) ** 2)


def end_of(window: Window) -> Floats:
    """Displacements and velocities (2n,) at the last of a window's times."""
    return np.concatenate([window.states.x[:, -1], window.states.v[:, -1]])


def check_memory(plan: Plan) -> None:
    """Raise InputError where feet remember their contacts (a law with `remaining`): what they bring along is no
    part of a map's state; and where volts command what they hold: maps follow the strength by age alone."""
    if plan.laws.remembers:
        raise InputError("there is no return map where feet remember their contacts: that memory is not in its state")
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
    check_memory(plan)
    return ReturnMap(plan, Engine(plan, horizon, shared).tables, rows, period, start * period, contacts)


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
