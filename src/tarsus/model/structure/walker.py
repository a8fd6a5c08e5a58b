"""A walker: a body on legs, each a foot of its own mass on springs and dampers below its hip."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from tarsus.base.errors import InputError
from tarsus.base.messages import PathErrors, nearest
from tarsus.base.spec import Amount, Description, FrozenDict, MaybeAmount, Named, quantity
from tarsus.model.structure.base import Array, Matrices, Structure


class WalkerMode(Description):
    """A mode of the free body: how hips and payloads move along by it, with modal coordinates in metres.

    A mode of a free body has no weight, and leaves its rigid motions alone.
    """

    frequency: Amount = quantity("Hz", "undamped natural frequency of the free body's mode", gt=0)
    damping_ratio: Amount = quantity("1", "damping ratio", default=0.0, ge=0)
    mass: Amount = quantity("kg", "modal mass", gt=0)
    upward: Named[float] = quantity(
        "1", "shape upward at the hip of a leg or under a payload, by its name; 0 unless given", default=FrozenDict()
    )
    along: Named[float] = quantity("1", "the same along the way", default=FrozenDict())


class Payload(Description):
    """A mass on springs and dampers on the body, which moves upward and along the way."""

    x: Amount = quantity("m", "position before the centre of mass of the body", default=0.0)
    y: Amount = quantity("m", "position to the left of it", default=0.0)
    z: Amount = quantity("m", "position above it", default=0.0)
    mass: Amount = quantity("kg", "mass of the payload", gt=0)
    stiffness_v: Amount = quantity("N/m", "stiffness between body and payload, upward", gt=0)
    damping_v: Amount = quantity("N s/m", "damping between body and payload, upward", ge=0)
    stiffness_l: Amount = quantity("N/m", "stiffness between body and payload, along the way", gt=0)
    damping_l: Amount = quantity("N s/m", "damping between body and payload, along the way", ge=0)


class WalkerBody(Description):
    """The body: it surges and heaves, rolls or pitches where it has that inertia, and may have modes of its own."""

    mass: Amount = quantity("kg", "mass of the body", gt=0)
    length: MaybeAmount = quantity(
        "m",
        "length of the body, for speeds in body lengths; absent: from its first hip to its last",
        default=None,
        gt=0,
    )
    roll_inertia: MaybeAmount = quantity(
        "kg m^2", "moment of inertia about x, forward; absent: the body does not roll", default=None, gt=0
    )
    pitch_inertia: MaybeAmount = quantity(
        "kg m^2", "moment of inertia about y, to the left; absent: the body does not pitch", default=None, gt=0
    )
    yaw_inertia: MaybeAmount = quantity(
        "kg m^2",
        "moment of inertia about z, upward, of a body whose legs move across the way; absent: it does not turn",
        default=None,
        gt=0,
    )
    modes: Named[WalkerMode] = Field(
        default=FrozenDict(), description="modes of the free body, besides its rigid motions"
    )


class WalkerTip(Description):
    """A compliant tip of a leg: a small mass that touches the ground, on springs and dampers below the foot.

    An impact stops the tip alone, and takes its energy alone; the foot above it comes to rest over the spring, in about
    half a period of the foot's mass on it.
    """

    mass: Amount = quantity("kg", "mass of the tip", gt=0)
    stiffness_v: Amount = quantity("N/m", "stiffness between foot and tip, upward", gt=0)
    damping_v: Amount = quantity("N s/m", "damping between foot and tip, upward", ge=0)
    stiffness_l: Amount = quantity("N/m", "stiffness between foot and tip, along the way", gt=0)
    damping_l: Amount = quantity("N s/m", "damping between foot and tip, along the way", ge=0)


class WalkerLeg(Description):
    """One leg: where its hip is in the body, and the mass of its foot on two springs and dampers below it."""

    x: Amount = quantity("m", "position of the hip before the centre of mass", default=0.0)
    y: Amount = quantity("m", "position of the hip to the left of the centre of mass", default=0.0)
    z: Amount = quantity("m", "position of the hip above the centre of mass", default=0.0)
    mass: Amount = quantity("kg", "mass of the foot, what of the leg moves with it", gt=0)
    stiffness_v: Amount = quantity("N/m", "stiffness between hip and foot, upward", ge=0)
    damping_v: Amount = quantity("N s/m", "damping between hip and foot, upward", ge=0)
    stiffness_l: Amount = quantity("N/m", "stiffness between hip and foot, along the way", ge=0)
    damping_l: Amount = quantity("N s/m", "damping between hip and foot, along the way", ge=0)
    stiffness_t: MaybeAmount = quantity(
        "N/m",
        "stiffness between hip and foot, across the way; absent: no leg moves sideways, and no body",
        default=None,
        ge=0,
    )
    damping_t: MaybeAmount = quantity(
        "N s/m", "damping between hip and foot, across the way; with stiffness_t", default=None, ge=0
    )
    tip: WalkerTip | None = Field(
        default=None, description="compliant tip below the foot, which touches the ground in its place"
    )
    tilt: MaybeAmount = quantity(
        "rad",
        "angle of a leg with a compliant tip from the normal, positive where its foot is behind its hip: upward is "
        "then along the leg, and along the way is across it",
        default=None,
        gt=-0.5 * np.pi,
        lt=0.5 * np.pi,
    )

    @property
    def end(self) -> WalkerLeg | WalkerTip:
        """What touches the ground, with its mass, springs and dampers: the foot, or its compliant tip."""
        return self if self.tip is None else self.tip


class Walker(Structure):
    """A body on n legs, linear for small angles: (4.4)-(4.6) for any number of legs, with roll and pitch.

    Coordinates in order: ``surge`` x forward and ``heave`` z upward of the centre of mass [m], ``roll`` about +x and
    ``pitch`` about +y [rad] where the body has that inertia; ``sway`` y to the left [m] where its legs move across the
    way, and ``yaw`` about +z [rad] where it has that inertia; the body's modes by name; for each payload ``P`` its
    ``P_x`` and ``P``; for each leg ``L`` with a compliant tip the foot above it, ``L_ankle_x`` and ``L_ankle``; then
    for each leg x and height of what touches the ground [m], and then for each leg its y.  A hip at (X, Y, Z) from the
    centre of mass has the height ``heave + Y roll - X pitch``, the place along the way ``surge + Z pitch - Y yaw`` and
    across it ``sway + X yaw - Z roll``, and what modes add; springs and dampers act between hip and foot.  Feet are
    coupled through the body only.  A body that yaws carries its directions with it: x is its heading (docs/turning.md).

    Points, along +z unless the name ends in ``_x`` (then along +x): ``body`` and ``body_x``, payloads, and for a leg
    ``L`` what touches the ground ``L`` and ``L_x``, its hip ``L_hip`` and ``L_hip_x``, and the foot above a compliant
    tip ``L_ankle`` and ``L_ankle_x``; where legs move across the way also ``body_y``, ``L_y`` and ``L_hip_y``, along
    +y.
    """

    kind: Literal["walker"] = "walker"
    body: WalkerBody
    legs: Named[WalkerLeg] = Field(description="legs by name, at least one")
    payloads: Named[Payload] = Field(default=FrozenDict(), description="masses on springs on the body, by name")

    @model_validator(mode="after")
    def _check(self) -> Walker:
        if not self.legs:
            raise PathErrors([("legs", "expected at least one leg, got none")])
        if sideways := self._sideways_faults():
            raise PathErrors(sideways)
        endings = (*_ENDINGS, *_ACROSS) if self.sways else _ENDINGS
        own = [
            *((f"legs.{leg}", (leg, *(f"{leg}{ending}" for ending in endings)), "leg") for leg in self.legs),
            *((f"payloads.{name}", (name, f"{name}_x"), "payload") for name in self.payloads),
            *((f"body.modes.{name}", (name,), "mode") for name in self.body.modes),
        ]
        counts = Counter((*self._body_points, *RIGID, *(point for _, points, _ in own for point in points)))
        faults = [
            (path, f"its point '{shared[0]}' would bear the name of another point: rename the {what}")
            for path, points, what in own
            if (shared := [point for point in points if counts[point] > 1])
        ]
        places = {*self.legs, *self.payloads}
        faults += [
            (f"body.modes.{name}.{way}.{at}", f"the walker has no leg or payload '{at}'{nearest(at, places)}")
            for name, mode in self.body.modes.items()
            for way, shape in (("upward", mode.upward), ("along", mode.along))
            for at in shape
            if at not in places
        ]
        if not faults and self.body_size > MOST_COORDINATES:
            text = f"modes, payloads and tips make {self.body_size} coordinates above the feet"
            faults.append(("", f"{text}: expected {MOST_COORDINATES} at most"))
        text = "a leg at an angle has a compliant tip, which touches the ground: give it a tip"
        faults += [(f"legs.{leg}.tilt", text) for leg, one in self.legs.items() if one.tilt is not None and not one.tip]
        if faults:
            raise PathErrors(faults)
        return self

    def _sideways_faults(self) -> list[tuple[str, str]]:
        """What does not go with legs that move across the way: some that do not, payloads and compliant tips."""
        given = [one.stiffness_t is not None and one.damping_t is not None for one in self.legs.values()]
        some = any(one.stiffness_t is not None or one.damping_t is not None for one in self.legs.values())
        if some and not all(given):
            odd = list(self.legs)[given.index(False)]
            text = "every leg has stiffness_t and damping_t, or none has either"
            return [(f"legs.{odd}.stiffness_t", text)]
        if not some:
            text = "a body turns about z on legs that move across the way: give them stiffness_t and damping_t"
            return [] if self.body.yaw_inertia is None else [("body.yaw_inertia", text)]
        faults = [(f"payloads.{name}", "a body that sways has no payloads") for name in self.payloads]
        text = "a leg that moves across the way has no compliant tip"
        return faults + [(f"legs.{leg}.tip", text) for leg, one in self.legs.items() if one.tip is not None]

    @property
    def sways(self) -> bool:
        """Whether body and feet move across the way."""
        return all(one.stiffness_t is not None for one in self.legs.values())

    @property
    def directions(self) -> int:
        """Directions in which a leg moves: upward, along the way, and across it."""
        return 3 if self.sways else 2

    @property
    def body_coordinates(self) -> tuple[str, ...]:
        """Names of the body's coordinates (nb), in order: all but what touches the ground."""
        turns = [getattr(self.body, f"{name}_inertia") is not None for name in TURNS]
        moves = (True, True, *turns[:2], self.sways, turns[2])
        rigid = (name for name, known in zip(RIGID, moves, strict=True) if known)
        return (*rigid, *self.body.modes, *self._carried)

    @property
    def adrift(self) -> tuple[int, ...]:
        """Coordinates that no spring holds where the feet slide freely: surge, and sway and yaw where it has them."""
        return tuple(i for i, name in enumerate(self.body_coordinates) if name in ("surge", "sway", "yaw"))

    @property
    def _carried(self) -> tuple[str, ...]:
        """Points of payloads, then of feet above compliant tips, each along the way before upward."""
        ankles = (f"{leg}_ankle" for leg, one in self.legs.items() if one.tip is not None)
        return tuple(point for name in (*self.payloads, *ankles) for point in (f"{name}_x", name))

    @property
    def body_size(self) -> int:
        """Number of the body's coordinates nb, 2 to 16."""
        return len(self.body_coordinates)

    @property
    def rigid_size(self) -> int:
        """Number of the body's rigid motions, the first of its coordinates, 2 to 6."""
        return self.body_size - len(self.body.modes) - len(self._carried)

    @property
    def size(self) -> int:
        """Number of coordinates: nb, and one a leg for each direction."""
        return self.body_size + self.directions * len(self.legs)

    @property
    def points(self) -> tuple[str, ...]:
        """``body``, ``body_x``, then those of each leg, then of payloads."""
        of_legs = (point for leg, one in self.legs.items() for point in _leg_points(leg, one))
        return (*self._body_points, *of_legs, *(p for name in self.payloads for p in (name, f"{name}_x")))

    @property
    def _body_points(self) -> tuple[str, ...]:
        return ("body", "body_x", "body_y") if self.sways else ("body", "body_x")

    def body_mass(self) -> Array:
        """Inertias of the body's coordinates (nb,) [kg, kg m^2]."""
        body = self.body
        turning = (body.roll_inertia, body.pitch_inertia, body.mass if self.sways else None, body.yaw_inertia)
        masses = {f"{leg}_ankle": one.mass for leg, one in self.legs.items()}
        masses |= {name: one.mass for name, one in self.payloads.items()}
        carried = [masses[point.removesuffix("_x")] for point in self._carried]
        own = [mode.mass for mode in self.body.modes.values()]
        return np.array([self.body.mass, self.body.mass, *(i for i in turning if i is not None), *own, *carried])

    @property
    def total_mass(self) -> float:
        """Mass of body, payloads and feet [kg]."""
        legs = [one.mass + (0.0 if one.tip is None else one.tip.mass) for one in self.legs.values()]
        return self.body.mass + sum(one.mass for one in self.payloads.values()) + sum(legs)

    @property
    def length(self) -> float:
        """Length of the body [m]: as described, else from its first hip to its last; 0 for hips side by side."""
        along = [leg.x for leg in self.legs.values()]
        return max(along) - min(along) if self.body.length is None else self.body.length

    def hip_row_z(self, leg: str) -> Array:
        """Weights (nb,) of the body's coordinates in the height of a leg's hip; `KeyError` for an unknown leg."""
        return self._mount(leg, self.legs[leg])[1]

    def hip_row_x(self, leg: str) -> Array:
        """Weights (nb,) of the body's coordinates in the place of a leg's hip along the way; `KeyError` as above."""
        return self._mount(leg, self.legs[leg])[0]

    def hip_row_y(self, leg: str) -> Array:
        """Weights (nb,) of the body's coordinates in the place of a leg's hip across the way; `KeyError` as above."""
        across = {"sway": 1.0, "yaw": self.legs[leg].x, "roll": -self.legs[leg].z}
        return np.array([across.get(one, 0.0) for one in self.body_coordinates])

    def _mount(self, name: str, at: WalkerLeg | Payload) -> tuple[Array, Array]:
        """Weights (nb,) of the body's coordinates in place and height of a hip, or of what bears a payload."""
        along = {"surge": 1.0, "pitch": at.z, "yaw": -at.y} | {
            n: one.along.get(name, 0.0) for n, one in self.body.modes.items()
        }
        upward = {"heave": 1.0, "roll": at.y, "pitch": -at.x}
        upward |= {n: one.upward.get(name, 0.0) for n, one in self.body.modes.items()}
        x, z = (np.array([way.get(one, 0.0) for one in self.body_coordinates]) for way in (along, upward))
        return x, z

    def above(self, leg: str) -> tuple[Array, Array]:
        """Weights (nb,) of the body's coordinates in place and height of what bears the end of a leg that touches the
        ground: of its hip, or of the foot above a compliant tip."""
        return self._mount(leg, self.legs[leg]) if self.legs[leg].tip is None else self._own(f"{leg}_ankle")

    def _own(self, point: str) -> tuple[Array, Array]:
        """The rows (nb,) of a point that is two coordinates of the body, along the way and upward."""
        x, z = (np.array([float(one == name) for one in self.body_coordinates]) for name in (f"{point}_x", point))
        return x, z

    def leg_coordinate(self, leg: str) -> int:
        """Index of the coordinate of a foot's x; its height is the next one, and its y, where it has one, the leg's of
        the last nl; `KeyError` for an unknown leg."""
        if leg not in self.legs:
            raise KeyError(leg)
        return self.body_size + 2 * list(self.legs).index(leg)

    def leg_of(self, point: str) -> str | None:
        """The leg that bears a point of its own; None for the body's, those of payloads, and unknown ones."""
        endings = ("", *_ENDINGS, *_ACROSS)
        names = (point.removesuffix(ending) for ending in endings if point.endswith(ending))
        return next((name for name in names if name in self.legs), None)

    @property
    def foot_points(self) -> tuple[str, ...]:
        """Points of the feet in the order of their coordinates: ``L_x`` and ``L`` for every leg ``L``, then ``L_y``."""
        across = (f"{leg}_y" for leg in self.legs if self.sways)
        return (*(point for leg in self.legs for point in (f"{leg}_x", leg)), *across)

    def within(self) -> tuple[Array, Array]:
        """Damping and stiffness (nb, nb) within the body: of modes, payloads, and legs above compliant tips."""
        nb = self.body_size
        damping, stiffness = np.zeros((nb, nb)), np.zeros((nb, nb))
        for name, mode in self.body.modes.items():
            at, omega = self.body_coordinates.index(name), 2.0 * np.pi * mode.frequency
            stiffness[at, at] = mode.mass * omega**2
            damping[at, at] = 2.0 * mode.damping_ratio * omega * mode.mass
        held = [(name, name, one, 0.0) for name, one in self.payloads.items()]
        held += [(f"{leg}_ankle", leg, one, one.tilt or 0.0) for leg, one in self.legs.items() if one.tip]
        for point, name, one, tilt in held:
            (x, z), (own_x, own_z) = self._mount(name, one), self._own(point)
            along, upward, sin, cos = own_x - x, own_z - z, np.sin(tilt), np.cos(tilt)
            for row, k, c in (
                (cos * along - sin * upward, one.stiffness_l, one.damping_l),
                (sin * along + cos * upward, one.stiffness_v, one.damping_v),
            ):
                stiffness += k * np.outer(row, row)
                damping += c * np.outer(row, row)
        return damping, stiffness

    def matrices(self) -> Matrices:
        """Mass, damping and stiffness (n, n): those of (4.4) where the body only surges and heaves."""
        ends = [one.end for one in self.legs.values()]
        feet = [m for one in ends for m in (one.mass, one.mass)] + [one.mass for one in ends if self.sways]
        mass = np.diag([*self.body_mass(), *feet])
        damping, stiffness = np.zeros_like(mass), np.zeros_like(mass)
        nb, nl = self.body_size, len(self.legs)
        damping[:nb, :nb], stiffness[:nb, :nb] = self.within()
        springs = list[tuple[int, Array, float, float]]()
        for k, (name, end) in enumerate(zip(self.legs, ends, strict=True)):
            leg, (x, z) = self.legs[name], self.above(name)
            springs.append((nb + 2 * k, x, end.stiffness_l, end.damping_l))
            springs.append((nb + 2 * k + 1, z, end.stiffness_v, end.damping_v))
            if leg.stiffness_t is not None and leg.damping_t is not None:
                springs.append((nb + 2 * nl + k, self.hip_row_y(name), leg.stiffness_t, leg.damping_t))
        add_springs(stiffness, damping, springs)
        return Matrices(mass, damping, stiffness)

    def row(self, point: str) -> Array:
        """Weights (n,) of a point's displacement, along +x for a name that ends in ``_x``, along +y of a walker that
        sways for one that ends in ``_y``, else along +z."""
        row = np.zeros(self.size)
        if point in self._carried:
            row[self.body_coordinates.index(point)] = 1.0
            return row
        leg = self.leg_of(point)
        if leg is None:
            at = {"body": "heave", "body_x": "surge", "body_y": "sway"}[point]
            row[self.body_coordinates.index(at)] = 1.0
        elif point in (leg, f"{leg}_x"):
            row[self.leg_coordinate(leg) + (point == leg)] = 1.0
        elif point == f"{leg}_y" and self.sways:
            row[self.body_size + 2 * len(self.legs) + list(self.legs).index(leg)] = 1.0
        else:
            rows = {f"{leg}_hip": self.hip_row_z, f"{leg}_hip_x": self.hip_row_x, f"{leg}_hip_y": self.hip_row_y}
            row[: self.body_size] = rows[point](leg)
        return row

    def alone(self, point: str) -> Array:
        """The row of a foot's, a payload's or the body's point: it is a coordinate; `InputError` for a hip."""
        if point not in (*self._body_points, *self._carried, *self.foot_points):
            raise InputError(f"the displacement of '{point}' is no coordinate of a walker")
        return self.row(point)

    def vertical(self) -> Array:
        """Ones for heave and the heights of payloads and feet, zeros elsewhere."""
        return self._translation(self.row("body"), 1)

    def horizontal(self) -> Array:
        """Ones for surge and the places of payloads and feet along the way, zeros elsewhere."""
        return self._translation(self.row("body_x"), 0)

    def _translation(self, row: Array, first: int) -> Array:
        row[self.body_size - len(self._carried) + first : self.body_size + 2 * len(self.legs) : 2] = 1.0
        return row


MOST_COORDINATES = 16
"""Of a body with all that moves in it: as many as the engine has room for."""

TURNS = ("roll", "pitch", "yaw")
"""Coordinates of a body that are angles [rad]."""

STRAIGHT_AHEAD = "goes by the way straight ahead, which a walker leaves whose legs move across it: leave it out"
"""What is said of ground that is not alike in all directions under a walker that sways."""

TILTS = ("roll", "pitch")
"""Those of them that tilt the body."""
SMALL = 0.3
"""Angle [rad] up to which a walker's geometry is linear, to about 5 %."""
RIGID = ("surge", "heave", "roll", "pitch", "sway", "yaw")
"""Rigid motions that a body may have, in the order of its coordinates."""

_ENDINGS = ("_x", "_hip", "_hip_x", "_ankle", "_ankle_x")
_ACROSS = ("_y", "_hip_y")


def add_springs(stiffness: Array, damping: Array, springs: Iterable[tuple[int, Array, float, float]]) -> None:
    """Add springs with dampers to matrices (n, n), in place: each with the number of the coordinate at its foot, its
    hip in the coordinates of the body (nb,), its stiffness and its damping."""
    for at, hip, own_stiffness, own_damping in springs:
        row = np.zeros(len(stiffness))
        row[: len(hip)], row[at] = hip, -1.0
        square = np.outer(row, row)
        stiffness += own_stiffness * square
        damping += own_damping * square


def _leg_points(name: str, leg: WalkerLeg) -> tuple[str, ...]:
    endings = _ENDINGS if leg.tip is not None else _ENDINGS[:3]
    if leg.stiffness_t is not None:
        endings += _ACROSS
    return (name, *(f"{name}{ending}" for ending in endings))
