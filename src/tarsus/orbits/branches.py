"""What following motions along a number finds: branches, what happens on them, and where several motions coexist."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tarsus.orbits.differences import NOISE
from tarsus.orbits.orbit import ROUNDED, Orbit
from tarsus.tables.numbers import amount, digits_apart
from tarsus.tables.table import Column, Table, Tabled

if TYPE_CHECKING:
    from tarsus.model.scene import Scene

Span = tuple[float, float]


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
class Branch:
    """One motion as it changes with the number, through folds, in the order along it. origin: how it was found; began,
    ended: why it has no more points on either side, in words."""

    points: tuple[BranchPoint, ...]
    origin: str
    began: str
    ended: str

    @property
    def special(self) -> tuple[BranchPoint, ...]:
        """The points at which something happens."""
        return tuple(point for point in self.points if point.kind != "orbit")

    def __repr__(self) -> str:
        kinds = [point.kind for point in self.special]
        found = ", ".join(f"{kinds.count(kind)} {kind}" for kind in dict.fromkeys(kinds)) or "nothing special"
        return f"<Branch: {len(self.points)} points, {found}>"

    @property
    def range(self) -> Span:
        """Least and largest value of the number [SI]."""
        ats = [point.at for point in self.points]
        return min(ats), max(ats)

    def parts(self) -> list[tuple[bool, list[int]]]:
        """Runs of points between which the motion is stable or not; the last of each is the first of the next."""
        out: list[tuple[bool, list[int]]] = []
        for i, (one, other) in enumerate(pairwise(self.points)):
            usual = [point for point in (one, other) if point.kind == "orbit"] or [one, other]
            stable = all(point.orbit.stable for point in usual)
            if not out or out[-1][0] != stable:
                out.append((stable, [i]))
            out[-1][1].append(i + 1)
        return out

    def stable_spans(self) -> list[Span]:
        """Ranges of the number [SI] in which the motion is stable, one after the other along the branch."""
        out = []
        for stable, places in self.parts():
            ats = np.array([self.points[i].at for i in places])
            ways = np.sign(np.diff(ats))
            turns = np.flatnonzero(ways[1:] * ways[:-1] < 0.0) + 1  # corners: stable motions on both sides
            if stable:
                out += [(float(part.min()), float(part.max())) for part in np.split(ats, turns + 1) if np.ptp(part)]
        return out

    def to_dict(self) -> dict[str, object]:
        """Plain data, SI units."""
        points = [point.to_dict() for point in self.points]
        return {"origin": self.origin, "began": self.began, "ended": self.ended, "points": points}


@dataclass(frozen=True)
class Coexistence:
    """A range of the number [SI] in which several motions are stable; branches: numbers from 0, of one that is stable
    on two ways through the range twice."""

    low: float
    high: float
    branches: tuple[int, ...]


@dataclass(frozen=True)
class Branches(Tabled):
    """Motions of a scene along the number at a path, from one end [SI] to the other. starts: how many at each end were
    run until they settled, 0 where the scene's own motion alone is followed; others: what starts do that no branch
    follows, in words."""

    scene: Scene
    path: str
    unit: str
    ends: Span
    starts: int
    branches: tuple[Branch, ...]
    others: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.branches)

    def __getitem__(self, number: int) -> Branch:
        return self.branches[number]

    def __iter__(self) -> Iterator[Branch]:
        return iter(self.branches)

    @property
    def special(self) -> tuple[BranchPoint, ...]:
        """The points of all branches at which something happens."""
        return tuple(point for one in self.branches for point in one.special)

    def __repr__(self) -> str:
        several = f", {len(self.coexisting)} ranges of several motions" if self.coexisting else ""
        return f"<Branches of {self.scene.name!r} along {self.path}: {len(self)}{several}>"

    @cached_property
    def coexisting(self) -> tuple[Coexistence, ...]:
        """Ranges of the number in which more than one motion is stable, in order."""
        spans = [(i, span) for i, one in enumerate(self.branches) for span in one.stable_spans()]
        edges = sorted({edge for _, span in spans for edge in span})
        out: list[Coexistence] = []
        for low, high in pairwise(edges):
            both = tuple(i for i, span in spans if span[0] <= low and high <= span[1])
            if out and out[-1].high == low and out[-1].branches == both:
                low = out.pop().low
            if len(both) > 1:
                out.append(Coexistence(low, high, both))
        return tuple(out)

    def table(self) -> Table:
        """What happens along the branches, and below it the branches, where several motions are stable, and every
        orbit."""
        many = sum(len(one.points) for one in self.branches)
        heard = [
            (str(i), one.kind, one.at, one.note, one.orbit.kind)
            for i, branch in enumerate(self.branches, 1)
            for one in branch.special
        ]
        at = Column(self.path, self.unit, digits_apart(one[2] for one in heard))
        count = f"{len(self)} branch{'es' * (len(self) != 1)}, {many} orbits"
        parts = [self._branches(), self._coexisting(), self._orbits()]
        columns = ("branch", "kind", at, "what", "motion")
        return Table(f"{self.scene.name} along {self.path}: {count}", columns, heard, self.others, parts)

    def _branches(self) -> Table:
        """Every branch in a row."""
        known = digits_apart(end for one in self.branches for end in (one.points[0].at, one.points[-1].at))
        ends = (Column("from", self.unit, known), Column("to", self.unit, known))
        rows = [
            (
                str(i),
                one.points[0].at,
                one.points[-1].at,
                one.points[len(one.points) // 2].orbit.kind,
                one.origin,
                one.began,
                one.ended,
            )
            for i, one in enumerate(self.branches, 1)
        ]
        return Table("Branches", ("branch", *ends, "motion half way", "found as", "begins", "ends"), rows)

    def _coexisting(self) -> Table:
        """Ranges of several stable motions in rows."""
        rows = [(one.low, one.high, ", ".join(str(i + 1) for i in one.branches)) for one in self.coexisting]
        known = digits_apart(end for row in rows for end in row[:2])
        columns = (Column("from", self.unit, known), Column("to", self.unit, known), "branches")
        return Table("Several stable motions", columns, rows, [] if rows else [self.alone])

    @property
    def alone(self) -> str:
        """What it means that no other motion was found."""
        if not self.starts:
            return "the scene's own motion alone was followed"
        low, high = (amount(one, self.unit) for one in self.ends)
        return f"no start of {self.starts} at {low} and as many at {high} leads to a second motion where one is stable"

    def _orbits(self) -> Table:
        """Every orbit in a row."""
        rows = [
            (
                str(i),
                one.at,
                one.orbit.kind,
                one.orbit.hardest_impact,
                one.orbit.highest_flight,
                max(map(abs, one.orbit.multipliers.tolist()), default=None),
            )
            for i, branch in enumerate(self.branches, 1)
            for one in branch.points
        ]
        at = Column(self.path, self.unit, digits_apart(row[1] for row in rows))
        impact, flight = Column("hardest impact", "m/s"), Column("highest flight", "m")
        columns = ("branch", at, "motion", impact, flight, "largest |multiplier|")
        small = any(row[-1] is not None and row[-1] < NOISE for row in rows)
        return Table("Orbits", columns, rows, ROUNDED if small else ())

    def write(self, folder: str | os.PathLike[str]) -> Path:
        """Write branch.json and branch.nc into a folder, which is made if it is not there, and returned.

        Raises InputError where it cannot be written.
        """
        from tarsus.orbits.files import write_branch

        write_branch(self, Path(folder))
        return Path(folder)

    def to_dict(self) -> dict[str, object]:
        """Plain data, SI units, as `tarsus branch --json` prints it; branches are numbered from 1."""
        return {
            "scene": self.scene.name,
            "along": self.path,
            "unit": self.unit,
            "from": self.ends[0],
            "to": self.ends[1],
            "starts": self.starts,
            "branches": [one.to_dict() for one in self.branches],
            "coexisting": [
                {"from": one.low, "to": one.high, "branches": [i + 1 for i in one.branches]} for one in self.coexisting
            ],
            "others": list(self.others),
        }
