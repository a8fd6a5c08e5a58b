"""What every shape of uneven ground offers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator

from tarsus.base.messages import PathErrors
from tarsus.base.spec import Description, quantity

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class GroundLine:
    """The ground along one line of the way. points (np, 2) [m]: as `Profile.points`; repeats: as `Profile.repeats`;
    patches: factors of restitution, adhesion and friction of each facet (np - 1, 3), (0, 3) where all are 1."""

    points: Floats
    repeats: bool
    patches: Floats


class Relief(Description, ABC):
    """Base of uneven ground: one line for all feet, or several."""

    @abstractmethod
    def lines(self, feet: Mapping[str, float]) -> tuple[list[GroundLine], list[int]]:
        """The different lines along which feet go, and the number of each foot's. feet: places to the left of the
        robot's middle [m] by name."""

    def faults(self, feet: Mapping[str, float]) -> list[tuple[str, str]]:
        """What does not fit feet at such places, as (path, sentence)."""
        return []

    @property
    def wide(self) -> bool:
        """Whether the line of a foot depends on its place across the way."""
        return False


class Profile(Relief, ABC):
    """Base of the shapes of uneven ground: facets between the points of a polyline along the way.

    Numbers that are floats move points and never change how many there are, so that runs of one plan may differ in
    them. `restitution`, `adhesion` and `friction` are factors of these laws on one facet after the other, from the
    first point on, again and again: a friction of (1, 0.2) makes every second facet slippery.
    """

    restitution: tuple[float, ...] | None = quantity("1", "factors of the speed of departure", default=None, ge=0, le=1)
    adhesion: tuple[float, ...] | None = quantity("1", "factors of the strength of a contact", default=None, ge=0)
    friction: tuple[float, ...] | None = quantity("1", "factors of the bound of friction", default=None, ge=0)

    @abstractmethod
    def points(self) -> Floats:
        """Places along the way, from rear to front, and heights above level ground (np, 2) [m]; two points at one
        place are the side of a step."""

    def side_by_side(self, places: Sequence[float]) -> list[Floats]:
        """Points of the lines at places [m] to the left of the robot's middle, as many of each, of a shape that differs
        across the way."""
        return [self.points() for _ in places]

    def lines(self, feet: Mapping[str, float]) -> tuple[list[GroundLine], list[int]]:
        places = sorted(set(feet.values())) if self.wide else [0.0]
        every = self.side_by_side(places) if self.wide else [self.points()]
        lines = [
            GroundLine(points, self.repeats, self.patches(len(points) - 1) if self.patched else np.zeros((0, 3)))
            for points in every
        ]
        return lines, [places.index(y) if self.wide else 0 for y in feet.values()]

    @property
    def repeats(self) -> bool:
        """Whether the last point is the first one of the next cell; else the ground goes on level beyond both ends."""
        return True

    @property
    def patched(self) -> bool:
        """Whether facets are not alike."""
        return any(one is not None for one in (self.restitution, self.adhesion, self.friction))

    def patches(self, facets: int) -> Floats:
        """Factors of restitution, adhesion and friction of each facet (facets, 3)."""
        columns = (one or (1.0,) for one in (self.restitution, self.adhesion, self.friction))
        return np.stack([np.resize(np.array(one, dtype=float), facets) for one in columns], axis=1)

    @model_validator(mode="after")
    def _check_points(self) -> Profile:
        faults = profile_faults(self.points(), self.repeats)
        if faults:
            raise PathErrors([("", text) for text in faults])
        return self


def profile_faults(points: Floats, repeats: bool) -> list[str]:
    """What is wrong with the points of a profile (np, 2) [m], a sentence each."""
    if len(points) < 2:
        return [f"expected two points at least, got {len(points)}"]
    run, rise = np.diff(points, axis=0).T
    if np.any(run < 0.0):
        k = int(np.argmax(run < 0.0))
        return [f"the ground goes on forward: point {k + 1} lies behind point {k}"]
    if np.any((run == 0.0) & (rise == 0.0)):
        k = int(np.argmax((run == 0.0) & (rise == 0.0)))
        return [f"points {k} and {k + 1} are one"]
    upright = run == 0.0
    wrapped = np.append(upright, upright[0]) if repeats else upright
    if np.any(wrapped[1:] & wrapped[:-1]):
        return ["two sides of steps follow one another at one place: give the side of a step two points"]
    if repeats and not points[-1, 0] > points[0, 0]:
        return ["a ground that repeats is longer than nothing"]
    return []


def line_between(points: Floats, repeats: bool, low: float, high: float) -> Floats:
    """The ground from one place to another [m] as a line: its points there (n, 2), sides of steps among them."""
    if repeats:
        run, rise = points[-1] - points[0]
        cells = np.arange(np.floor((low - points[0, 0]) / run), np.floor((high - points[0, 0]) / run) + 1.0)
        every = (points[None, :-1] + cells[:, None, None] * [run, rise]).reshape(-1, 2)
        points = np.vstack([every, every[:1] + len(cells) * np.array([run, rise])])
    else:
        reach = [min(low, points[0, 0]), points[0, 1]], [max(high, points[-1, 0]), points[-1, 1]]
        points = np.vstack([reach[0], points, reach[1]])
    inside = points[(points[:, 0] > low) & (points[:, 0] < high)]
    ends = [[x, float(heights_of(points, False, np.array(x)))] for x in (low, high)]
    return np.vstack([ends[:1], inside, ends[1:]])


def heights_of(points: Floats, repeats: bool, x: Floats) -> Floats:
    """Height [m] of the ground at places x [m], any shape; at the side of a step, of its lower edge."""
    run, rise = points[-1] - points[0]
    cell = np.floor((x - points[0, 0]) / run) if repeats else np.zeros_like(x)
    at = x - cell * run

    def on(side: Literal["left", "right"], at: Floats) -> Floats:
        k = np.clip(np.searchsorted(points[:, 0], at, side=side), 1, len(points) - 1)
        (x0, z0), (x1, z1) = points[k - 1].T, points[k].T
        return z0 + (z1 - z0) * np.clip((at - x0) / np.where(x1 > x0, x1 - x0, 1.0), 0.0, 1.0)

    before = np.where(repeats and at == points[0, 0], on("left", at + run) - rise, on("left", at))
    return np.minimum(on("right", at), before) + cell * rise


def gaps_above(points: Floats, facets: Floats, x: Floats, z: Floats, repeats: bool) -> Floats:
    """Gaps [m] of places x, z (m,) along the normals of facets (m,) by number; NaN: of the facet below."""
    n, (run, rise) = len(points) - 1, points[-1] - points[0]
    cell = np.floor((x - points[0, 0]) / run) if repeats else np.zeros_like(x)
    below = np.searchsorted(points[:, 0], x - cell * run, side="right") - 1 + cell * n
    k = np.where(np.isnan(facets), below, facets)
    cell = np.floor(k / n) if repeats else np.zeros_like(k)
    j = (k - cell * n).astype(np.intp)
    a, b = points[np.clip(j, 0, n)], points[np.clip(j + 1, 0, n)]
    a = np.where((j < 0)[:, None], points[0], a)
    along = np.where(((j < 0) | (j >= n))[:, None], [1.0, 0.0], b - a)
    cos, sin = (along / np.hypot(*along.T)[:, None]).T
    return cos * (z - a[:, 1] - cell * rise) - sin * (x - a[:, 0] - cell * run)
