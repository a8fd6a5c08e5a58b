"""Branches of orbits along a parameter, with the points at which their character changes."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.spec import float_paths, get_value, with_values
from tarsus.files.library import SceneLike, as_scene
from tarsus.orbits.follow import Follower, Point
from tarsus.orbits.orbit import Orbit, periodic
from tarsus.orbits.special import Change, crossings, why_lost
from tarsus.orbits.stepping import FIRST, LEAST, Stepper
from tarsus.tables.table import Column, Table, Tabled

if TYPE_CHECKING:
    from tarsus.model.scene import Scene

Floats = NDArray[np.float64]

MOST_POINTS = 2000
"""Points after which a branch is left: it turns in circles or creeps."""
BEYOND = (1e-9, 1e-7, 1e-5, 1e-4, 1e-3, 1e-2, 3e-2)
"""Shares of the range by which the parameter goes on where a motion ends, to settle anew: the first is what a change is
told from the next one by, the last ones pass over what does not repeat."""


@dataclass(frozen=True)
class BranchPoint:
    """A point of a branch. at: the parameter [SI]; kind: "orbit", or what happens there; note: in words."""

    at: float
    kind: str
    orbit: Orbit
    note: str = ""

    def to_dict(self) -> dict[str, object]:
        """Plain data as `tarsus branch --json` prints of it."""
        return {"at": self.at, "kind": self.kind, "note": self.note, **self.orbit.to_dict()}


@dataclass(frozen=True)
class Branch(Tabled):
    """Orbits of a scene along a path, in the order in which they were found; ended: why it ends, in words."""

    scene: Scene
    path: str
    unit: str
    points: tuple[BranchPoint, ...]
    ended: str

    @property
    def special(self) -> tuple[BranchPoint, ...]:
        """The points at which something happens."""
        return tuple(point for point in self.points if point.kind != "orbit")

    def __repr__(self) -> str:
        kinds = [point.kind for point in self.special]
        found = ", ".join(f"{kinds.count(kind)} {kind}" for kind in dict.fromkeys(kinds)) or "nothing special"
        return f"<Branch of {self.scene.name!r} along {self.path}: {len(self.points)} points, {found}>"

    def table(self) -> Table:
        """What happens along the branch, and below it every orbit."""
        at = Column(self.path, self.unit, 10)
        orbits = [
            (
                one.at, one.orbit.kind, one.orbit.hardest_impact, one.orbit.highest_flight,
                max(map(abs, one.orbit.multipliers.tolist()), default=None),
            )
            for one in self.points
        ]  # fmt: skip
        columns = (
            at,
            "motion",
            Column("hardest impact", "m/s"),
            Column("highest flight", "m"),
            "largest |multiplier|",
        )
        ends = f"{len(self.points)} orbits; {self.ended}" if self.points else f"no orbit; {self.ended}"
        return Table(
            f"{self.scene.name} along {self.path}: {ends}",
            ("kind", at, "what", "motion"),
            [(one.kind, one.at, one.note, one.orbit.kind) for one in self.special],
            parts=[Table("Orbits", columns, orbits)],
        )

    def doubled(self, flip: BranchPoint) -> Branch:
        """The branch of twice the period that begins or ends in a flip of this one, over the same range.

        Raises InputError for a point that is no flip.
        """
        if flip.kind != "flip":
            raise InputError(
                [f"{self.path} = {flip.at:g}: a period doubles in a flip, this point is '{flip.kind}'"]
            )
        found = list(_doubled(self, flip))
        ended = found.pop().note
        return replace(self, points=tuple(found), ended=ended)

    def to_dict(self) -> dict[str, object]:
        """Plain data, SI units."""
        return {
            "scene": self.scene.name, "along": self.path, "unit": self.unit, "ended": self.ended,
            "points": [point.to_dict() for point in self.points],
        }  # fmt: skip


def branch(
    scene: SceneLike,
    along: Mapping[str, tuple[float | str, float | str]],
    *,
    multiple: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> Branch:
    """Follow the motion that a scene settles to at one value of a number, up to another value.

    Parameters
    ----------
    scene
        Or a device's name, or a scene file's path.
    along
        The path of the number, with the two values, in SI or texts with a unit, at which the branch begins and leaves
        the range: ``{"signals.pzt.amplitude": ("8 V", "7.5 V")}``.
    multiple
        Period of the motion in drive periods; the smallest by default.
    progress
        Called with the parameter's value of every point found.

    Returns
    -------
    Branch
        Points along the number, each with its orbit; those at which something happens are `Branch.special`.

    Raises
    ------
    InputError
        For more than one path, one that is none of the scene's numbers, an empty range, values that the scene does not
        take, and where no periodic motion is found at the start.
    """
    scene = as_scene(scene)
    if len(along) != 1:
        raise InputError(f"along: a branch follows one number, got {len(along)}")
    ((path, edges),) = along.items()
    known = float_paths(scene)
    get_value(scene, path)
    if path not in known:
        raise InputError([f"{path}: is no number of the scene"])
    first, last = (get_value(with_values(scene, {path: edge}), path) for edge in edges)
    if first == last:
        raise InputError([f"{path}: the range from {first:g} to {last:g} is empty"])
    found = list(_followed(scene, path, first, last, multiple, progress))
    ended = found.pop().note
    return Branch(scene, path, known[path].unit, tuple(found), ended)


def _followed(
    scene: Scene, path: str, start: float, end: float, multiple: int | None,
    progress: Callable[[float], None] | None,
) -> Iterator[BranchPoint]:  # fmt: skip
    """Points of the branch, and last one whose note says why it ends."""
    bounds, span = (min(start, end), max(start, end)), abs(end - start)
    heading, first = float(np.sign(end - start)), periodic(scene, values={path: start}, multiple=multiple)
    while True:
        follower = Follower.of(replace(first, scene=scene), path, span)
        now = _first_point(follower, first, start, heading)
        if now is None:
            yield BranchPoint(start, "end", first, "the branch cannot be followed from its first orbit")
            return
        yield BranchPoint(now.at, "orbit", now.orbit)
        last, lost, heading = yield from _along(follower, now, heading, bounds, progress)
        again = _beyond(follower, last, heading, bounds) if lost in (NOWHERE, GRAZED, JUMPED) else None
        if again is None:
            yield BranchPoint(last.at, "end", last.orbit, lost)
            return
        start, first = again


def _along(
    follower: Follower, now: Point, heading: float, bounds: tuple[float, float],
    progress: Callable[[float], None] | None,
) -> Generator[BranchPoint, None, tuple[Point, str, float]]:  # fmt: skip
    """Points of a branch after a first one: from the last of them why it ends, and the sense of the parameter there."""
    low, high = bounds
    steps = Stepper(follower, now)
    for _ in range(MOST_POINTS):
        ahead, margins = steps.ahead()
        now = steps.now
        if ahead is None:
            if (reason := why_lost(now)) is not None:
                yield BranchPoint(now.at, reason[0], now.orbit, reason[1])
            return now, NOWHERE, heading
        if isinstance(ahead, Change):
            kind, words = ahead.what
            yield BranchPoint(ahead.here.at, kind, ahead.here.orbit, words)
            if ahead.jumps:
                return ahead.here, GRAZED if kind == "grazing" else JUMPED, heading
            steps.go(ahead.there)
            continue
        heading = float(np.sign(ahead.at - now.at)) or heading
        for kind, at, note in crossings(steps.follower, now, ahead):
            yield BranchPoint(at.at, kind, at.orbit, note)
        if progress is not None:
            progress(ahead.at)
        if not low <= ahead.at <= high:
            yield from _at_edge(steps.follower, now, ahead, low if ahead.at < low else high)
            return ahead, LEFT, heading
        steps.go(ahead, margins)
        yield BranchPoint(ahead.at, "orbit", ahead.orbit)
    return now, f"more than {MOST_POINTS} points", heading


def _doubled(branch: Branch, flip: BranchPoint) -> Iterator[BranchPoint]:
    """Points of the branch of twice the period that meets another one in a flip, and last one that says why it ends."""
    ats = [point.at for point in branch.points]
    bounds, orbit = (min(ats), max(ats)), replace(flip.orbit, scene=branch.scene)
    follower = replace(Follower.of(orbit, branch.path, bounds[1] - bounds[0]), multiple=2 * orbit.multiple)
    returns = orbit.map
    values, vectors = np.linalg.eig(returns.free.T @ orbit.derivative)
    away = returns.free @ np.real(vectors[:, int(np.argmin(np.abs(values + 1.0)))])
    along = np.append(returns.free.T @ (away / follower.scale), 0.0)
    along /= np.linalg.norm(along)
    place = follower.place(flip.at, orbit.state, returns)
    yield BranchPoint(flip.at, "flip", flip.orbit, flip.note)
    step = FIRST
    while step >= LEAST:
        now = follower.solve(place + step * along, along, float(along @ place) + step)
        if now is not None and abs(float(along @ (now.place - place))) > 0.5 * step:
            break
        step *= 0.5
    else:
        yield BranchPoint(flip.at, "end", flip.orbit, NOWHERE)
        return
    yield BranchPoint(now.at, "orbit", now.orbit)
    last, lost, _ = yield from _along(follower, now, float(np.sign(now.at - flip.at)), bounds, None)
    yield BranchPoint(last.at, "end", last.orbit, lost)


NOWHERE = "no orbit was found any further"
GRAZED = "an orbit grazes the ground, and no other begins there"
JUMPED = "a landing is decided otherwise, and the motion is another one beyond"
LEFT = "it leaves the range"


def _first_point(follower: Follower, orbit: Orbit, at: float, sense: float) -> Point | None:
    """The first orbit as a point, its tangent towards the range."""
    returns = follower.map(at)
    place = follower.place(at, orbit.state, returns)
    along = np.zeros_like(place)
    along[-1] = sense
    return follower.solve(place, along, float(along @ place))


def _at_edge(follower: Follower, before: Point, after: Point, edge: float) -> Iterator[BranchPoint]:
    """The orbit at the end of the range, between the last point inside and the first outside."""
    part = (edge - before.at) / (after.at - before.at)
    along = np.zeros_like(before.place)
    along[-1] = 1.0
    found = follower.solve(before.place + part * (after.place - before.place), along, edge / follower.span)
    if found is not None:
        yield BranchPoint(edge, "orbit", found.orbit)


def _beyond(
    follower: Follower, last: Point, heading: float, bounds: tuple[float, float]
) -> tuple[float, Orbit] | None:
    """Value and orbit of what the motion at a point settles to a little further along; None where to none."""
    for share in BEYOND:
        further = last.at + heading * share * follower.span
        if not bounds[0] <= further <= bounds[1]:
            return None
        found = follower.settled(last, further)
        if found is not None:
            return further, found
    return None
