"""Orbits along a parameter: the next point of a branch from the last ones, by pseudo-arclength.

Unknowns are u = (state at the section along its free directions, parameter), each in units of its size; besides
P(s, p) - s = 0 a point satisfies t . (u - u_predicted) = 0, t the tangent of the branch, so that folds are passed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.orbits.differences import return_slopes
from tarsus.orbits.newton import zero_near
from tarsus.orbits.orbit import TRANSIENTS, Orbit, stable_near
from tarsus.orbits.returns import Returned, ReturnMap
from tarsus.orbits.walking import WalkMap
from tarsus.solve import Contacts, Shared

if TYPE_CHECKING:
    from tarsus.model.scene import Scene

Floats = NDArray[np.float64]

MARGIN = 0.1
"""Part of the flight around the section that must stay free of events on either side, or the section is moved."""


@dataclass(frozen=True)
class Point:
    """A point of a branch: parameter [SI], orbit, place (r + 1,) in scaled unknowns; follower: that found it; known
    (r + 1,): direction that its tangent agrees with; corrections: steps that Newton's method took to it."""

    at: float
    orbit: Orbit
    place: Floats
    follower: Follower
    known: Floats
    corrections: int = 0

    @property
    def sequence(self) -> tuple[tuple[int, int], ...]:
        """(foot, kind) of its events, in order."""
        return self.orbit.sequence

    @cached_property
    def slopes(self) -> Floats:
        """Derivative (r, r + 1) of its return less the state by all scaled unknowns."""
        orbit, follower = self.orbit, self.follower
        flow = follower.flow(orbit.map, orbit.derivative)
        return np.column_stack([flow, follower.column(orbit.state, self.at, orbit.returned, orbit.map)])

    @cached_property
    def tangent(self) -> Floats:
        """Unit vector (r + 1,) along the branch, in scaled unknowns."""
        found = np.linalg.svd(self.slopes)[2][-1]
        return found if found @ self.known >= 0.0 else -found


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
        return Follower(orbit.scene, path, orbit.multiple, phase, orbit.map, span, orbit.map.scales(orbit.state))

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

        like: a point of the branch, which gives the direction of the tangent.
        """

        def mismatch(place: Floats) -> tuple[tuple[ReturnMap, Floats, Returned], Floats] | None:
            try:
                returns = self.map(float(place[-1] * self.span))
            except InputError:
                return None
            state = (returns.free @ place[:-1]) * self.scale
            back = returns(state, self.multiple)
            if not self.first.goes_on(back):
                return None
            miss = returns.free.T @ ((back.state - state) / self.scale)
            return (returns, state, back), np.append(miss, float(normal @ place - level))

        def derivatives(place: Floats, what: tuple[ReturnMap, Floats, Returned]) -> Floats:
            returns, state, back = what
            flow = self.flow(returns, returns.derivative(state, self.multiple, back, fine=False))
            column = self.column(state, float(place[-1] * self.span), back, returns)
            return np.vstack([np.column_stack([flow, column]), normal])

        found = zero_near(mismatch, derivatives, first, None if like is None else np.vstack([like.slopes, normal]))
        if found is None:
            return None
        at, (returns, state, back) = float(found.place[-1] * self.span), found.what
        orbit = Orbit(self.scene_at(at), returns, self.multiple, state, found.size, back)
        known = normal if like is None else like.tangent
        return Point(at, orbit, found.place, self, known, found.count)

    def returns_at(self, places: Floats) -> list[Orbit | None]:
        """What scaled unknowns (k, r + 1) near the branch return to, as if they were orbits; None of those that do not
        return. Raises InputError where the scene does not take a value."""
        ats = places[:, -1] * self.span
        maps = self.first.at_each(self.scene, self.phase, self.path, ats, self.shared)
        return [self._return_at(*one) for one in zip(places, ats.tolist(), maps, strict=True)]

    def _return_at(self, place: Floats, at: float, returns: ReturnMap) -> Orbit | None:
        state = (returns.free @ place[:-1]) * self.scale
        back = returns(state, self.multiple)
        size = float(np.abs((back.state - state) / self.scale).max(initial=0.0))
        return Orbit(self.scene, returns, self.multiple, state, size, back) if returns.goes_on(back) else None

    def column(self, state: Floats, at: float, own: Returned, returns: ReturnMap) -> Floats:
        """How the return of a state moves (r,) with the scaled parameter, the section being at the same phase."""

        def copies(steps: Sequence[tuple[int, float]]) -> list[Returned | None]:
            return [self._returned(state, at + step * self.span) for _, step in steps]

        slopes = return_slopes(own, copies, 1, returns.scales(state))[:, 0]
        return returns.free.T @ (slopes / self.scale)

    def _returned(self, state: Floats, at: float) -> Returned | None:
        """The return of a state at a value of the parameter [SI]; None where the scene does not take that."""
        try:
            return self.map(at)(state, self.multiple)
        except InputError:
            return None

    def scene_at(self, at: float) -> Scene:
        """The scene with a value [SI] of the parameter."""
        return with_values(self.scene, {self.path: at})

    def settled(self, point: Point, at: float) -> Orbit | None:
        """The stable orbit that the motion at a point settles to where the parameter is changed to a value [SI]; None
        where it settles to none."""
        returns, state = self.first, point.orbit.state
        for count in TRANSIENTS:
            try:
                returns = self.map(at) if count == TRANSIENTS[0] else returns
                ahead = returns.propagated(state, count)
            except InputError:
                return None
            if ahead is None:
                return None
            returns, state = ahead
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
            later = Contacts().middle_of_flight(orbit.events, 0.0, orbit.period) or 0.0
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
