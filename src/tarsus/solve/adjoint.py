"""Derivatives of one number of a recorded run by everything that enters it, backwards over its steps and events.

The number's own derivatives by events and states come first; what the engine makes of them, derivatives by all of a
run's data, is multiplied with the data's derivatives by the numbers asked for. How many these are hardly matters.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.core import _native
from tarsus.core.modes import NODES, ModeBook
from tarsus.model.drive.pieces import TERMS
from tarsus.solve.contacts import Contacts
from tarsus.solve.lanes import Doubt

if TYPE_CHECKING:
    from tarsus.plan.lowering import Plan
    from tarsus.plan.slots import Rows
    from tarsus.solve.engine import RawRuns
    from tarsus.solve.tangents import DataTangents, Entering

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Seeds:
    """Derivatives of a number of a run: by its event rows (ne, 12), in the order in which the engine met them; by
    samples (nt, 2n + 5m) of displacements, velocities, gaps, gap rates, resistive and smooth forces and pulls at times
    (nt,) [s]; and by the drive period [s], NaN where it has a kink, infinite where it jumps."""

    events: Floats
    times: Floats
    samples: Floats
    period: float = 0.0


def swept(
    plan: Plan,
    book: ModeBook,
    given: Entering,
    recorded: RawRuns,
    settings: _native.Settings,
    seeds: Seeds,
) -> tuple[Floats, list[tuple[int, int, int]]] | None:
    """Derivatives (P,) of a number by the directions along which a run's data are known to move, and flags: event,
    reason, number of a direction or -1 for all.

    None where the run cannot be gone through backwards: feet that land at one moment hand impacts on to each other.
    """
    data, row = given.data, given.row
    count = len(given.paths)
    parameters = data.parameters.reshape(-1, count)
    groups, moves = _groups(parameters)
    begin = Contacts().begin(plan.feet, 0.0)
    asked = tuple(np.ascontiguousarray(one) for one in (seeds.events, seeds.times, seeds.samples))
    found, flags, edges, refused = _native.adjoint_modal(
        book.native, NODES, row.signals, plan.laws.by_programs, settings, row, begin, groups,
        _degrees(row, data), recorded, asked,
    )  # fmt: skip
    if refused:
        return None
    by_groups, initial, sources, coef, first, last, loops, period = found
    coef = np.ascontiguousarray(np.asarray(coef).reshape(-1, TERMS)[:, : data.coef.shape[1]])
    period += seeds.period if np.isfinite(seeds.period) else 0.0
    pairs = (
        (by_groups, moves), (initial, data.initial), (sources, data.sources), (coef, data.coef), (first, data.begin),
        (last, data.end), (loops, data.loops), (np.array([period]), data.period),
    )  # fmt: skip
    values = sum((np.asarray(by).ravel() @ moved.reshape(-1, count) for by, moved in pairs), np.zeros(count))
    doubts = [(int(event), int(reason), -1) for event, reason, _ in np.asarray(flags).reshape(-1, 3)]
    for piece, turns, c in np.asarray(edges).reshape(-1, 3):
        moved = data.begin[piece] + data.loops[row.channels[0, c]] * turns
        doubts += [(0, int(Doubt.EDGE_AT_START), int(p)) for p in np.flatnonzero(moved)]
    return values, sorted(set(doubts))


def _groups(parameters: Floats) -> tuple[NDArray[np.int64], Floats]:
    """Parameters (n, P) that move alike: the number of the group of each (n,), -1 where none moves it, and how the
    groups (g, P) move."""
    groups = np.full(len(parameters), -1, dtype=np.int64)
    moving = np.flatnonzero(parameters.any(axis=1))
    if not len(moving):
        return groups, np.zeros((0, parameters.shape[1]))
    moves, of = np.unique(parameters[moving], axis=0, return_inverse=True)
    groups[moving] = of.reshape(-1)
    return groups, moves


def _degrees(row: Rows, data: DataTangents) -> NDArray[np.int64]:
    """Highest power (pieces,) that a piece of a channel or a derivative of it has; -1 in channels that nothing
    moves."""
    first = np.asarray(row.signals.first)
    used = np.asarray(row.signals.coef) != 0.0
    by_term = np.atleast_2d(np.asarray(data.coef != 0.0).any(axis=2))
    used[:, : by_term.shape[1]] |= by_term
    out = np.where(used, np.arange(used.shape[1]), 0).max(axis=1, initial=0).astype(np.int64)
    moves = np.logical_or.reduce([by_term.any(axis=1), data.begin.any(axis=1), data.end.any(axis=1)])
    still = np.ones(len(out), dtype=bool)
    for channel in row.channels[0]:
        pieces = slice(first[channel], first[channel + 1])
        if moves[pieces].any() or data.loops[channel].any():
            still[pieces] = False
    out[still] = -1
    return out
