"""A robot: a structure with its drives and feet."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, field_validator, model_validator

from tarsus.base.linear import product
from tarsus.base.messages import PathErrors, nearest
from tarsus.base.spec import Amount, Amounts, Description, FrozenDict, MaybeAmount, Named, quantity
from tarsus.base.units import format_quantity
from tarsus.model.drive.amplifier import Amplifier
from tarsus.model.drive.gait import Layout, Reach
from tarsus.model.drive.laws import ForceLaw
from tarsus.model.drive.signal import Signal
from tarsus.model.structure import AnyStructure, Structure, Walker
from tarsus.model.structure.base import Array


class PointLoad(Description):
    """A drive force that acts at points: its generalised force is the sum of weight times the point's row."""

    kind: Literal["point"] = "point"
    weights: Named[float] = quantity("1", "share of the force at each named point, upward")

    def vector(self, structure: Structure) -> Array:
        """Generalised force (n,) per newton of drive force."""
        return np.sum([w * structure.row(point) for point, w in self.weights.items()], axis=0)

    def foot_points(self, walker: Walker) -> list[str]:
        """Points of feet that the load names, whatever their weights."""
        return [point for point in self.weights if point in _foot_points(walker.leg_of(point))]


class ModalLoad(Description):
    """A drive force given by its participation in each coordinate of the structure."""

    kind: Literal["modal"] = "modal"
    participation: Amounts = quantity("1", "generalised force in each coordinate per drive force")

    def vector(self, structure: Structure) -> Array:
        """Generalised force (n,) per newton of drive force."""
        return np.array(self.participation)

    def foot_points(self, walker: Walker) -> list[str]:
        """Points of feet that the load acts on."""
        shares = self.participation[walker.body_size :]
        return [point for point, share in zip(walker.foot_points, shares, strict=True) if share != 0.0]


class InertiaLoad(Description):
    """A drive that shakes the frame in which the robot is described: it acts on every mass in proportion.

    Its law gives an acceleration [m/s^2], so that the gain counts in m/s^2/V. With ``upward = -1`` it is that of a
    table under the robot, whose displacements are then those against the table.
    """

    kind: Literal["inertia"] = "inertia"
    upward: Amount = quantity("1", "acceleration of every mass upward per unit of the law", default=0.0)
    forward: Amount = quantity("1", "the same forward along the ground", default=0.0)

    def vector(self, structure: Structure) -> Array:
        """Generalised force (n,) [kg] per unit of acceleration."""
        mass = structure.matrices().mass
        ways = ((self.upward, structure.vertical()), (self.forward, structure.horizontal()))
        moves = [share * way for share, way in ways if way is not None]
        return product(mass, np.sum(moves, axis=0)) if moves else np.zeros(structure.size)

    def foot_points(self, walker: Walker) -> list[str]:
        """None: no leg by itself."""
        return []

    def faults(self, structure: Structure) -> list[tuple[str, str]]:
        """What it needs and does not have, as (field, sentence)."""
        if self.upward == 0.0 and self.forward == 0.0:
            return [("", "an inertia load needs a share: give upward, such as -1 for a table, or forward")]
        ways = (("upward", structure.vertical()), ("forward", structure.horizontal()))
        return [
            (name, f"needs the structure's own '{name}', the coordinates of a unit translation {name}")
            for name, way in ways
            if way is None and getattr(self, name) != 0.0
        ]


class Drive(Description):
    """An actuator: where its force acts, and the law from volts to force with its history.

    The generalised force on the structure is ``load.vector(structure) * law(volts)``, with the volts behind the
    amplifier.
    """

    load: Annotated[PointLoad | ModalLoad | InertiaLoad, Field(discriminator="kind")]
    law: ForceLaw
    history: Amounts = quantity("V", "volts visited before the start, such as poling", default=())
    amplifier: Amplifier = Field(default=Amplifier(), description="between signal and actuator; ideal when absent")
    capacitance: MaybeAmount = quantity(
        "F", "capacitance of the actuator, for the energy of a switching, C V^2", default=None, gt=0
    )
    recovery: MaybeAmount = quantity(
        "1",
        "share of the charge that goes back to the supply at each discharge; none when absent",
        default=None,
        ge=0,
        le=1,
    )

    def actuator_volts(self, command: Signal) -> Signal:
        """The voltage that the actuator gets for a command: the amplifier's output."""
        return self.amplifier.output(command, self.history)

    def exerted(self, volts: float = 0.0) -> float:
        """The law's force [N] at a voltage, after the drive's history."""
        return float(self.law.force([volts], self.history)[0])


class Foot(Description):
    """A point of the structure that can touch the ground.

    Its gap is ``gap + normal * displacement``, with the displacement of the point along +z. Friction acts on feet
    whose way along the ground is known: on those of a walker, and on one of another structure that says `along`.
    """

    point: str = Field(description="name of a point of the structure")
    gap: Amount = quantity("m", "clearance of the foot at rest")
    normal: int = Field(default=1, description="1 above a ground facing up, -1 below one facing down")
    electrode: str | None = Field(default=None, description="drive whose volts attract the foot to the ground")
    ground: str | None = Field(
        default=None, description="name of a ground of its own among the scene's grounds; absent: the ground"
    )
    along: str | None = Field(
        default=None,
        description="name of a point whose displacement is that of the foot along the ground, +x, for friction; "
        "absent: frictionless",
    )

    @field_validator("gap")
    @classmethod
    def _above_ground(cls, value: float) -> float:
        if value < 0.0:
            shown = format_quantity(value, "m")
            raise PathErrors([("", f"foot below ground at rest: expected a clearance of 0 or more, got {shown}")])
        return value

    @field_validator("normal")
    @classmethod
    def _unit_normal(cls, value: int) -> int:
        if value not in (1, -1):
            raise PathErrors([("", f"expected 1 (ground facing up) or -1 (facing down), got {value}")])
        return value


class Robot(Description):
    """A structure with its drives and feet."""

    structure: AnyStructure
    drives: Named[Drive] = Field(default=FrozenDict(), description="actuators by name")
    feet: Named[Foot] = Field(default=FrozenDict(), description="feet by name")

    @model_validator(mode="after")
    def _check_references(self) -> Robot:
        faults = reference_faults(
            self.structure.points,
            self.drives,
            {name: (foot.point, foot.electrode, foot.along) for name, foot in self.feet.items()},
            {
                name: tuple(drive.load.weights)
                for name, drive in self.drives.items()
                if isinstance(drive.load, PointLoad)
            },
        )
        n = self.structure.size
        for name, drive in self.drives.items():
            load = drive.load
            if isinstance(load, ModalLoad) and len(load.participation) != n:
                path = f"drives.{name}.load.participation"
                faults.append((path, f"expected {n} values, one a coordinate, got {len(load.participation)}"))
            elif isinstance(load, PointLoad) and not load.weights:
                faults.append((f"drives.{name}.load.weights", "expected at least one point, got none"))
            elif isinstance(load, InertiaLoad):
                at = f"drives.{name}.load"
                faults += [(f"{at}.{key}" if key else at, text) for key, text in load.faults(self.structure)]
        if isinstance(self.structure, Walker):
            faults += _walker_faults(self.structure, self.feet)
        if faults:
            raise PathErrors(faults)
        return self

    def layout(self) -> Layout | None:
        """Where a walker's legs stand and which drives move them; None for a structure without legs."""
        walker = self.structure
        if not isinstance(walker, Walker):
            return None
        drives: dict[str, Reach] = {}
        for name, drive in self.drives.items():
            points = drive.load.foot_points(walker)
            legs = {leg for point in points if (leg := walker.leg_of(point)) is not None}
            lateral = bool(legs) and all(
                point.endswith(("_x", "_y")) for point in points
            )  # no foot's height among them
            drives[name] = Reach(tuple(leg for leg in walker.legs if leg in legs), lateral)
        return Layout({name: (leg.x, leg.y) for name, leg in walker.legs.items()}, drives)


def _foot_points(leg: str | None) -> tuple[str, ...]:
    return () if leg is None else (leg, f"{leg}_x", f"{leg}_y", f"{leg}_ankle", f"{leg}_ankle_x")


def _walker_faults(walker: Walker, feet: Mapping[str, Foot]) -> list[tuple[str, str]]:
    """What a walker's feet must be and are not: the feet of its legs, above the ground, one a leg."""
    if not feet:
        return [("feet", "a walker needs at least one foot, the foot of one of its legs; got none")]
    faults: list[tuple[str, str]] = []
    owners: dict[str, str] = {}
    for name, foot in feet.items():
        if foot.normal != 1:
            faults.append((f"feet.{name}.normal", f"a walker stands on its ground: expected 1, got {foot.normal}"))
        if foot.along is not None:
            text = "a walker knows the way of its feet along the ground: leave it out"
            faults.append((f"feet.{name}.along", text))
        if foot.point in walker.legs:
            owner = owners.setdefault(foot.point, name)
            if owner != name:
                faults.append((f"feet.{name}.point", f"leg '{foot.point}' has a foot already, '{owner}'"))
        elif foot.point in walker.points:
            leg = walker.leg_of(foot.point)
            hint = f"; did you mean '{leg}'?" if leg is not None else nearest(foot.point, walker.legs)
            text = f"a walker's foot is that of a leg, named as the leg, got '{foot.point}'{hint}"
            faults.append((f"feet.{name}.point", text))
    return faults


def reference_faults(
    points: Sequence[str] | None,
    drives: Collection[str],
    feet: Mapping[str, tuple[str | None, str | None, str | None]],
    weights: Mapping[str, Iterable[str]],
) -> list[tuple[str, str]]:
    """Names used in a robot that nothing bears, as (path in the robot, sentence).

    Parameters
    ----------
    points
        Points of the structure; None when they are not known, and then not checked.
    drives
        Names of the drives.
    feet
        Point and electrode of each foot, and its point along the ground.
    weights
        Points that each drive's load names.
    """
    faults: list[tuple[str, str]] = []
    for name, (at, electrode, along) in feet.items():
        for key, point in (("point", at), ("along", along)):
            if points is not None and point is not None and point not in points:
                faults.append((f"feet.{name}.{key}", f"the structure has no point '{point}'{nearest(point, points)}"))
        if along is not None and along == at:
            text = f"'{along}' is the foot's own point, whose displacement is up: name another point"
            faults.append((f"feet.{name}.along", text))
        if electrode is not None and electrode not in drives:
            faults.append((f"feet.{name}.electrode", f"there is no drive '{electrode}'{nearest(electrode, drives)}"))
    for name, used in weights.items():
        for point in used:
            if points is not None and point not in points:
                path = f"drives.{name}.load.weights.{point}"
                faults.append((path, f"the structure has no point '{point}'{nearest(point, points)}"))
    return faults
