"""Windows: a plan run from any moment and state, with outputs at any times."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from tarsus.core import _native
from tarsus.base.events import EventKind
from tarsus.core.book import NODES
from tarsus.core.replay import Sampled, sample
from tarsus.base.errors import InputError
from tarsus.plan.lowering import Plan
from tarsus.plan.slots import Rows, rows_of
from tarsus.solve.codes import ResultCode, structured_events
from tarsus.solve.engine import Accuracy, SharedBook, unit_settings

__all__ = ["Contacts", "Recorded", "Window", "record", "simulate_window"]

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Contacts:
    """What the feet do where a window starts.

    held: numbers of the feet on the ground; since: begin [s] of each one's contact, at the start unless given (its
    adhesion counts from there); leaving: numbers of free feet at the ground that have just been let go. A free foot at
    the ground that is not leaving is judged as everywhere: it bounces, is captured, rests or departs.
    """

    held: Sequence[int] = ()
    since: Sequence[float] | None = None
    leaving: Sequence[int] = ()

    def faults(self, feet: int, start: float) -> list[str]:
        """Sentences on what is wrong for a plan of so many feet and a window that starts at ``start`` [s]."""
        problems = [
            f"{name}: there is no foot number {i} (feet are numbered 0 to {feet - 1})"
            for name, numbers in (("held", self.held), ("leaving", self.leaving))
            for i in numbers
            if not 0 <= i < feet
        ]
        problems += [f"foot {i} cannot be held and be leaving" for i in sorted(set(self.held) & set(self.leaving))]
        if self.since is not None:
            if len(self.since) != len(self.held):
                problems.append(f"since: expected a time for each of {len(self.held)} held feet, got {len(self.since)}")
            elif not all(one <= start for one in self.since):
                problems.append(f"since: a contact held at {start:g} s has begun by then")
        return problems

    def rows(self, feet: int, start: float) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.uint8], Floats]:
        """held, leaving and since (1, m) as the engine takes them."""
        held, leaving = np.zeros((2, 1, feet), dtype=np.uint8)
        since = np.full((1, feet), start)
        held[0, list(self.held)] = leaving[0, list(self.leaving)] = 1
        if self.since is not None:
            since[0, list(self.held)] = self.since
        return held, leaving, since


@dataclass(frozen=True)
class Recorded:
    """A run as the engine recorded it: every step (nr, width), event rows (ne, 12) and notes on them (ne, 2).

    A note: steps recorded when the event happened; 0 if it was found inside the last of them, 1 if it was due at that
    very moment, 2 for a mark. finish (3,): end time [s], steps, rejected steps.
    """

    code: int
    events: Floats
    notes: Floats
    finish: Floats
    trace: Floats


def record(
    plan: Plan,
    book: SharedBook,
    start: float,
    end: float,
    *,
    rows: Rows,
    contacts: Contacts,
    accuracy: Accuracy,
) -> Recorded:
    """Run a row of a plan's data from ``start`` to ``end`` [s]; the row's initial state is the one at the start."""
    settings = unit_settings(plan, end, accuracy)
    settings.track, settings.record = True, True
    code, events, _, notes, finish, trace, _ = _native.run_modal_windows(
        book.book.native, NODES, rows.signals, plan.laws.native, settings, rows, np.array([start]),
        *contacts.rows(plan.feet, start),
    )  # fmt: skip
    return Recorded(int(code[0]), events, notes, finish[0], trace)


@dataclass(frozen=True)
class Window:
    """A plan run from a given state.

    plan, times (nt,) [s]; code: how it ended; raw: events and steps as recorded.
    """

    plan: Plan
    start: float
    times: Floats
    raw: Recorded
    book: SharedBook = field(repr=False)
    rows: Rows = field(repr=False)

    @property
    def code(self) -> ResultCode:
        """How it ended; no energy account is asked for."""
        return ResultCode.of(self.raw.code)

    @cached_property
    def events(self) -> npt.NDArray[np.void]:
        """Events in time order, fields as those of a run."""
        found = structured_events(self.raw.events)
        return found[found["kind"] != EventKind.PERIOD_MARK]

    @cached_property
    def states(self) -> Sampled:
        """States and contact forces at the times."""
        return self.at(self.times)

    def at(self, times: npt.ArrayLike) -> Sampled:
        """States and contact forces at any other times [s] of the window, increasing: nothing is interpolated."""
        when = np.asarray(times, dtype=float)
        return sample(self.rows.sources[0], self.book.book, self.raw.trace, when)


def simulate_window(
    plan: Plan,
    state: npt.ArrayLike,
    t0: float,
    times: npt.ArrayLike,
    contacts: Contacts | None = None,
    *,
    rows: Rows | None = None,
    book: SharedBook | None = None,
    accuracy: Accuracy | None = None,
) -> Window:
    """Run a plan from a given state, with all its laws, drives and rules, and give outputs at any times.

    Parameters
    ----------
    plan
        The plan of a scene by contact modes (`tarsus.plan.lower_scene`).
    state
        Displacements and velocities (2n,) at the start [m, m/s].
    t0
        When it starts [s], at 0 or later: the drives' time.
    times
        When outputs are wanted (nt,) [s], in order, none before the start.
    contacts
        What the feet do at the start; by default none is held.
    rows
        One row of data in place of the plan's (`tarsus.slots.rows_for`); its initial state is not used.
    book
        Contact modes of the plan's structure to share with other windows, for a duration not below the last time.
    accuracy
        Tolerances; those of a single run by default.

    Raises
    ------
    InputError
        For states, times or contacts that do not fit the plan.
    """
    contacts = contacts or Contacts()
    when, first = np.atleast_1d(np.asarray(times, dtype=float)), np.asarray(state, dtype=float)
    size = 2 * len(plan.system.mass)
    problems = contacts.faults(plan.feet, t0)
    if first.shape != (size,) or not np.isfinite(first).all():
        problems.append(f"state: expected {size} finite numbers, displacements and velocities")
    if not (math.isfinite(t0) and t0 >= 0.0):
        problems.append(f"t0: expected a time of 0 s or later, got {t0:g} s")
    if when.ndim != 1 or not len(when) or np.any(np.diff(when) < 0.0) or not (t0 <= when[0] and when[-1] < math.inf):
        problems.append("times: expected times in order, the first not before the start")
    if problems:
        raise InputError(problems)
    rows = rows_of(plan) if rows is None else rows
    rows.initial[0] = first
    book = book or SharedBook(plan, max(float(when[-1]) - t0, 1e-9))
    raw = record(plan, book, t0, float(when[-1]), rows=rows, contacts=contacts, accuracy=accuracy or Accuracy(gap=1e-10))
    return Window(plan, t0, when, raw, book, rows)
