"""A walker: a rigid body on legs, each a foot of its own mass on springs and dampers below its hip."""

from __future__ import annotations

from collections import Counter
from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from tarsus.base.errors import InputError
from tarsus.base.messages import PathErrors
from tarsus.base.spec import Amount, Description, MaybeAmount, Named, quantity
from tarsus.model.structure.base import Array, Matrices, Structure


class WalkerBody(Description):
    """The rigid body: it surges and heaves, and rolls or pitches where it has that inertia."""

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
        "kg m^2",
        "moment of inertia about y, to the left; absent: the body does not pitch",
        default=None,
        gt=0,
    )


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


class Walker(Structure):
    """A rigid body on n legs, linear for small angles: (4.4)-(4.6) for any number of legs, with roll and pitch.

    Coordinates in order: ``surge`` x forward and ``heave`` z upward of the centre of mass [m], ``roll`` about +x and
    ``pitch`` about +y [rad] where the body has that inertia, then for each leg its foot's x and its foot's height
    [m].  A hip at (X, Y, Z) from the centre of mass has the height ``heave + Y roll - X pitch`` and the place along
    the way ``surge + Z pitch``; springs and dampers act between hip and foot.  Feet are coupled through the body only.

    Points, along +z unless the name ends in ``_x`` (then along +x): ``body`` and ``body_x``, and for a leg ``L`` its
    foot ``L`` and ``L_x`` and its hip ``L_hip`` and ``L_hip_x``.
    """

    kind: Literal["walker"] = "walker"
    body: WalkerBody
    legs: Named[WalkerLeg] = Field(description="legs by name, at least one")

    @model_validator(mode="after")
    def _check(self) -> Walker:
        if not self.legs:
            raise PathErrors([("legs", "expected at least one leg, got none")])
        counts = Counter(self.points)
        owners = {leg: [point for point in _leg_points(leg) if counts[point] > 1] for leg in self.legs}
        faults = [
            (f"legs.{leg}", f"its point '{shared[0]}' would bear the name of another point: rename the leg")
            for leg, shared in owners.items()
            if shared
        ]
        if faults:
            raise PathErrors(faults)
        return self

    @property
    def body_coordinates(self) -> tuple[str, ...]:
        """Names of the body's coordinates (nb), in order."""
        rolls = ("roll",) if self.body.roll_inertia is not None else ()
        pitches = ("pitch",) if self.body.pitch_inertia is not None else ()
        return ("surge", "heave", *rolls, *pitches)

    @property
    def body_size(self) -> int:
        """Number of the body's coordinates nb, 2 to 4."""
        return len(self.body_coordinates)

    @property
    def size(self) -> int:
        """Number of coordinates: nb, and two a leg."""
        return self.body_size + 2 * len(self.legs)

    @property
    def points(self) -> tuple[str, ...]:
        """``body``, ``body_x``, then four of each leg."""
        return ("body", "body_x", *(point for leg in self.legs for point in _leg_points(leg)))

    def body_mass(self) -> Array:
        """Inertias of the body's coordinates (nb,) [kg, kg, kg m^2, kg m^2]."""
        turning = (self.body.roll_inertia, self.body.pitch_inertia)
        return np.array([self.body.mass, self.body.mass, *(one for one in turning if one is not None)])

    @property
    def total_mass(self) -> float:
        """Mass of body and feet [kg]."""
        return self.body.mass + sum(leg.mass for leg in self.legs.values())

    @property
    def length(self) -> float:
        """Length of the body [m]: as described, else from its first hip to its last; 0 for hips side by side."""
        along = [leg.x for leg in self.legs.values()]
        return max(along) - min(along) if self.body.length is None else self.body.length

    def hip_row_z(self, leg: str) -> Array:
        """Weights (nb,) of the body's coordinates in the height of a leg's hip; `KeyError` for an unknown leg."""
        one = self.legs[leg]
        weights = {"surge": 0.0, "heave": 1.0, "roll": one.y, "pitch": -one.x}
        return np.array([weights[name] for name in self.body_coordinates])

    def hip_row_x(self, leg: str) -> Array:
        """Weights (nb,) of the body's coordinates in the place of a leg's hip along the way; `KeyError` as above."""
        weights = {"surge": 1.0, "heave": 0.0, "roll": 0.0, "pitch": self.legs[leg].z}
        return np.array([weights[name] for name in self.body_coordinates])

    def leg_coordinate(self, leg: str) -> int:
        """Index of the coordinate of a foot's x; its height is the next one; `KeyError` for an unknown leg."""
        if leg not in self.legs:
            raise KeyError(leg)
        return self.body_size + 2 * list(self.legs).index(leg)

    def leg_of(self, point: str) -> str | None:
        """The leg that bears a point of the foot or the hip; None for the body's own points and unknown ones."""
        names = (point.removesuffix(ending) for ending in ("", *_ENDINGS) if point.endswith(ending))
        return next((name for name in names if name in self.legs), None)

    @property
    def foot_points(self) -> tuple[str, ...]:
        """Points of the feet in the order of their coordinates: ``L_x`` and ``L`` for every leg ``L``."""
        return tuple(point for leg in self.legs for point in (f"{leg}_x", leg))

    def matrices(self) -> Matrices:
        """Mass, damping and stiffness (n, n): those of (4.4) where the body only surges and heaves."""
        mass = np.diag([*self.body_mass(), *(m for leg in self.legs.values() for m in (leg.mass, leg.mass))])
        damping, stiffness = np.zeros_like(mass), np.zeros_like(mass)
        for name, leg in self.legs.items():
            along = self.row(f"{name}_hip_x") - self.row(f"{name}_x")
            upward = self.row(f"{name}_hip") - self.row(name)
            stiffness += leg.stiffness_l * np.outer(along, along) + leg.stiffness_v * np.outer(upward, upward)
            damping += leg.damping_l * np.outer(along, along) + leg.damping_v * np.outer(upward, upward)
        return Matrices(mass, damping, stiffness)

    def row(self, point: str) -> Array:
        """Weights (n,) of a point's displacement, along +x for a name that ends in ``_x``, else along +z."""
        row = np.zeros(self.size)
        leg = self.leg_of(point)
        if leg is None:
            row[{"body": 1, "body_x": 0}[point]] = 1.0
        elif point in (leg, f"{leg}_x"):
            row[self.leg_coordinate(leg) + (point == leg)] = 1.0
        else:
            row[: self.body_size] = self.hip_row_z(leg) if point == f"{leg}_hip" else self.hip_row_x(leg)
        return row

    def alone(self, point: str) -> Array:
        """The row of a foot's or the body's point: it is a coordinate; `InputError` for a hip."""
        if point not in ("body", "body_x", *self.foot_points):
            raise InputError(f"the displacement of '{point}' is no coordinate of a walker")
        return self.row(point)

    def vertical(self) -> Array:
        """Ones for heave and the heights of the feet, zeros elsewhere."""
        up = self.row("body")
        up[self.body_size + 1 :: 2] = 1.0
        return up

    def horizontal(self) -> Array:
        """Ones for surge and the feet's places along the way, zeros elsewhere."""
        ahead = self.row("body_x")
        ahead[self.body_size :: 2] = 1.0
        return ahead


_ENDINGS = ("_x", "_hip", "_hip_x")


def _leg_points(leg: str) -> tuple[str, ...]:
    return (leg, *(f"{leg}{ending}" for ending in _ENDINGS))
