"""Orbits along a parameter: the next point of a branch from the last ones, by pseudo-arclength.

Unknowns are u = (state at the section along its free directions, parameter), each in units of its size; beside
P(s, p) - s = 0 a point satisfies t . (u - u_predicted) = 0, t the tangent of the branch, so that folds are passed.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.orbits.looks import kept_events
from tarsus.orbits.margins import Margins, margins_of
from tarsus.orbits.orbit import CLOSED, TRANSIENTS, Orbit, stable_near
from tarsus.orbits.returns import Returned, ReturnMap, drive_period, middle_of_flight
from tarsus.orbits.walking import WalkMap
from tarsus.solve.codes import ResultCode
from tarsus.solve.simulate import Shared

if TYPE_CHECKING:
    from tarsus.model.scene import Scene
    from tarsus.solve.tangents import Entering

Floats = NDArray[np.float64]

CORRECTIONS = 8
"""Steps of Newton's method for a point; a step along the branch that needs more is halved."""
DIFFERENCE = 1e-7
"""Share of the parameter's range by which it is moved to see the return move where Newton's method seeks a point, which
satisfies its equations whatever the slope was, and where there are no derivatives by the parameter."""
PERIODS = 1e-5
"""Share of the parameter's value by which it is moved to see the drives' period move, a quotient of numbers: the rest
is the square of that."""
MARGIN = 0.1
"""Part of the flight around the section that must stay free of events on either side, or the section is moved."""


@dataclass(frozen=True)
class Point:
    """A point of a branch: parameter [SI], orbit, place (r + 1,) in scaled unknowns; follower: that found it; known
    (r + 1,): direction that its tangent agrees with; moved (r,): how its return moves with the scaled parameter, about,
    by which it was found."""

    at: float
    orbit: Orbit
    place: Floats
    follower: Follower
    known: Floats
    moved: Floats

    @cached_property
    def sequence(self) -> tuple[tuple[int, int], ...]:
        return sequence(self.orbit)

    @cached_property
    def later(self) -> float:
        """By how much the section is later with the parameter [s], where the drives' period changes with it."""
        follower, step = self.follower, PERIODS * (self.at or self.follower.span)
        around = [drive_period(follower.scene_at(self.at + one)) for one in (-step, step)]
        return follower.phase * (around[1] - around[0]) / (2.0 * step)

    @cached_property
    def entered(self) -> Entering | None:
        """What enters the orbit, with derivatives by the parameter; None where there are none."""
        orbit, follower = self.orbit, self.follower
        try:
            return orbit.map.by_value(orbit.scene, follower.path, self.later, orbit.state)
        except InputError:
            return None

    @cached_property
    def column(self) -> Floats:
        """How its return moves (r,) with the scaled parameter: exactly, where there is a derivative by it."""
        orbit, follower = self.orbit, self.follower
        if self.entered is None:
            return self.moved
        end = orbit.start + orbit.period
        found = orbit.map.returning(orbit.map.tangents(orbit.state, self.entered, [end]))[:, 0]
        if self.later:
            found = found + orbit.map.rate(orbit.state, end) * self.later * end / orbit.start
        return orbit.map.free.T @ (found / follower.scale) * follower.span

    @cached_property
    def tangent(self) -> Floats:
        """Unit vector (r + 1,) along the branch, in scaled unknowns."""
        flow = self.follower.flow(self.orbit.map, self.orbit.derivative)
        return _null(np.column_stack([flow, self.column]), self.known)

    def margins(self, looks: tuple[int, ...] = ()) -> Margins | None:
        """The margins of its events, with slopes by the distance along the branch; None where there are no derivatives
        by the parameter."""
        if self.entered is None:
            return None
        orbit, value = self.orbit, float(self.tangent[-1] * self.follower.span)
        way = (orbit.map.free @ self.tangent[:-1]) * self.follower.scale
        return margins_of(orbit, orbit.map.by_way(self.entered, way), value, self.later, looks)


@dataclass(frozen=True)
class Follower:
    """Finds points of a branch of a scene along a path.

    phase: the section, in drive periods; first: the map there at some value, with what the feet do; span: range of the
    parameter [SI]; scale (2n,): sizes of the state's entries.
    """

    scene: Scene
    path: str
    multiple: int
    phase: float
    first: ReturnMap
    span: float
    scale: Floats
    shared: Shared = field(default_factory=Shared, compare=False, repr=False)

    @staticmethod
    def of(orbit: Orbit, path: str, span: float) -> Follower:
        """From an orbit, with its section."""
        phase = orbit.start / orbit.map.period
        return Follower(
            orbit.scene, path, orbit.multiple, phase, orbit.map, span, orbit.map.scales(orbit.state)
        )

    def map(self, at: float) -> ReturnMap:
        """The return map at a value of the parameter [SI]."""
        return self.first.at_values(self.scene, self.phase, {self.path: at}, self.shared)

    def place(self, at: float, state: Floats, returns: ReturnMap) -> Floats:
        """Scaled unknowns (r + 1,) of a state and a parameter."""
        return np.append(returns.free.T @ (state / self.scale), at / self.span)

    def flow(self, returns: ReturnMap, derivative: Floats) -> Floats:
        """Derivative (r, r) of a return less the state, in scaled unknowns."""
        free = returns.free
        flow = free.T @ (derivative / self.scale[:, None]) @ (free.T @ (self.scale[:, None] * free))
        return flow - np.eye(len(flow))

    def solve(self, first: Floats, normal: Floats, level: float, like: Point | None = None) -> Point | None:
        """The point of the branch with ``normal . u = level`` near scaled unknowns; None where there is none nearby.

        like: a point of the branch, which tells the direction of the tangent.
        """
        u, best, moved = first.copy(), np.inf, None if like is None else like.column
        for _ in range(CORRECTIONS):
            at = float(u[-1] * self.span)
            try:
                returns = self.map(at)
            except InputError:
                return None
            free = returns.free
            state = (free @ u[:-1]) * self.scale
            back = returns(state, self.multiple)
            if back.code is not ResultCode.DONE or list(back.contacts.held) != list(self.first.contacts.held):
                return None
            miss = free.T @ ((back.state - state) / self.scale)
            size = float(np.abs(miss).max(initial=0.0))
            off = float(normal @ u - level)
            derivative = returns.derivative(state, self.multiple)
            if moved is None:  # it only points the way: once is enough
                moved = free.T @ (self._moved(state, at, back) / self.scale)
            if size <= CLOSED or (size <= 10.0 * CLOSED and size >= 0.5 * best):
                orbit = Orbit(self.scene_at(at), returns, self.multiple, state, size, derivative, back)
                return Point(at, orbit, u, self, normal if like is None else like.tangent, moved)
            if not np.isfinite(size) or size > 1e3 * best:
                return None
            best = min(best, size)
            jacobian = np.vstack([np.column_stack([self.flow(returns, derivative), moved]), normal])
            u = u - np.linalg.lstsq(jacobian, np.append(miss, off), rcond=None)[0]
        return None

    def _moved(self, state: Floats, at: float, back: Returned) -> Floats:
        """By how much the return moves (2n,) with the parameter in units of its span, to the side on which its events
        are the same."""
        for part in (DIFFERENCE, -DIFFERENCE):
            ahead = self.map(at + part * self.span)(state, self.multiple)
            if ahead.kinds == back.kinds:
                break
        return (ahead.state - back.state) / part

    def scene_at(self, at: float) -> Scene:
        """The scene with a value [SI] of the parameter."""
        return with_values(self.scene, {self.path: at})

    def settled(self, point: Point, at: float) -> Orbit | None:
        """The stable orbit that the motion at a point settles to where the parameter is changed to a value [SI]; None
        where it settles to none."""
        try:
            returns, state = self.map(at), point.orbit.state
        except InputError:
            return None
        for count in TRANSIENTS:
            carried = returns.carried(state, count)
            if carried is None:
                return None
            returns, state = carried
            found = stable_near(self.scene_at(at), returns, state)
            if found is not None:
                return found
        return None

    def crowded(self, point: Point) -> bool:
        """Whether an event of the orbit has come close to the section."""
        if self.first.contacts.held and not isinstance(self.first, WalkMap):
            return False
        times = point.orbit.events["time"]
        if not len(times):
            return False
        before, after = float(times[0]), point.orbit.period - float(times[-1])
        return min(before, after) < MARGIN * (before + after)

    def moved(self, point: Point) -> tuple[Follower, Point]:
        """The same with its section in the middle of the longest time in which no foot is on the ground, of a gait of
        that without an event."""
        orbit = point.orbit
        if isinstance(orbit.map, WalkMap):
            first, state = orbit.map.later(orbit.state, orbit.events, orbit.multiple)
        else:
            later = middle_of_flight({}, orbit.events, 0.0, orbit.period) or 0.0
            first = replace(orbit.map, start=orbit.start + later)
            found = orbit.map.window(orbit.state, [first.start]).states
            state = np.concatenate([found.x[:, 0], found.v[:, 0]])
        phase = self.phase + (first.start - orbit.start) / orbit.map.period
        follower = replace(self, phase=phase, first=first, scale=first.scales(state))
        place = follower.place(point.at, state, follower.map(point.at))
        upward = np.zeros_like(place)
        upward[-1] = np.sign(point.tangent[-1]) or 1.0
        again = follower.solve(place, upward, float(upward @ place))
        return (follower, again) if again is not None else (self, point)


def sequence(orbit: Orbit) -> tuple[tuple[int, int], ...]:
    """(foot, kind) of the events of a period that distinguish one motion from another, in order."""
    events = orbit.events
    return tuple((int(events["foot"][i]), int(events["kind"][i])) for i in kept_events(events))


def _null(jacobian: Floats, like: Floats) -> Floats:
    """Unit vector that a matrix (r, r + 1) takes to zero, in the direction of another."""
    found = np.linalg.svd(jacobian)[2][-1]
    return found if found @ like >= 0.0 else -found
