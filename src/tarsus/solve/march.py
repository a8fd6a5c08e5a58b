"""Runs walkers' plans in the engine: settings, tables, what it made of them. No descriptions here."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from tarsus.core import _native
from tarsus.core.book import NODES, step_lengths
from tarsus.plan.lowering import Plan
from tarsus.plan.slots import Rows, rows_of
from tarsus.solve.engine import Accuracy, Log, unit_settings


@dataclass(frozen=True)
class RawWalks(Log):
    """What walkers left. samples (ns, width), of the last run: body's displacements and velocities (2 nb), legs
    (nl, 2, 2), contacts and sense of sliding (2 m) of the feet, energies (5) and works of laws that act together, all
    but the last (see `tarsus.solve.acting.Acting.parts`). end: the last run's body (2, nb), feet (nl, 2, 2), contact
    (m,) of its feet and energies with works at its end.
    """

    samples: np.ndarray = field(kw_only=True)
    end: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray] = field(kw_only=True)


def walk(
    plan: Plan,
    duration: float,
    *,
    rows: Rows | None = None,
    tables: _native.LegTables | None = None,
    accuracy: Accuracy | None = None,
    period: float = math.inf,
    track: bool = True,
    account: bool = False,
    times: np.ndarray | None = None,
    start: tuple[float, np.ndarray, np.ndarray, np.ndarray] | None = None,
) -> RawWalks:
    """Run a walker's plan for ``duration`` [s], as it is or for many rows of its data.

    period [s]: marks note the way at the end of every drive period, that of the rows where they are given; track:
    find the apex of every flight; account: integrate energies; times (ns,) [s], increasing: when to sample motion and
    contacts (of a single run); start: time [s] and held, leaving, since of the feet (see `tarsus.solve.window`).
    """
    assert plan.legs is not None
    tables = tables if tables is not None else tables_of(plan, duration)
    rows = rows_of(plan, 1, period) if rows is None else rows
    settings = walk_settings(plan, duration, accuracy, track)
    codes, events, event_end, marks, mark_end, finish, samples, body, feet, contact, energy = _native.run_legged(
        plan.legs.native, tables, NODES, rows.signals, plan.laws.native, rows, settings,
        np.zeros(0) if times is None else np.array(times, dtype=float), account, start,
    )  # fmt: skip
    end = (body, feet.reshape(-1, 2, 2), contact, energy)
    return RawWalks(codes, finish, events, event_end, marks, mark_end, samples=samples, end=end)


def walk_settings(plan: Plan, duration: float, accuracy: Accuracy | None, track: bool) -> _native.Settings:
    """Settings of runs of a walker's plan over ``duration`` [s]."""
    settings = unit_settings(plan, duration, accuracy or Accuracy())
    settings.first_class = int(np.searchsorted(-step_lengths(duration), -0.5 / plan.rate))
    settings.track, settings.record = track, False
    return settings


def tables_of(plan: Plan, duration: float) -> _native.LegTables:
    """Step tables of a plan's legs for runs of one duration."""
    assert plan.legs is not None
    mass, stiffness, damping = np.ascontiguousarray(plan.legs.blocks.T)
    return _native.LegTables(NODES, mass, stiffness, damping, step_lengths(duration))
