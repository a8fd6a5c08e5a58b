"""Derivatives of a walker's run, which the engine makes again with lanes that follow it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tarsus.core import _native
from tarsus.core.book import NODES
from tarsus.plan.lowering import Plan
from tarsus.solve.engine import Accuracy
from tarsus.solve.march import tables_of, walk_settings
from tarsus.solve.tangents import LANES, LOST, Entering, by_programs

__all__ = ["WalkTangents", "walk_tangents"]

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class WalkTangents:
    """Derivatives of a walker's run by P numbers, last axis.

    events (ne, 12, P), marks (nm, 3 + nb + 2 m, P): of the rows of events and marks; samples (nt, 2n + 5m, P): of
    displacements, velocities, gaps, gap rates, resistive and smooth forces and pulls at sample times; since (m, P) [s]:
    of the begins of the contacts at the end; energies (5, P): as in samples of a run, where an account was asked for;
    flags (nf, 3): as in `Tangents`.
    """

    events: Floats
    marks: Floats
    samples: Floats
    since: Floats
    energies: Floats
    flags: NDArray[np.int64]

    def told_of(self, events: int, marks: int) -> WalkTangents:
        """Those of a run with so many events and marks. The engine cuts some steps of the run that it makes again:
        where that comes to other events, as it may in chaos, there are no derivatives."""
        if (len(self.events), len(self.marks)) == (events, marks):
            return self

        def fitted(rows: Floats, count: int) -> Floats:
            rest = np.full((max(count - len(rows), 0), *rows.shape[1:]), np.nan)
            return np.concatenate([rows[:count], rest])

        flags = np.append(self.flags, [[0, LOST, -1]], axis=0)
        return replace(self, events=fitted(self.events, events), marks=fitted(self.marks, marks), flags=flags)


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
) -> WalkTangents:
    """Derivatives of a walker's run by what enters it: the engine makes the run again for every eight numbers, and
    these follow it. Other parameters as for `walk`."""
    assert plan.legs is not None
    tables = tables if tables is not None else tables_of(plan, duration)
    settings, when = (
        walk_settings(plan, duration, accuracy, True),
        np.zeros(0) if times is None else np.array(times, dtype=float),
    )
    nb, n, m = len(plan.legs.body.body_mass), len(plan.system.mass), plan.feet
    sizes = (12, 3 + nb + 2 * m, 2 * n + 5 * m, 1, 1)
    parts, flags = [], []
    others = [
        (one.legs.native, tables_of(one, duration), weight, p)
        for p, plans in given.beside.items()
        for one, weight in plans
        if one.legs is not None
    ]
    for first in range(0, max(len(given.paths), 1), LANES):
        beside = [(*one, p - first) for *one, p in others if first <= p < first + LANES]
        *found, flag = _native.tangents_legged(
            plan.legs.native, tables, NODES, given.row.signals, plan.laws.native, by_programs(plan.laws), given.row,
            settings, when, account, start, given.data.lanes(first), min(LANES, len(given.paths) - first),
            beside,
        )  # fmt: skip
        parts.append(
            [np.asarray(one).reshape(-1, size, LANES) for one, size in zip(found, sizes, strict=True)]
        )
        rows = np.asarray(flag).reshape(-1, 3).astype(np.int64)
        rows[rows[:, 2] >= 0, 2] += first
        flags.append(rows)
    joined = [np.concatenate(some, axis=2)[..., : len(given.paths)] for some in zip(*parts, strict=True)]
    events, marks, samples, since, energies = joined
    return WalkTangents(events, marks, samples, since[:, 0], energies[:, 0], np.concatenate(flags))
