"""What a robot does in the long run: every motion that runs from a box of starts settle to, and how many of them do.

Runs go on until they repeat (`tarsus.orbits.settling`); their motion distinguishes settled ones. Of each attractor one
start is run again by itself a hundred times finer, and its orbit and multipliers come from Newton's method there.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arguments import Ranges
from tarsus.base.errors import InputError
from tarsus.base.progress import Progress
from tarsus.base.verb import verb
from tarsus.base.workers import Workers
from tarsus.files.library import SceneLike, as_scene
from tarsus.measure.shares import share_of
from tarsus.measure.walking import measures_of
from tarsus.model.structure.walker import Walker
from tarsus.orbits.basins import OTHERS, Survey, classified
from tarsus.orbits.edges import Edge, edge_between, edges_of
from tarsus.orbits.orbit import Orbit, orbit_after
from tarsus.orbits.settling import ALIKE, SETTLED, Settling
from tarsus.orbits.starts import Box
from tarsus.solve import Accuracy, simulate
from tarsus.tables.numbers import amount, how_many
from tarsus.tables.table import Column, Table

if TYPE_CHECKING:
    from tarsus.measure.measure import Measures
    from tarsus.model.scene import Scene
    from tarsus.solve import Run

Floats = NDArray[np.float64]

SHOWN = 20
"""Drive periods of a settled motion that are played and measured."""
FINER = Accuracy(gap=1e-10, drive=1e-11)
"""A hundred times finer than the accuracy that runs of a batch have."""
TRIED = 4
"""Starts of an attractor that are tried one after the other until a finer run of one leads there as well: near the edge
of a basin it need not."""
WATCHED = ("mean_speed", "cost_of_transport", "bounces", "peak", "duty_factor", "impact_speed")
"""Measures in the table; all are in `Attractor.measures`."""


@dataclass(frozen=True)
class Share:
    """So many of the starts, as a share of all with its 95 % interval (Wilson's)."""

    count: int
    share: float
    low: float
    high: float

    @classmethod
    def of(cls, count: int, starts: int) -> Share:
        """So many of so many."""
        return cls(count, *share_of(count, starts))


@dataclass(frozen=True)
class Attractor:
    """A settled motion, and how many starts lead to it.

    scene: with a start that does; members: numbers of all that do, none where the scene's own start alone does;
    multiple: its period in drive periods; period [s] of the drive; settled: drive periods after which that start's run
    repeats; impacts a period of the motion, the energy lost in them [J] and travel [m] in it; confirmed: whether a run
    of that start a hundred times finer leads there.
    """

    scene: Scene
    share: Share
    members: NDArray[np.intp]
    multiple: int
    drive: float
    settled: int
    impacts: int
    energy: float
    travel: float
    confirmed: bool

    @property
    def period(self) -> float:
        """Period of the motion [s]."""
        return self.multiple * self.drive

    @property
    def speed(self) -> float:
        """Mean speed along the way [m/s]; 0 of what is no walker."""
        return self.travel / self.period

    @property
    def kind(self) -> str:
        """In words, as "period 1, 8 impacts, travels 1.539 µm"."""
        parts = [f"period {self.multiple}", how_many(self.impacts, "impact")]
        if isinstance(self.scene.robot.structure, Walker):
            parts.append(f"travels {amount(self.travel, 'm')}")
        return ", ".join(parts)

    def __repr__(self) -> str:
        return f"<Attractor of {self.scene.name!r}: {self.kind}; {self.share.share:.0%} of starts>"

    @cached_property
    def run(self) -> Run:
        """A run from its start on, whose last `SHOWN` drive periods have settled; as `simulate` makes it."""
        return simulate(self.scene, self.scene.duration)

    @cached_property
    def measures(self) -> Measures:
        """Measures of the settled part of `run`."""
        return measures_of(self.run, period=self.drive, skip=self.settled)

    @cached_property
    def orbit(self) -> Orbit | None:
        """The motion as an orbit, with its multipliers; None where there is no return map (friction of a structure,
        contacts that remember) or Newton's method finds none of its period."""
        try:
            return orbit_after(self.scene, self.settled, (self.multiple,), free=False, near=ALIKE)
        except InputError:
            return None

    def to_dict(self) -> dict[str, object]:
        """Plain data, SI units."""
        orbit, measures = self.orbit, self.measures
        return {
            "motion": self.kind,
            "starts": self.share.count,
            "share": self.share.share,
            "share_95": [self.share.low, self.share.high],
            "multiple": self.multiple,
            "period_s": self.period,
            "settled_after": self.settled,
            "impacts": self.impacts,
            "energy_J": self.energy,
            "travel_m": self.travel,
            "confirmed": self.confirmed,
            "multipliers": None if orbit is None else [[one.real, one.imag] for one in orbit.multipliers.tolist()],
            "measures": {name: one.value for name, one in measures.items()},
            "initial": {
                "displacement": list(self.scene.initial.displacement or ()),
                "velocity": list(self.scene.initial.velocity or ()),
            },
        }


@dataclass(frozen=True)
class Attractors:
    """Every settled motion that was found, most starts first, and what the others do.

    box: where the starts lie; points (nr, d) of its unit cube; label (nr,): number of the attractor that each leads to,
    or below 0 a key of `OTHERS`; own: the same of the scene's own start, which is none of these; edges: between
    neighbouring basins.
    """

    scene: Scene
    box: Box
    points: Floats
    label: NDArray[np.intp]
    own: int
    found: tuple[Attractor, ...]
    edges: tuple[Edge, ...] = ()

    def __len__(self) -> int:
        return len(self.found)

    def __getitem__(self, number: int) -> Attractor:
        return self.found[number]

    @property
    def starts(self) -> int:
        """Number of starts."""
        return len(self.points)

    @property
    def others(self) -> dict[str, Share]:
        """Starts whose runs have not settled, by what they do instead."""
        counts = {words: int((self.label == key).sum()) for key, words in OTHERS.items()}
        return {words: Share.of(count, self.starts) for words, count in counts.items() if count}

    def edge(self, first: int, second: int) -> Edge | None:
        """An edge of the basins of two attractors, by their numbers from 0, whether neighbours among the starts or not.

        None where the first basin ends at others between all pairs of starts that are tried. Raises InputError for one
        attractor twice, and for one that no start leads to.
        """
        for one in (first, second):
            if one not in range(len(self)) or not len(self[one].members) or first == second:
                raise InputError(f"edge: expected two attractors that starts lead to, got {first} and {second}")
        survey = Survey.of(self.box, None)
        stand = [self.points[one.members[0]] if len(one.members) else self.box.own[0] for one in self.found]
        return edge_between(survey, survey.settled(np.array(stand)), self.points, self.label, (first, second))

    def __repr__(self) -> str:
        return f"<Attractors of {self.scene.name!r}: {len(self)} from {self.starts} starts>"

    def __str__(self) -> str:
        return self.table().text()

    def _repr_html_(self) -> str:
        return self.table().html()

    def table(self) -> Table:
        """Attractors with their shares, and the edges between their basins."""
        walks = isinstance(self.scene.robot.structure, Walker)
        columns = (
            "motion",
            Column("starts", "%", 3),
            Column("95 % interval", "%", 2),
            Column("period", "s", 6),
            "impacts",
            Column("lost in impacts", "J", 3),
            *((Column("travel", "m", 4), Column("speed", "m/s", 4)) if walks else ()),
            Column("largest |multiplier|", "1", 4),
            "settled after",
            "finer run",
        )
        rows: list[tuple[Any, ...]] = []
        for i, one in enumerate(self.found, start=1):
            orbit = one.orbit
            largest = None if orbit is None else max(map(abs, orbit.multipliers.tolist()), default=0.0)
            way = (one.travel, one.speed) if walks else ()
            rows.append(
                (
                    f"{i}: {one.kind}",
                    one.share.share,
                    (one.share.low, one.share.high),
                    one.period,
                    one.impacts,
                    one.energy,
                    *way,
                    largest,
                    f"{one.settled} periods",
                    "the same" if one.confirmed else "another",
                )
            )
        blank = (None,) * (len(columns) - 3)
        rows += [(words, one.share, (one.low, one.high), *blank) for words, one in self.others.items()]
        notes = [f"{self.starts} starts over {self._over()}", *([MIXTURE] if len(self.found) > 1 else [])]
        title = f"Attractors of {self.scene.name}: {len(self)} from {self.starts} starts"
        parts = [self._measures(), *([self._edges()] if self.edges else [])]
        return Table(title, columns, rows, notes, parts if self.found else ())

    def compared_with(self, run: Any, words: str = "") -> Table:
        """What else the robot of a run may do: motions by their share of the starts, and which the run's start leads
        to; words: of a command line, for its scene."""
        walks = isinstance(self.scene.robot.structure, Walker)
        found: list[tuple[Any, ...]] = [
            (i, one.kind, one.share, *((one.speed,) if walks else ())) for i, one in enumerate(self.found)
        ]
        none = Share.of(0, self.starts)
        found += [
            (key, words, self.others.get(words, none), *((None,) if walks else ()))
            for key, words in OTHERS.items()
            if words in self.others or key == self.own
        ]
        rows = [
            (words, one.share, (one.low, one.high), *speed, "leads here" if key == self.own else "")
            for key, words, one, *speed in found
        ]
        columns = (
            "motion",
            Column("starts", "%", 3),
            Column("95 % interval", "%", 2),
            *((Column("speed", "m/s", 4),) if walks else ()),
            "the run's start",
        )
        notes = [f"{self.starts} starts over {self._over()}", MORE, f"tarsus attractors {words}".rstrip()]
        return Table("What it may do, settled", columns, rows, notes)

    def _over(self) -> str:
        """The box in words."""
        units = self.box.units()
        return ", ".join(
            f"{path} {amount(low, units[path])} to {amount(high, units[path])}"
            for path, (low, high) in self.box.ends.items()
        )

    def _measures(self) -> Table:
        """Measures of every attractor and their mean by share, with the spread over attractors."""
        each = [one.measures for one in self.found]
        weight = np.array([one.share.count for one in self.found], dtype=float)
        names = [name for name in WATCHED if each and all(name in one for one in each)]
        rows, units = [], []
        for name in names:
            values = np.array([one[name].value for one in each])
            counted = weight if weight.any() else None  # the scene's own start alone leads to one
            mean = float(np.average(values, weights=counted))
            spread = float(np.sqrt(np.average((values - mean) ** 2, weights=counted)))
            rows.append((name, *values.tolist(), mean, spread))
            units.append(each[0][name].unit)
        columns = (
            "measure",
            *(Column(str(i), "row") for i in range(1, len(each) + 1)),
            Column("mean by share", "row"),
            Column("spread over attractors", "row"),
        )
        return Table("Measures of the settled motions", columns, rows, units=units)

    def _edges(self) -> Table:
        rows = [
            (f"{one.between[0] + 1} and {one.between[1] + 1}", one.width, one.parting, str(one.orbit or "none found"))
            for one in self.edges
        ]
        columns = ("between", Column("starts apart by", "1", 2), "they part with", "unstable motion at the edge")
        return Table("Edges of basins", columns, rows)

    def write(self, folder: str | os.PathLike[str]) -> Path:
        """Write attractors.json and a scene file of each motion into a folder, made if it is not there, and returned.

        Raises InputError where it cannot be written.
        """
        from tarsus.orbits.files import write_attractors

        write_attractors(self, Path(folder))
        return Path(folder)

    def to_dict(self) -> dict[str, object]:
        """Plain data, SI units, as `tarsus attractors --json` prints it; attractors are numbered from 1."""
        units = self.box.units()
        return {
            "scene": self.scene.name,
            "starts": self.starts,
            "over": {
                path: {"from": low, "to": high, "unit": units[path]} for path, (low, high) in self.box.ends.items()
            },
            "attractors": [one.to_dict() for one in self.found],
            "others": {
                words: {"starts": one.count, "share": one.share, "share_95": [one.low, one.high]}
                for words, one in self.others.items()
            },
            "edges": [one.to_dict() for one in self.edges],
            "own_start": self.own + (self.own >= 0),
            "points": self.points.tolist(),
            "label": (self.label + (self.label >= 0)).tolist(),
        }


MORE = "multipliers, energies, edges of basins, and pages that play:"
MIXTURE = "a mean over starts is one over this mixture: what one robot does is one of its attractors"


@verb
def attractors(
    scene: SceneLike,
    *,
    starts: int = 60,
    over: Ranges | None = None,
    edges: bool = True,
    seed: int = 0,
    threads: Workers = None,
    progress: Progress | None = None,
) -> Attractors:
    """Find what a driven robot does in the long run, from many starts.

    Parameters
    ----------
    scene
        A scene, or a device's name or a scene file's path. Its drives are periodic.
    starts
        Number of starts, spread evenly over the box.
    over
        Ends of the box by axis, SI or texts with a unit: ``height`` and ``speed`` [m, m/s] of a robot that is placed
        or thrown as a whole, ``phase`` [rad] in their common period of all drives when it is, or paths: of ``initial``,
        of a drive's ``history``. By default heights up to those of the feet in a run of the scene, and speeds that
        carry it there.
    edges
        Look for what lies between two basins, by bisection between starts.
    seed
        Of the starts.
    threads
        Worker threads; by default one for each processor that this process may use.
    progress
        Called as ``progress(done, total, what)``: starts that have settled, then steps towards the edges.

    Returns
    -------
    Attractors
        Every settled motion with its share of the starts and 95 % interval, period [s], multipliers, measures, energy
        [J], and a run of it; shares of starts whose runs have not settled, and of chaotic ones; and what the scene's
        own start leads to, which counts in no share.

    Raises
    ------
    InputError
        For fewer than 1 start, axes that are no part of a start, drives without a common period, and where feet
        remember their contacts.

    Examples
    --------
    >>> import tarsus as ts
    >>> found = ts.attractors("millipede", starts=8, over={"height": ("0 um", "5 um")}, edges=False)
    >>> round(found[0].travel * 1e6, 2), found[0].confirmed  # um a period
    (1.54, True)
    >>> found.points.shape  # starts, axes of the box
    (8, 1)
    """
    scene = as_scene(scene)
    if starts < 1:
        raise InputError(f"starts: expected 1 or more, got {starts}")
    box = Box.of(scene, over)
    points = box.drawn(starts, seed)
    survey = Survey.of(box, threads)
    every = np.concatenate([points, box.own])
    settling = survey.settled(every, progress=progress)
    label, groups = classified(settling)
    found = tuple(_attractor(survey, settling, every, members) for members in groups)
    label, own = label[:starts], int(label[starts])
    between: tuple[Edge, ...] = ()
    if edges and len(found) > 1:
        between = edges_of(survey, settling, points, label, progress)
    return Attractors(scene, box, points, label, own, found, between)


def _attractor(survey: Survey, settling: Settling, points: Floats, members: NDArray[np.intp]) -> Attractor:
    """The attractor that some runs have settled to, the last of all runs from the scene's own start. Starts that settle
    sooner are further from the edge of its basin: the first of them that a finer run confirms stands for it."""
    tried = members[np.argsort(settling.passed[members], kind="stable")][:TRIED]
    confirmed, chosen = False, int(tried[0])
    for r in tried.tolist():
        fine = survey.settled(points[r : r + 1], FINER)
        if settling.alike(r, fine, 0):
            confirmed, chosen = True, r
            break
    k, m = int(settling.multiple[chosen]), settling.runs.plan.feet
    passed, starts = int(settling.passed[chosen]), len(points) - 1
    members = members[members < starts]
    travel = float(settling.seen[chosen, -k:, :, m].sum())
    travel = travel if abs(travel) > SETTLED * settling.sizes(chosen)[m] else 0.0
    return Attractor(
        survey.scene_at(points[chosen], passed + SHOWN),
        Share.of(len(members), starts),
        members,
        k,
        survey.period,
        passed,
        round(float(settling.counts["impacts"][chosen, -k:].sum())),
        float(settling.counts["energy"][chosen, -k:].sum()),
        travel,
        confirmed,
    )
