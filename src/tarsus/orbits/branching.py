"""Branches of orbits along a parameter: which motions are followed, and how one leads to the next.

The scene's own motion is followed from one end on; then every motion that starts at either end settle to, what each
settles to where it ends, and the motions of twice the period that meet one in a flip. A motion that is on a branch
already is not followed again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arguments import Ranges
from tarsus.base.errors import InputError
from tarsus.base.spec import float_paths, get_value, one_number, with_values
from tarsus.base.verb import verb
from tarsus.base.workers import Workers
from tarsus.files.library import SceneLike, as_scene
from tarsus.orbits.attractors import attractors
from tarsus.orbits.branches import Branch, Branches, BranchPoint
from tarsus.orbits.follow import Follower, Point
from tarsus.orbits.orbit import MOST_MULTIPLE, Orbit, converge, miss_of, periodic
from tarsus.orbits.special import APART, Change, apart, crossings, why_lost
from tarsus.orbits.stepping import FIRST, LEAST, Stepper
from tarsus.solve import Shared
from tarsus.tables.numbers import amount

if TYPE_CHECKING:
    from tarsus.model.scene import Scene

Floats = NDArray[np.float64]

MOST_POINTS = 2000
"""Points after which a branch is left: it turns in circles or creeps."""
MOST_BRANCHES = 64
"""Branches after which no further one is begun: a motion that ends and settles anew so often is chaotic in between."""
MEETS = 1e-4
"""Mismatch after half a period, of the motion's size, below which a motion is at its flip: it grows with the root of
the distance, which is 1e-8 of the range then."""
TURNS = 1e-2
"""The same where a motion turns back: in a flip it turns into itself, half a period later, and Newton's method finds a
place there to the third root of `CLOSED` alone."""
BEYOND = (1e-9, 1e-7, 1e-5, 1e-4, 1e-3, 1e-2, 3e-2)
"""Shares of the range by which the parameter goes on where a motion ends, to settle anew: the first distinguishes
a change from the next one, the last ones pass over what does not repeat."""
NOWHERE = "no orbit was found any further"
GRAZED = "an orbit grazes the ground, and no other begins there"
JUMPED = "a landing is decided otherwise, and the motion is another one beyond"
LEFT = "end of the range"
HALVED = "it meets a motion of half its period in a flip"


@verb
def branch(
    scene: SceneLike,
    along: Ranges,
    *,
    starts: int = 60,
    multiple: int | None = None,
    threads: Workers = None,
    progress: Callable[[float], None] | None = None,
) -> Branches:
    """Follow the motions that a scene settles to along a number, from one value to another and back.

    Parameters
    ----------
    scene
        A scene, or a device's name or a scene file's path. Its drives are periodic.
    along
        The path of the number, or ``volts`` or ``hz``, with its two values, in SI or texts with a unit.
    starts
        Number of starts at each of both values, every settled motion of which (`tarsus.attractors`) is followed; 0: the
        scene's own motion at the first value alone, and what that settles to where it ends.
    multiple
        Period of the scene's own motion in drive periods; the smallest by default.
    threads
        Worker threads of the starts; by default one for each processor that this process may use.
    progress
        Called with the parameter's value of every point found.

    Returns
    -------
    Branches
        One `Branch` for each motion, the scene's own first, of points along the number with their orbits; those at
        which something happens are `Branches.special`, and `Branches.coexisting` says where several motions are stable.

    Raises
    ------
    InputError
        For more than one path, one that is none of the scene's numbers, an empty range, values that the scene does not
        take, fewer than 0 starts, and where no periodic motion is found at the start (nor, with starts, at the end).
    """
    scene = as_scene(scene)
    if len(along) != 1:
        raise InputError(f"along: a branch follows one number, got {len(along)}")
    if multiple is not None and multiple < 1:
        raise InputError(f"multiple: expected a number of drive periods of 1 or more, got {multiple}")
    if starts < 0:
        raise InputError(f"starts: expected 0 or more, got {starts}")
    ((name, edges),) = along.items()
    path = one_number(scene, name)
    unit = float_paths(scene)[path].unit
    first, last = (get_value(with_values(scene, {path: edge}), path) for edge in edges)
    if first == last:
        raise InputError([f"{path}: the range from {first:g} to {last:g} is empty"])
    tracer = Tracer(scene, path, unit, (first, last), bool(starts), progress)
    others = tracer.own(multiple)
    for at in (first, last) if starts else ():
        others += tracer.settling_at(at, starts, threads)
    if not tracer.branches:
        raise InputError(others)
    return Branches(scene, path, unit, (first, last), starts, tuple(tracer.branches), tuple(others))


@dataclass(frozen=True)
class Seed:
    """A motion to be followed: where [SI], its orbit, sense of the parameter, how it was found, in words; flip: the
    point of a branch in which this one of twice the period begins."""

    at: float
    orbit: Orbit
    heading: float
    origin: str
    flip: BranchPoint | None = None


@dataclass
class Tracer:
    """Follows motions of a scene along a path between two ends [SI], every one once. everything: each from where it was
    found both ways, and doublings too."""

    scene: Scene
    path: str
    unit: str
    ends: tuple[float, float]
    everything: bool
    progress: Callable[[float], None] | None
    branches: list[Branch] = field(default_factory=list)
    shared: Shared = field(default_factory=Shared)

    @property
    def bounds(self) -> tuple[float, float]:
        """The range, in order."""
        return min(self.ends), max(self.ends)

    @property
    def span(self) -> float:
        """Length of the range."""
        return abs(self.ends[1] - self.ends[0])

    def own(self, multiple: int | None) -> list[str]:
        """Follow the scene's own motion from the first end on; what is in the way of that, in words.

        Raises InputError for that where nothing else is followed.
        """
        first, last = self.ends
        try:
            orbit = periodic(self.scene, values={self.path: first}, multiple=multiple)
        except InputError as error:
            if not self.everything:
                raise
            return [f"at {amount(first, self.unit)}: {'; '.join(error.problems)}"]
        self.begin(Seed(first, orbit, float(np.sign(last - first)), "the scene's own motion"))
        return []

    def settling_at(self, at: float, starts: int, threads: Workers) -> list[str]:
        """Follow every motion that starts at one end settle to; what is said of those that settle to none."""
        scene, where = with_values(self.scene, {self.path: at}), amount(at, self.unit)
        found = attractors(scene, starts=starts, edges=False, threads=threads)
        others = [f"at {where}: {one.count} of {starts} starts: {words}" for words, one in found.others.items()]
        heading = float(np.sign(sum(self.ends) - 2.0 * at))
        for one in found:
            share = f"{one.share.count} of {starts} starts at {where} settle to it"
            if one.orbit is None:
                others.append(
                    f"at {where}: {one.share.count} of {starts} starts: {one.kind}, of which no orbit was found"
                )
            else:
                self.begin(Seed(at, one.orbit, heading, share))
        return others

    def begin(self, seed: Seed) -> None:
        """Follow a motion, and those that it leads to."""
        waiting: list[tuple[Seed, int, str]] = [(seed, -1, "")]
        while waiting and len(self.branches) < MOST_BRANCHES:
            seed, source, side = waiting.pop(0)
            number = self.known(seed)
            if number is None:
                number = len(self.branches)
                made, leading = self.followed(seed, number)
                if made is None:
                    continue
                self.branches.append(made)
                waiting += leading
            if side:
                self.branches[source] = self.linked(self.branches[source], side, number)

    def linked(self, own: Branch, side: str, number: int) -> Branch:
        """A branch that leads to another one where it began or ended; in a flip of that, it has a point in common."""
        said = getattr(own, side)
        if said != HALVED:
            where = "what is stable of it" if self.branches[number] is own else f"branch {number + 1}"
            return replace(own, **{side: f"{said}; it settles to {where}"})
        end = own.points[-1 if side == "ended" else 0]
        flips = [point for point in self.branches[number].points if point.kind == "flip"]
        near = sorted(flips, key=lambda point: abs(point.at - end.at))[:1]
        points = (*own.points, *near) if side == "ended" else (*near, *own.points)
        return replace(own, points=points, **{side: f"it meets branch {number + 1} in a flip"})

    def known(self, seed: Seed) -> int | None:
        """The number of the branch that a motion is on."""
        near = BEYOND[0] * self.span
        for i, one in enumerate(self.branches):
            for pair in pairwise(one.points):
                low, high = sorted(point.at for point in pair)
                if low - near <= seed.at <= high + near and any(self.leads_to(point.orbit, seed) for point in pair):
                    return i
        return None

    def leads_to(self, orbit: Orbit, seed: Seed) -> bool:
        """Whether an orbit of a branch is that of a motion to be followed, changed to its value of the number."""
        if orbit.multiple != seed.orbit.multiple or sorted(orbit.sequence) != sorted(seed.orbit.sequence):
            return False
        returns = self.follower(orbit).map(seed.at)
        near = converge(self.scene, returns, orbit.state, orbit.multiple)
        return near is not None and apart(near, seed.orbit) < APART

    def follower(self, orbit: Orbit) -> Follower:
        """What follows an orbit along the path."""
        return replace(Follower.of(replace(orbit, scene=self.scene), self.path, self.span), shared=self.shared)

    def followed(self, seed: Seed, number: int) -> tuple[Branch | None, list[tuple[Seed, int, str]]]:
        """The branch of a motion, which gets a number, and what it leads to."""
        leading: list[tuple[Seed, int, str]] = []
        ways: list[tuple[list[BranchPoint], str]] = []
        inside = self.bounds[0] < seed.at < self.bounds[1] and seed.flip is None
        for heading, side in ((seed.heading, "ended"), (-seed.heading, "began")):
            if side == "began" and not (self.everything and inside):
                ways.append(([], "start of the range" if not inside else "a motion that ended settles to it there"))
                continue
            points: list[BranchPoint] = []
            followed = self.way(replace(seed, heading=heading), points)
            if followed is None:
                return None, []
            lost, beyond = followed
            ways.append((points, lost))
            if beyond is not None:
                leading.append(
                    (replace(beyond, origin=f"what branch {number + 1} settles to where it ends"), number, side)
                )
        (onward, ended), (back, began) = ways
        if seed.flip is not None:
            began = "it begins in that flip"
            back = [BranchPoint(seed.at, "orbit", seed.orbit), seed.flip]
        made = Branch(tuple([*reversed(back[1:]), *onward]), seed.origin, began, ended)
        return made, leading + self.doublings(made, number)

    def way(self, seed: Seed, points: list[BranchPoint]) -> tuple[str, Seed | None] | None:
        """Follow a motion one way and note its points: why they end, and what it settles to there; None where the
        motion is none that can be followed."""
        follower, heading = self.follower(seed.orbit), seed.heading
        now = _first_point(follower, seed.orbit, seed.at, heading)
        if now is None:
            return None
        points.append(BranchPoint(now.at, "orbit", now.orbit))
        last, lost, heading = _along(follower, now, heading, self.bounds, points, self.progress)
        if lost == HALVED:
            return lost, Seed(last.at, last.orbit, heading, "")
        settles = _beyond(follower, last, heading, self.bounds) if lost in (NOWHERE, GRAZED, JUMPED) else None
        return lost, None if settles is None else Seed(*settles, heading, "")

    def doublings(self, made: Branch, number: int) -> list[tuple[Seed, int, str]]:
        """The motions of twice the period that meet a branch in its flips."""
        out, origin = [], f"twice the period of branch {number + 1}, from its flip"
        for one in made.special:
            if self.everything and one.kind == "flip" and 2 * one.orbit.multiple <= MOST_MULTIPLE:
                now = _doubled_point(self.follower(one.orbit), one)
                if now is not None and now.at != one.at:
                    out.append((Seed(now.at, now.orbit, float(np.sign(now.at - one.at)), origin, one), number, ""))
        return out


def halved(orbit: Orbit, near: float = MEETS) -> Orbit | None:
    """The orbit of half the period that one meets where a branch of twice the period ends; None elsewhere. near:
    mismatch after half a period below which it is there."""
    if orbit.multiple % 2:
        return None
    half = orbit.multiple // 2
    if miss_of(orbit.map, orbit.state, half) > near:
        return None
    return converge(orbit.scene, orbit.map, orbit.state, half)


def _along(
    follower: Follower,
    now: Point,
    heading: float,
    bounds: tuple[float, float],
    points: list[BranchPoint],
    progress: Callable[[float], None] | None,
) -> tuple[Point, str, float]:
    """Note points of a branch after a first one: the last, why it ends there, and the sense of the parameter."""
    low, high = bounds
    steps = Stepper(follower, now)
    for _ in range(MOST_POINTS):
        ahead = steps.ahead()
        now = steps.now
        if ahead is None:
            if (reason := why_lost(now)) is not None:
                points.append(BranchPoint(now.at, reason[0], now.orbit, reason[1]))
            return now, NOWHERE, heading
        if isinstance(ahead, Change):
            kind, words = ahead.what
            points.append(BranchPoint(ahead.here.at, kind, ahead.here.orbit, words))
            if ahead.jumps:
                return ahead.here, GRAZED if kind == "grazing" else JUMPED, heading
            steps.go(ahead.there)
            continue
        heading = float(np.sign(ahead.at - now.at)) or heading
        for kind, at, note in crossings(steps.follower, now, ahead):
            if kind == "fold" and (half := halved(at.orbit, TURNS)) is not None:
                return replace(at, orbit=half), HALVED, heading
            points.append(BranchPoint(at.at, kind, at.orbit, note))
        if progress is not None:
            progress(ahead.at)
        if not low <= ahead.at <= high:
            points += _at_edge(steps.follower, now, ahead, low if ahead.at < low else high)
            return ahead, LEFT, heading
        if (half := halved(ahead.orbit)) is not None:
            return replace(ahead, orbit=half), HALVED, heading
        steps.go(ahead)
        points.append(BranchPoint(ahead.at, "orbit", ahead.orbit))
    return now, f"more than {MOST_POINTS} points", heading


def _first_point(follower: Follower, orbit: Orbit, at: float, sense: float) -> Point | None:
    """The first orbit as a point, its tangent towards the range."""
    returns = follower.map(at)
    place = follower.place(at, orbit.state, returns)
    along = np.zeros_like(place)
    along[-1] = sense
    return follower.solve(place, along, float(along @ place))


def _doubled_point(follower: Follower, flip: BranchPoint) -> Point | None:
    """The first point of the branch of twice the period that meets another one in a flip, along the direction of its
    multiplier -1."""
    orbit, follower = flip.orbit, replace(follower, multiple=2 * flip.orbit.multiple)
    returns = follower.map(flip.at)
    values, vectors = np.linalg.eig(returns.free.T @ orbit.derivative)
    away = returns.free @ np.real(vectors[:, int(np.argmin(np.abs(values + 1.0)))])
    along = np.append(returns.free.T @ (away / follower.scale), 0.0)
    along /= np.linalg.norm(along)
    place, step = follower.place(flip.at, orbit.state, returns), FIRST
    while step >= LEAST:
        now = follower.solve(place + step * along, along, float(along @ place) + step)
        if now is not None and abs(float(along @ (now.place - place))) > 0.5 * step:
            return now
        step *= 0.5
    return None


def _at_edge(follower: Follower, before: Point, after: Point, edge: float) -> list[BranchPoint]:
    """The orbit at the end of the range, between the last point inside and the first outside."""
    part = (edge - before.at) / (after.at - before.at)
    along = np.zeros_like(before.place)
    along[-1] = 1.0
    found = follower.solve(before.place + part * (after.place - before.place), along, edge / follower.span)
    return [] if found is None else [BranchPoint(edge, "orbit", found.orbit)]


def _beyond(follower: Follower, last: Point, heading: float, bounds: tuple[float, float]) -> tuple[float, Orbit] | None:
    """Value and orbit of what the motion at a point settles to a little further along; None where to none."""
    for share in BEYOND:
        further = last.at + heading * share * follower.span
        if not bounds[0] <= further <= bounds[1]:
            return None
        found = follower.settled(last, further)
        if found is not None:
            return further, found
    return None
