"""Windows: a plan run from any moment and state, with outputs at any times."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from tarsus.base.errors import InputError
from tarsus.core import _native
from tarsus.core.modes import ModeBook
from tarsus.core.replay import SampledStates, sample
from tarsus.plan.slots import Rows, rows_of
from tarsus.solve.acting import Acting
from tarsus.solve.codes import ResultCode, structured_events, without_marks
from tarsus.solve.contacts import Contacts
from tarsus.solve.engine import RECORDED, Accuracy, book_of, execute, tables_of, walk
from tarsus.solve.motion import unpacked

if TYPE_CHECKING:
    from tarsus.plan.lowering import Plan

__all__ = ["Contacts", "Window", "simulate_window"]

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Window:
    """A plan run from a given state.

    times (nt,) [s]; states: displacements, velocities, gaps, forces and pulls at the times; code: how it ended, no
    energy account being asked for; rows: every event as the engine has it, with what marks there are.
    """

    acting: Acting
    times: Floats
    states: SampledStates
    code: ResultCode
    rows: Floats

    @cached_property
    def events(self) -> npt.NDArray[np.void]:
        """Events in time order, fields as those of a run."""
        return without_marks(structured_events(self.rows))

    def repeated(self, after: float) -> npt.NDArray[np.void]:
        """As `events`, of a motion that repeats with the window, after so long [s]: the flight that the window's end
        cuts is the one that its start cuts."""
        found = structured_events(self.rows)
        before = found.copy()
        before["apex_time"] -= after
        return without_marks(np.concatenate([before, found]))[len(self.events) :]

    @cached_property
    def forces(self) -> Mapping[str, Floats]:
        """Force [N] (m, nt) of every smooth law on the feet by name, positive along the normal."""
        return self.acting.forces(self.states.gap, self.states.rate, self.states.held, self.times)


def simulate_window(
    plan: Plan,
    state: npt.ArrayLike,
    t0: float,
    times: npt.ArrayLike,
    contacts: Contacts | None = None,
    *,
    rows: Rows | None = None,
    shared: ModeBook | _native.LegTables | None = None,
    accuracy: Accuracy = RECORDED,
) -> Window:
    """Run a plan from a given state, with all its laws, drives and rules, and give outputs at any times.

    Parameters
    ----------
    plan
        The plan of a scene (`tarsus.plan.lowering.lower_scene`).
    state
        Displacements and velocities (2n,) at the start [m, m/s].
    t0
        When it starts [s], at 0 or later: the drives' time.
    times
        When outputs are wanted (nt,) [s], in order, none before the start. The window ends with the last one.
    contacts
        What the feet do at the start; by default none is held.
    rows
        One row of data in place of the plan's (`tarsus.plan.slots.rows_for`); its initial state is not used.
    shared
        Contact modes of the plan's structure, or step tables of its legs, to share with other windows; made for a
        duration not below the last time.
    accuracy
        Tolerances; those of a single run by default.

    Raises
    ------
    InputError
        For states, times or contacts that do not fit the plan.
    """
    contacts = contacts or Contacts()
    when, first = np.atleast_1d(np.asarray(times, dtype=float)), np.asarray(state, dtype=float)
    _check(plan, first, t0, when, contacts)
    end = float(when[-1])
    rows = (rows_of(plan) if rows is None else rows).starting(first)
    acts, begin = Acting(plan, rows), contacts.begin(plan.feet, t0)
    if plan.legs is not None:
        tables = shared if isinstance(shared, _native.LegTables) else tables_of(plan, end)
        walked = walk(plan, end, rows=rows, tables=tables, accuracy=accuracy, times=when, start=begin)
        states = unpacked(acts, walked.samples, when)[0]
        return Window(acts, when, states, ResultCode.of(int(walked.codes[0])), walked.events)
    book = shared if isinstance(shared, ModeBook) else book_of(plan, end)
    made = execute(plan, end, rows=rows, book=book, accuracy=accuracy, record=True, start=begin)
    states = sample(rows.sources[0], book, made.trace, when)
    return Window(acts, when, states, ResultCode.of(int(made.codes[0])), made.events)


def _check(plan: Plan, state: Floats, t0: float, times: Floats, contacts: Contacts) -> None:
    """Raise InputError where a window's start or times do not fit its plan."""
    problems = contacts.faults(plan.feet, t0)
    size = 2 * len(plan.system.mass)
    if state.shape != (size,) or not np.isfinite(state).all():
        problems.append(f"state: expected {size} finite numbers, displacements and velocities")
    if not (math.isfinite(t0) and t0 >= 0.0):
        problems.append(f"t0: expected a time of 0 s or later, got {t0:g} s")
    ordered = times.ndim == 1 and len(times) > 0 and not np.any(np.diff(times) < 0.0)
    if not (ordered and t0 <= times[0] and 0.0 < times[-1] < math.inf):
        problems.append("times: expected times above 0 in order, the first not before the start")
    if problems:
        raise InputError(problems)
