"""The return map of a walker, modulo its travel: a gait repeats when everything does but where the robot is.

    P: s -> s + k periods, taken back by the surge of its body,   s = (x, v, begins of contacts) at the phase t0.

Wherever a walker is, it walks alike: P(s + a e) = P(s) + a e for a shift by a of body and feet, whose multiplier is 1
and says nothing of the gait. The map is that of states with one surge. Some foot is on the ground as a rule, and what
its contact remembers, when it began, is part of the state.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.base.events import EventKind
from tarsus.orbits.returns import HORIZON, Returned, ReturnMap, check_memory, drive_period, end_of
from tarsus.plan.lowering import Plan, level_only, lower_scene
from tarsus.plan.rows import rows_of
from tarsus.solve import Contacts, Engine, ResultCode, Window

if TYPE_CHECKING:
    from tarsus.model.scene import Scene
    from tarsus.solve import Run

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class WalkMap(ReturnMap):
    """Returns of a walker's plan after k drive periods, less its travel.

    stuck: numbers of the feet that stick at the section; aging: of those on the ground there whose contact begins anew
    in every period. Their begins [s], from the section on, follow displacements and velocities in the state.
    """

    stuck: tuple[int, ...] = ()
    aging: tuple[int, ...] = ()

    def later(self, state: Floats, events: NDArray[np.void], multiple: int) -> tuple[WalkMap, Floats]:
        """The map with its section in the middle of the longest time without an event of a gait, and the state there.
        events: of its period, from the section on."""
        span = multiple * self.period
        start = self.start + _quiet(events, 0.0, span)
        logged = events.copy()
        logged["time"] += self.start
        contacts = self.contacts_at(state).after(logged[logged["time"] <= start], self.start, start)
        anew = set(events["foot"][events["kind"] == EventKind.RELEASE].tolist())
        return self.at_section(start, contacts, end_of(self.window(state, [start])), anew, bool(self.aging))

    def propagated(self, state: Floats, periods: int) -> tuple[WalkMap, Floats] | None:
        """What a state becomes after so many periods; the section is in the longest time without an event."""
        n2, contacts = 2 * len(self.plan.system.mass), self.contacts_at(state)
        place = state[:n2]
        for _ in range(periods + 1):  # the last of them shows the events
            began, before = contacts, place
            window = self._window(place, [self.start + self.period], contacts)
            if window.code is not ResultCode.DONE:
                return None
            contacts = contacts.after(window.events, self.start, float(window.times[-1])).earlier(self.period)
            place = end_of(window) - end_of(window)[0] * self.shift
        start = _quiet(window.events, self.start, self.start + self.period)
        here = began.after(window.events[window.events["time"] <= start], self.start, start)
        anew = set(window.events["foot"][window.events["kind"] == EventKind.RELEASE].tolist())
        place = end_of(self._window(before, [start], began))
        aging = any(law.hook == "strength" for law in self.plan.laws.acting.values())
        return self.at_section(start, here, place, anew, aging)

    def at_section(
        self, start: float, contacts: Contacts, place: Floats, anew: set[int], aging: bool
    ) -> tuple[WalkMap, Floats]:
        """The map with another section [s], and its state: displacements and velocities (2n,) there less the surge, and
        ages. contacts: what feet do there; anew: feet whose contact begins anew in every period; aging:
        whether contacts know since when they are."""
        along = _along(self.plan, place)
        stuck = tuple(i for i in contacts.held if along[i] == 0.0)
        old = tuple(i for i in contacts.held if i in anew) if aging else ()
        ages = np.array([contacts.begun[i] for i in old]) - start
        found = replace(self, start=start, contacts=contacts, stuck=stuck, aging=old)
        return found, np.concatenate([place - place[0] * self.shift, ages])

    @property
    def shift(self) -> Floats:
        """Displacements and velocities (2n,) of a walker that is a metre further on."""
        assert self.plan.legs is not None
        n, nb = len(self.plan.system.mass), len(self.plan.legs.body.body_mass)
        out = np.zeros(2 * n)
        out[0] = 1.0
        out[nb:n:2] = 1.0
        return out

    @cached_property
    def free(self) -> Floats:
        """Basis (2n + na, r) of the states that a section can be in, all at one surge."""
        assert self.plan.legs is not None
        n, nb = len(self.plan.system.mass), len(self.plan.legs.body.body_mass)
        leg = self.plan.legs.body.leg
        held = [nb + 2 * int(leg[i]) + 1 for i in self.contacts.held]
        fixed = {0, *held, *(n + i for i in held), *(n + nb + 2 * int(leg[i]) for i in self.stuck)}
        size = 2 * n + len(self.aging)
        return np.eye(size)[:, [i for i in range(size) if i not in fixed]]

    def contacts_at(self, state: Floats) -> Contacts:
        """What the feet do at the section in a state."""
        n2 = 2 * len(self.plan.system.mass)
        aged = {i: self.start + age for i, age in zip(self.aging, state[n2:].tolist(), strict=True)}
        return Contacts.of(self.contacts.begun | aged)

    def returned(self, state: Floats, window: Window) -> Returned:
        """Where a window takes a state to, and how far the walker has come."""
        found = super().returned(state, window)
        travel = float(found.state[0] - state[0])
        found = replace(found, state=found.state - travel * self.shift, travel=travel)
        if not self.aging:
            return found
        ages = np.array([found.contacts.begun.get(i, np.nan) for i in self.aging]) - found.end
        return replace(found, state=np.concatenate([found.state, ages]))

    def travel_multiplier(self, state: Floats, multiple: int = 1) -> float:
        """By how much a walker is further on after the motion that began a little further on: 1."""
        size = float(self.scales(state)[0])  # of any size, for wherever it is a walker walks alike
        on = np.append(size * self.shift, np.zeros(len(self.aging)))
        behind, ahead = self.returns([state - on, state + on], multiple)
        return 1.0 + (ahead.travel - behind.travel) / (2.0 * size)

    def scales(self, state: Floats) -> Floats:
        """Sizes (2n + na,) of displacements [m], velocities [m/s] and ages [s] that mismatches are compared with."""
        n2 = 2 * len(self.plan.system.mass)
        return np.append(super().scales(state[:n2]), np.full(len(self.aging), self.period))


def walk_map(scene: Scene, run: Run, count: int) -> tuple[WalkMap, Floats]:
    """The return map of a walker with its section in the middle of the longest time without an event in a drive period,
    after ``count`` of them, and the state there in a run."""
    plan, period = lower_scene(scene), drive_period(scene)
    level_only(plan, "motions repeat, each step like the one before,")
    check_memory(plan)
    start = _quiet(run.events, count * period, (count + 1) * period)
    contacts = Contacts().after(run.events[run.events["time"] <= start], 0.0, start)
    at = run.states(np.array([start]))
    renewed = (run.events["kind"] == EventKind.RELEASE) & (run.events["time"] > start)
    anew = set(run.events["foot"][renewed].tolist())
    tables = Engine(plan, HORIZON * period).tables
    first = WalkMap(plan, tables, rows_of(plan), period, start, Contacts())
    place = np.concatenate([at.x[:, 0], at.v[:, 0]])
    return first.at_section(start, contacts, place, anew, bool(run.scene.ground.acting_on("strength")))


def _along(plan: Plan, state: Floats) -> Floats:
    """Speeds (m,) [m/s] of the feet along the way."""
    assert plan.legs is not None
    n, nb = len(plan.system.mass), len(plan.legs.body.body_mass)
    return state[n + nb :: 2][plan.legs.body.leg]


def _quiet(events: NDArray[np.void], begin: float, end: float) -> float:
    """Middle [s] of the longest time without an event between two times."""
    times = events["time"]
    edges = np.concatenate([[begin], times[(times > begin) & (times < end)], [end]])
    longest = int(np.argmax(np.diff(edges)))
    return float(0.5 * (edges[longest] + edges[longest + 1]))
