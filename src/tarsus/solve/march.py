"""Runs walkers' plans in the engine: settings, tables, what it made of them. No descriptions here."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tarsus.core import _native
from tarsus.core.book import NODES, step_lengths
from tarsus.plan.slots import Rows, rows_of
from tarsus.plan.walker import WalkPlan
from tarsus.solve.engine import Accuracy, unit_settings


@dataclass(frozen=True)
class RawWalks:
    """What the engine made of nr runs: codes (nr,); event rows and mark rows of run i end at event_end[i], mark_end[i].

    finish (nr, 3): end time [s], steps, rejected steps. samples (ns, width), of the last run: body's displacements and
    velocities (2 nb), legs (nl, 2, 2), contacts and sense of sliding (2 m) of the feet, energies (5) and works of
    laws that act together, all but the last (see `tarsus.solve.acting.parts`). end: the last run's body (2, nb), feet
    (nl, 2, 2), contact (m,) of its feet and energies with works at its end.
    """

    codes: np.ndarray
    events: np.ndarray
    event_end: np.ndarray
    marks: np.ndarray
    mark_end: np.ndarray
    finish: np.ndarray
    samples: np.ndarray
    end: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]

    def of(self, run: int) -> np.ndarray:
        """Event rows of one run."""
        return self.events[self.event_end[run - 1] if run else 0 : self.event_end[run]]

    def marks_of(self, run: int) -> np.ndarray:
        """Mark rows of one run."""
        return self.marks[self.mark_end[run - 1] if run else 0 : self.mark_end[run]]


def walk(
    plan: WalkPlan,
    duration: float,
    *,
    rows: Rows | None = None,
    tables: _native.LegTables | None = None,
    accuracy: Accuracy | None = None,
    period: float = math.inf,
    track: bool = True,
    account: bool = False,
    times: np.ndarray | None = None,
) -> RawWalks:
    """Run a walker's plan for ``duration`` [s], as it is or for many rows of its data.

    period [s]: marks note the way at the end of every drive period, that of the rows where they are given; track:
    find the apex of every flight; account: integrate energies; times (ns,) [s], increasing: when to sample motion and
    contacts (of a single run).
    """
    base = plan.plan
    tables = tables if tables is not None else tables_of(plan, duration)
    rows = rows_of(base, 1, period) if rows is None else rows
    settings = unit_settings(base, duration, accuracy or Accuracy())
    settings.first_class = int(np.searchsorted(-step_lengths(duration), -0.5 / base.rate))
    settings.track, settings.record = track, False
    codes, events, event_end, marks, mark_end, finish, samples, body, feet, contact, energy = _native.run_legged(
        plan.native, tables, NODES, rows.signals, base.laws.native, rows, settings,
        np.zeros(0) if times is None else np.array(times, dtype=float), account,
    )  # fmt: skip
    end = (body, feet.reshape(-1, 2, 2), contact, energy)
    return RawWalks(codes, events, event_end, marks, mark_end, finish, samples, end)


def tables_of(plan: WalkPlan, duration: float) -> _native.LegTables:
    """Step tables of a plan's legs for runs of one duration."""
    mass, stiffness, damping = np.ascontiguousarray(plan.blocks.T)
    return _native.LegTables(NODES, mass, stiffness, damping, step_lengths(duration))
