"""Rigid links on sprung hinges, linear about their rest, and how far off that is where angles are not small."""

from __future__ import annotations

from collections import Counter
from itertools import chain
from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from tarsus.base.errors import InputError
from tarsus.base.linear import product, solve
from tarsus.base.messages import PathErrors, nearest
from tarsus.base.spec import Amount, Description, FrozenDict, Name, Named, quantity
from tarsus.model.structure.base import Array, Matrices, Structure

_DEPENDENT = 1e-9
"""A constraint that others leave less than this share of itself, all in lengths, says nothing new."""


class RigidLink(Description):
    """A rigid link: its mass, and where its centre of mass is at rest."""

    x: Amount = quantity("m", "place of the centre of mass at rest, along the way")
    z: Amount = quantity("m", "height of the centre of mass at rest")
    mass: Amount = quantity("kg", "mass of the link", gt=0)
    inertia: Amount = quantity("kg m^2", "moment of inertia about the centre of mass", gt=0)


class Hinge(Description):
    """A hinge between two links, or of one link on the frame, with a spring that is at ease at rest."""

    between: tuple[Name, ...] = Field(
        min_length=1, max_length=2, description="the two links that it joins, or the one that the frame holds"
    )
    x: Amount = quantity("m", "place at rest, along the way")
    z: Amount = quantity("m", "height at rest")
    stiffness: Amount = quantity("N m", "torque per angle of the bend", default=0.0, ge=0)
    damping: Amount = quantity("N m s", "torque per rate of the bend", default=0.0, ge=0)


class Pad(Description):
    """A small mass on a spring below a place: it moves upward by itself, and along the way with the link."""

    mass: Amount = quantity("kg", "mass of the pad", gt=0)
    stiffness: Amount = quantity("N/m", "stiffness between link and pad, upward", ge=0)
    damping: Amount = quantity("N s/m", "damping between link and pad, upward", default=0.0, ge=0)


class PlaceOnLink(Description):
    """A place on a link, such as its foot."""

    link: Name
    x: Amount = quantity("m", "place at rest, along the way")
    z: Amount = quantity("m", "height at rest")
    pad: Pad | None = None


class Linkage(Structure):
    """Rigid links in the plane of the way and the normal, on hinges, linear about their rest.

    Of the motions of all links (x, z of the centre [m], pitch about +y [rad], which lowers the front) hinges leave the
    coordinates: those of the first link and the pitches of the others as far as loops leave them free, see
    `coordinates`; then the heights of pads. Springs of hinges are at ease at rest. That weight turns a link that has
    turned (the stiffness of a pendulum) is left out: `gravity_stiffness` says how much that is.

    Points, along +z unless the name ends in ``_x`` (then along +x): centres of links and places ``P`` and ``P_x`` (with
    a pad ``P`` is the pad's height). The bend of a hinge ``H`` [rad], the pitch of its first link less that of the
    second, and ``L_pitch`` [rad] of a link are points too: a force on them is a torque [N m].
    """

    kind: Literal["linkage"] = "linkage"
    links: Named[RigidLink] = Field(description="links by name, at least one")
    hinges: Named[Hinge] = Field(default=FrozenDict(), description="hinges by name")
    places: Named[PlaceOnLink] = Field(default=FrozenDict(), description="places on links by name")

    @model_validator(mode="after")
    def _check(self) -> Linkage:
        faults = [] if self.links else [("links", "expected at least one link, got none")]
        named = [
            *((f"hinges.{name}.between", link) for name, hinge in self.hinges.items() for link in hinge.between),
            *((f"places.{name}.link", place.link) for name, place in self.places.items()),
        ]
        faults += [
            (path, f"there is no link '{link}'{nearest(link, self.links)}")
            for path, link in named
            if link not in self.links
        ]
        faults += [
            (f"hinges.{name}.between", "expected two links, got one twice")
            for name, hinge in self.hinges.items()
            if len(set(hinge.between)) < len(hinge.between)
        ]
        twice = [name for name, count in Counter(self.points).items() if count > 1]
        faults += [("", f"two points have the name '{name}': rename a link, a hinge or a place") for name in twice]
        if not faults and not self._motions()[1]:
            faults = [("hinges", "they leave the links no motion")]
        if faults:
            raise PathErrors(faults)
        return self

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates (n,): ``L_x``, ``L``, ``L_pitch`` of those that are free, then pads' places."""
        names = [f"{link}{ending}" for link in self.links for ending in ("_x", "", "_pitch")]
        return (*(names[k] for k in self._motions()[1]), *self._padded)

    @property
    def _padded(self) -> tuple[str, ...]:
        return tuple(name for name, place in self.places.items() if place.pad is not None)

    @property
    def size(self) -> int:
        """Number of coordinates n."""
        return len(self._motions()[1]) + len(self._padded)

    @property
    def points(self) -> tuple[str, ...]:
        """Centres of links and their pitches, places, bends of hinges."""
        links = chain.from_iterable((name, f"{name}_x", f"{name}_pitch") for name in self.links)
        return (*links, *chain.from_iterable((name, f"{name}_x") for name in self.places), *self.hinges)

    def matrices(self) -> Matrices:
        """Mass, damping and stiffness, each (n, n)."""
        motions, free = self._motions()
        mass, damping, stiffness = np.zeros((3, self.size, self.size))
        linked = slice(len(free))
        mass[linked, linked] = product(motions.T * self._inertias(), motions)
        springs: list[tuple[Array, Hinge | Pad]] = [(self.row(name), hinge) for name, hinge in self.hinges.items()]
        for name in self._padded:
            pad, height = self.places[name].pad, self.row(name)
            assert pad is not None  # as `_padded` says
            mass += pad.mass * np.outer(height, height)
            springs.append((height - self._row(self._of(name)[1]), pad))
        for stretch, spring in springs:
            damping += spring.damping * np.outer(stretch, stretch)
            stiffness += spring.stiffness * np.outer(stretch, stretch)
        return Matrices(mass, damping, stiffness)

    def row(self, point: str) -> Array:
        """Weights (n,) of a point's displacement, or of an angle [rad]."""
        if point not in self.points:
            raise KeyError(point)
        if point in self.hinges:
            return self._row(self._bend(self.hinges[point]))
        if point in self._padded:
            return np.array([float(name == point) for name in self.coordinates])
        if (link := point.removesuffix("_pitch")) != point and link in self.links:
            return self._row(self._turn(link))
        place = point if point in self.links or point in self.places else point.removesuffix("_x")
        return self._row(self._of(place)[int(place == point)])

    def vertical(self) -> Array:
        """Coordinates (n,) of a unit upward translation, projected onto what the frame leaves free."""
        return self._translation(1)

    def horizontal(self) -> Array:
        """Coordinates (n,) of a unit translation along the way, projected as well."""
        return self._translation(0)

    def gravity_stiffness(self, acceleration: float) -> Array:
        """Stiffness (n, n) that weight adds at rest and `matrices` leaves out: m g l of a pendulum.

        acceleration: of gravity [m/s^2], along -z. Compare it with ``matrices().stiffness``.
        """
        motions, free = self._motions()
        pitches = motions[2::3]
        order, bend = list(self.links), np.zeros((2 * len(self.hinges), len(free), len(free)))
        for k, hinge in enumerate(self.hinges.values()):
            for name, sign in zip(hinge.between, (1.0, -1.0), strict=False):
                link, turn = self.links[name], pitches[order.index(name)]
                arm = np.array([hinge.x - link.x, hinge.z - link.z])
                bend[2 * k : 2 * k + 2] -= sign * arm[:, None, None] * np.outer(turn, turn)
        bound = [k for k in range(len(motions)) if k not in free]
        second = np.zeros((len(motions), len(free) ** 2))  # of all motions by the free ones, as hinges hold
        second[bound] = -np.linalg.lstsq(self._constraints()[:, bound], bend.reshape(len(bend), -1), rcond=_DEPENDENT)[
            0
        ]
        out = np.zeros((self.size, self.size))
        weights = acceleration * np.array([one.mass for one in self.links.values()])
        out[: len(free), : len(free)] = (weights @ second[1::3]).reshape(len(free), len(free))
        return out

    def small_angle_error(self, states: Array) -> float:
        """Largest distance [m] of a centre or a place from its linear one: what hinges and rigid links leave is exact.

        states: coordinates (n,), or (n, times) such as ``run.states(times).x``.

        Raises InputError where the links cannot reach the coordinates.
        """
        states = np.asarray(states, dtype=float).reshape(self.size, -1)
        off = 0.0
        motions, free = self._motions()
        for x in states[: len(free)].T:
            linear = motions @ x
            exact = self._exact(linear, free)
            for link, a, b in self._arms():
                at = slice(3 * link, 3 * link + 3)
                apart = _moved(exact[at], a, b) - _moved(linear[at], a, b, linear=True)
                off = max(off, float(np.hypot(*apart)))
        return off

    # --- all links, (x, z, pitch) each, and what hinges leave of their motions

    def _inertias(self) -> Array:
        return np.array([value for one in self.links.values() for value in (one.mass, one.mass, one.inertia)])

    def _turn(self, link: str) -> Array:
        row = np.zeros(3 * len(self.links))
        row[3 * list(self.links).index(link) + 2] = 1.0
        return row

    def _bend(self, hinge: Hinge) -> Array:
        first, *second = (self._turn(link) for link in hinge.between)
        return first - second[0] if second else first

    def _at(self, link: str, x: float, z: float) -> Array:
        """Rows (2, 3 L) of the motion along the way and upward of a place that turns with a link."""
        rows, at = np.zeros((2, 3 * len(self.links))), 3 * list(self.links).index(link)
        rows[0, at], rows[1, at + 1] = 1.0, 1.0
        rows[:, at + 2] = z - self.links[link].z, self.links[link].x - x
        return rows

    def _of(self, name: str) -> Array:
        """Those of a place, or of the centre of a link."""
        one = self.places.get(name) or self.links[name]
        return self._at(one.link if isinstance(one, PlaceOnLink) else name, one.x, one.z)

    def _row(self, of_links: Array) -> Array:
        """A row of the motions of all links in the coordinates (n,)."""
        return np.concatenate([of_links @ self._motions()[0], np.zeros(len(self._padded))])

    def _arms(self) -> list[tuple[int, float, float]]:
        """Which link, and place from its centre (along, up), of all centres and places."""
        order = list(self.links)
        places = [(p.link, p.x - self.links[p.link].x, p.z - self.links[p.link].z) for p in self.places.values()]
        return [(order.index(link), a, b) for link, a, b in [*((link, 0.0, 0.0) for link in order), *places]]

    def _constraints(self) -> Array:
        """Rows (2 hinges, 3 L) that no motion has any of."""
        rows = [np.zeros((0, 3 * len(self.links)))]
        for hinge in self.hinges.values():
            first, *second = (self._at(link, hinge.x, hinge.z) for link in hinge.between)
            rows.append(first - second[0] if second else first)
        return np.vstack(rows)

    def _motions(self) -> tuple[Array, list[int]]:
        """The motions (3 L, k) that hinges leave, one for each of the k coordinates of links that are free.

        By elimination: places of links follow from the pitches before these follow from each other, later ones first.
        """
        rows, count = self._constraints(), len(self.links)
        arm = float(np.abs(rows[:, 2::3]).max(initial=0.0)) or 1.0
        unit = np.tile([1.0, 1.0, 1.0 / arm], count)  # of the coordinates, so that all constraints are of lengths
        order = [3 * link + way for link in reversed(range(count)) for way in (0, 1)]
        order += [3 * link + 2 for link in reversed(range(count))]
        left, bound = rows * unit, list[int]()
        for column in order:
            k = len(bound)
            if k == len(left):
                break
            best = k + int(np.argmax(np.abs(left[k:, column])))
            if abs(left[best, column]) <= _DEPENDENT:
                continue
            left[[k, best]] = left[[best, k]]
            left[k] /= left[k, column]
            left -= np.outer(np.where(np.arange(len(left)) == k, 0.0, left[:, column]), left[k])
            bound.append(column)
        free = [k for k in range(3 * count) if k not in bound]
        motions = np.zeros((3 * count, len(free)))
        motions[free, range(len(free))] = unit[free]
        motions[bound] = -left[: len(bound), free] * unit[bound, None]
        return motions / unit[free], free

    def _translation(self, way: int) -> Array:
        motions, free = self._motions()
        whole = np.tile(np.eye(3)[way], len(self.links))
        own = whole[free]
        if np.abs(motions @ own - whole).max() > _DEPENDENT:  # the frame holds a link
            weighted = motions.T * self._inertias()
            own = solve(product(weighted, motions), weighted @ whole)
        return np.concatenate([own, np.full(len(self._padded), float(way == 1))])

    def _exact(self, linear: Array, free: list[int]) -> Array:
        """Motions (3 L,) of all links that hold at every hinge and have the same free coordinates, by Newton's method
        from the linear ones."""
        u = linear.copy()
        bound = [k for k in range(len(u)) if k not in free]
        size = float(np.abs(self._constraints()[:, 2::3]).max(initial=0.0)) or 1.0
        for _ in range(20):
            gap, slope = self._gaps(u)
            if np.abs(gap).max(initial=0.0) <= 1e-13 * size:
                return u
            u[bound] -= np.linalg.lstsq(slope[:, bound], gap, rcond=None)[0]
        raise InputError("the hinges do not let the links go as far as these coordinates say")

    def _gaps(self, u: Array) -> tuple[Array, Array]:
        """How far apart (2 hinges,) hinges are, exactly, and the slopes (2 hinges, 3 L) of that."""
        gaps, slopes = [np.zeros(0)], [np.zeros((0, len(u)))]
        for hinge in self.hinges.values():
            gap, slope = np.zeros(2), np.zeros((2, len(u)))
            for name, sign in zip(hinge.between, (1.0, -1.0), strict=False):
                link, at = self.links[name], 3 * list(self.links).index(name)
                a, b = hinge.x - link.x, hinge.z - link.z
                gap += sign * _moved(u[at : at + 3], a, b)
                turned = _moved(np.array([a, b, u[at + 2]]), a, b)  # the arm, as it is now
                slope[:, at : at + 3] = sign * np.array([[1.0, 0.0, turned[1]], [0.0, 1.0, -turned[0]]])
            gaps.append(gap)
            slopes.append(slope)
        return np.concatenate(gaps), np.vstack(slopes)


def _moved(motion: Array, a: float, b: float, linear: bool = False) -> Array:
    """How a place (a, b) from the centre of a link moves along the way and upward, by the link's (x, z, pitch)."""
    x, z, pitch = motion
    turn, short = (pitch, 0.0) if linear else (np.sin(pitch), 2.0 * np.sin(0.5 * pitch) ** 2)
    return np.array([x + b * turn - a * short, z - a * turn - b * short])
