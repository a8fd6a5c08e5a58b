"""Derivatives of a run from the engine, which carries eight numbers at once: of recorded steps and events, or, of a
walker, of a run that it makes again."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tarsus.core import _native
from tarsus.core.arrays import LANES
from tarsus.core.modes import NODES, ModeBook
from tarsus.solve.contacts import Contacts
from tarsus.solve.engine import Accuracy, RawRuns, settings_of, tables_of

if TYPE_CHECKING:
    from tarsus.plan.lowering import Plan
    from tarsus.solve.tangents import Entering

Floats = NDArray[np.float64]


class Doubt(IntEnum):
    """Why there is no derivative, as the engine numbers it."""

    GRAZING = _native.DOUBTS["GRAZING"]
    SIMULTANEOUS = _native.DOUBTS["SIMULTANEOUS"]
    AT_THRESHOLD = _native.DOUBTS["AT_THRESHOLD"]
    LOST = _native.DOUBTS["LOST"]
    EDGE_AT_START = _native.DOUBTS["EDGE_AT_START"]
    APART = _native.DOUBTS["APART"]
    NEAR_MISS = _native.DOUBTS["NEAR_MISS"]
    AT_CORNER = _native.DOUBTS["AT_CORNER"]


_REASONS: dict[int, str] = {
    Doubt.GRAZING: "{foot} grazes the ground at {time}: whether it touches is within the error of a step",
    Doubt.SIMULTANEOUS: "{foot} lands at {time} together with another foot: their one impact is not followed, and "
    "apart it matters which is first",
    Doubt.AT_THRESHOLD: "whether {foot} is held or bounces at {time} is within rounding of its threshold",
    Doubt.LOST: "the derivative could not be followed beyond {time}",
    Doubt.EDGE_AT_START: "an edge of a drive lies at the very start, and acts only if it is later",
    Doubt.APART: "events or edges of drives that meet at {time} move apart",
    Doubt.NEAR_MISS: "a foot turns just above the ground before {time}: it may touch it within the error of a step",
    Doubt.AT_CORNER: "{foot} comes so close to a corner of the ground at {time} that which facet it meets is not known",
}


def doubted(reason: int, foot: str, time: float) -> str:
    """Why there is no derivative from a moment [s] on, of the event of a foot."""
    return _REASONS[reason].format(foot=foot, time=f"{time:.6g} s")


def copies_of(
    given: Entering, number: int, tables: _native.LegTables
) -> list[tuple[_native.LeggedBody, _native.LegTables, float]]:
    """A walker's perturbed copies along a direction, by its number: body, step tables as the plan's, and weight."""
    key = (number, id(tables))
    if key not in given.made:
        longest = float(np.asarray(tables.lengths)[0])
        made = [
            (one.legs.native, tables_of(one, longest), weight)
            for one, weight in given.perturbed[number]
            if one.legs is not None
        ]
        given.made.setdefault(key, (tables, made))  # the tables are kept: no others can have their id
    return given.made[key][1]


def _nothing() -> Floats:
    return np.zeros(0)


@dataclass(frozen=True)
class Tangents:
    """Derivatives of a run by P numbers, last axis.

    events (ne, 12, P): of the event rows; samples (nt, 2n + 5m, P): of displacements, velocities, gaps, gap rates,
    resistive and smooth forces and pulls at sample times; flags (nf, 3): number of an event, reason, number of a path
    or -1 for all; energies, where they were asked for: of recorded runs (5, P) [J], by drives and weight, taken by
    dampers, and by resistive and smooth forces, of walkers (5, P) as in samples of a run. Of walkers: marks
    (nm, 3 + nb + 2 m, P): of their rows; since (m, P) [s]: begins of the contacts at the end.
    """

    events: Floats
    samples: Floats
    flags: NDArray[np.int64]
    energies: Floats = field(default_factory=_nothing)
    marks: Floats = field(default_factory=_nothing)
    since: Floats = field(default_factory=_nothing)

    def of_run(self, events: int, marks: int) -> Tangents:
        """Those of a walker's run with so many events and marks. The engine cuts some steps of the run that it makes
        again: where that comes to other events, as it may in chaos, there are no derivatives."""
        if (len(self.events), len(self.marks)) == (events, marks):
            return self

        def fitted(rows: Floats, count: int) -> Floats:
            rest = np.full((max(count - len(rows), 0), *rows.shape[1:]), np.nan)
            return np.concatenate([rows[:count], rest])

        flags = np.append(self.flags, [[0, Doubt.LOST, -1]], axis=0)
        return replace(self, events=fitted(self.events, events), marks=fitted(self.marks, marks), flags=flags)


def _in_lanes(given: Entering, widths: Mapping[str, int], engine: Callable[[int], Sequence[Any]]) -> Tangents:
    """What the engine makes of every eight numbers from a first one on: arrays (k, width, LANES) by name, and flags."""
    count = len(given.paths)
    parts, flags = [], []
    for first in range(0, max(count, 1), LANES):
        *found, flag = engine(first)
        parts.append(
            [np.asarray(one).reshape(-1, w, LANES) for one, w in zip(found, widths.values(), strict=True)]
        )
        rows = np.asarray(flag).reshape(-1, 3).astype(np.int64)
        rows[rows[:, 2] >= 0, 2] += first
        flags.append(rows[rows[:, 2] < count])
    joined = (np.concatenate(some, axis=2)[..., :count] for some in zip(*parts, strict=True))
    return Tangents(**dict(zip(widths, joined, strict=True)), flags=np.concatenate(flags))


def tangents(
    plan: Plan,
    book: ModeBook,
    given: Entering,
    recorded: RawRuns,
    settings: _native.Settings,
    *,
    start: float = 0.0,
    contacts: Contacts | None = None,
    times: Floats | None = None,
    energies: bool = False,
) -> Tangents:
    """Derivatives of a recorded run by what entered it: a march of the engine over its steps and events."""
    laws, n, m = plan.laws.by_programs, len(plan.system.mass), plan.feet
    when = np.zeros(0) if times is None else np.ascontiguousarray(times, dtype=float)
    begin = (contacts or Contacts()).begin(m, start)

    def engine(first: int) -> Sequence[Any]:
        own = [p for p in given.structure if first <= p < first + LANES]
        structural = [(given.derived(p, book), p - first) for p in own]
        powers = (plan.system, {p - first: given.structure[p] for p in own}) if energies else ()
        return _native.tangents_modal(
            book.native, NODES, given.row.signals, laws, settings, given.row, begin,
            given.data.lanes(first), structural, recorded, when, powers,
        )  # fmt: skip

    found = _in_lanes(given, {"events": 12, "samples": 2 * n + 5 * m, "energies": 1}, engine)
    return replace(found, energies=found.energies[:, 0])


def walk_tangents(
    plan: Plan,
    duration: float,
    given: Entering,
    *,
    tables: _native.LegTables | None = None,
    accuracy: Accuracy | None = None,
    account: bool = False,
    times: Floats | None = None,
    start: tuple[float, NDArray[np.uint8], NDArray[np.uint8], Floats] | None = None,
) -> Tangents:
    """Derivatives of a walker's run by what enters it: the engine makes the run again for every eight numbers, and
    these follow it. Other parameters as for `walk`."""
    assert plan.legs is not None
    legs, laws, n, m = plan.legs, plan.laws.by_programs, len(plan.system.mass), plan.feet
    tables = tables if tables is not None else tables_of(plan, duration)
    settings = settings_of(plan, duration, accuracy)
    when = np.zeros(0) if times is None else np.array(times, dtype=float)
    others = [(*one, p) for p in given.perturbed for one in copies_of(given, p, tables)]

    def engine(first: int) -> Sequence[Any]:
        perturbed = [(*one, p - first) for *one, p in others if first <= p < first + LANES]
        return _native.tangents_legged(
            legs.native, tables, NODES, given.row.signals, plan.laws.native, laws, given.row, settings, when, account,
            start, given.data.lanes(first), min(LANES, len(given.paths) - first), perturbed,
        )  # fmt: skip

    nb = len(legs.body.body_mass)
    widths = {"events": 12, "marks": 3 + nb + 2 * m, "samples": 2 * n + 5 * m, "since": 1, "energies": 1}
    found = _in_lanes(given, widths, engine)
    return replace(found, since=found.since[:, 0], energies=found.energies[:, 0])
