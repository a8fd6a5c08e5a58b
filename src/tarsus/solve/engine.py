"""Runs plans by the native engine: settings, tables, and what it leaves. No descriptions here."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.workers import Workers, spread, workers
from tarsus.core import _native
from tarsus.core import arrays as a
from tarsus.core.modes import NODES, ModeBook, contact_mode
from tarsus.plan.lowering import Plan, without_native
from tarsus.plan.rows import Rows
from tarsus.solve.contacts import CARRIED, mask_of
from tarsus.solve.shared import Shared

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Tables = ModeBook | _native.LegTables
"""Contact modes of a structure, or step tables of a walker's legs."""

FLIGHT, LEAST_FLIGHT = 1e-9, 1e-12
"""Height below which flights are none, of the widest gap and [m]. An atom is a hundred times as high as 1 pm, and no
foot or ground is flatter; what such flights hold of energy is the press times that height."""


@dataclass(frozen=True)
class Accuracy:
    """How exactly a run is computed. The defaults put impact times within about 1e-9 of the exact ones.

    gap: local error of a foot's gap per step, relative to the plan's length scale.
    drive: local error of a drive force per step, relative to its range.
    steps: bound on the number of steps, so that a run always ends.
    flight: height [m] below which flights of a foot that is pressed down are none: it is in contact. By default 1e-9 of
    the widest rest gap, and 1 pm at least.

    Raises
    ------
    InputError
        For a height that is none.
    """

    gap: float = 1e-8
    drive: float = 1e-9
    steps: int = 50_000_000
    flight: float | None = None

    def __post_init__(self) -> None:
        if self.flight is not None and not (math.isfinite(self.flight) and self.flight >= 0.0):
            raise InputError(f"flight: expected a height of 0 m or more, got {self.flight!r}")

    @property
    def finer(self) -> Accuracy:
        """One in whose steps a run shows how far it is from the exact one: halved, as steps are, they leave next to
        nothing."""
        return replace(self, gap=0.1 * self.gap, drive=0.1 * self.drive)


SINGLE_RUN = Accuracy(gap=1e-10)
"""Accuracy of a single run: a hundred times finer than a batch's, so that its energy ledger closes to 1e-8 of the
largest term through stiff films as well. It costs about half as many steps again."""

CLASSES = 48
"""Step lengths halve so often: a time within a run is known to 1e-16 of its end, and 2^-47 is 7e-15."""


def step_lengths(horizon: float) -> np.ndarray:
    """Step lengths (CLASSES,) [s]: the power of two at or above ``horizon`` and its halvings."""
    return 2.0 ** (math.ceil(math.log2(horizon)) - np.arange(CLASSES))


def structure_key(plan: Plan) -> tuple[object, ...]:
    """All of a plan's linear structure but rest gaps and gravity."""
    system = plan.system
    arrays = ((name, np.asarray(array, dtype=float).tobytes()) for name, array in system.arrays.items())
    return (system.normals.shape, plan.laws.use_rates, *arrays)


@dataclass(frozen=True)
class Log:
    """What an engine noted of nr runs: codes (nr,); finish (nr, 3): end time [s], steps, rejected steps; event rows of
    run i in events[event_end[i-1]:event_end[i]], and of walkers the marks of its way likewise, else None."""

    codes: np.ndarray
    finish: np.ndarray
    events: np.ndarray
    event_end: np.ndarray
    marks: np.ndarray | None = None
    mark_end: np.ndarray | None = None

    @classmethod
    def nothing(cls, duration: float) -> Log:
        """Of one run in which nothing happened for so long [s]."""
        finish = np.array([[duration, 0.0, 0.0]])
        return cls(np.array([a.DONE]), finish, np.zeros((0, a.EVENT_WIDTH)), np.zeros(1, dtype=np.intp))

    def of(self, run: int) -> np.ndarray:
        """Event rows of one run."""
        return rows_between(self.events, self.event_end, run)

    def marks_of(self, run: int) -> np.ndarray | None:
        """Mark rows of one run."""
        return None if self.marks is None else rows_between(self.marks, self.mark_end, run)

    def alone(self, run: int) -> Log:
        """The log of one run."""
        events, marks = self.of(run), self.marks_of(run)
        end, mark_end = np.array([len(events)]), None if marks is None else np.array([len(marks)])
        one = slice(run, run + 1)
        return Log(self.codes[one], self.finish[one], events, end, marks, mark_end)

    def __getstate__(self) -> dict[str, Any]:
        return without_native(self)


def end_to_end(counts: Sequence[NDArray[np.integer]]) -> Integers:
    """Where the rows of each run begin, and where the last ones end (nr + 1,), of several lots of runs one after the
    other, by how many rows each has."""
    return np.concatenate([[0], np.cumsum(np.concatenate(counts))]).astype(np.int64)


def rows_between(rows: np.ndarray, ends: np.ndarray | None, run: int) -> np.ndarray:
    """Rows of one run, of several runs' laid end to end; ends (nr,): where each run's end."""
    assert ends is not None
    return rows[ends[run - 1] if run else 0 : ends[run]]


JOBS = 4
"""Shares of parts for each thread: the last one to end is then not waited for long."""


class Continuations(NamedTuple):
    """Where nr parts of runs start and how far each goes.

    state (nr, 2n): displacements and velocities [m, m/s]; t0 and until (nr,) [s]; feet (nr, m, k): what feet carry on
    (`tarsus.solve.contacts.CARRIED`); sources (nr, 2): which of some data each runs on, and its row there.
    """

    state: Floats
    t0: Floats
    until: Floats
    feet: Floats
    sources: Integers


class Times(NamedTuple):
    """When runs are sampled: times [s] of all, end to end, those of run r from first[r] to first[r + 1]."""

    times: Floats
    first: Integers


class Advanced(NamedTuple):
    """What nr runs came to.

    codes (nr,); finish (nr, 3): end time [s], steps, rejected steps; event rows of run r to event_end[r]; states
    (., 2n), feet (., m, k) and, where accounted for, energies (., ENERGIES + np) at their ends, of whole runs the last
    one's; samples: a row for each time. Of contact modes gap_range (m,) of the last run (`RawRuns`), and whether it
    would go on in another mode; of walkers marks of the way to mark_end[r].
    """

    codes: Integers
    finish: Floats
    events: Floats
    event_end: Integers
    states: Floats
    feet: Floats
    samples: Floats
    energies: Floats
    gap_range: Any = None
    changed: bool = False
    marks: Any = None
    mark_end: Any = None

    @property
    def log(self) -> tuple[Any, ...]:
        """What a `Log` holds."""
        return self.codes, self.finish, self.events, self.event_end, self.marks, self.mark_end

    @classmethod
    def joined(cls, parts: Sequence[Advanced]) -> Advanced:
        """Several, one after the other."""
        if len(parts) == 1:
            return parts[0]
        whole = {
            name: np.concatenate([getattr(one, name) for one in parts])
            for name, value in parts[0]._asdict().items()
            if isinstance(value, np.ndarray) and name != "gap_range" and not name.endswith("_end")
        }
        for name in ("event_end", "mark_end"):
            if getattr(parts[0], name) is not None:
                whole[name] = end_to_end([np.diff(getattr(one, name), prepend=0) for one in parts])[1:]
        return cls(**whole, gap_range=parts[-1].gap_range, changed=parts[-1].changed)


def advance(
    plan: Plan,
    tables: Tables,
    settings: _native.Settings,
    on: Sequence[Rows],
    parts: Continuations | None = None,
    times: Times | None = None,
    *,
    account: bool = False,
) -> Advanced:
    """Run all rows of the one data in ``on`` from time 0 to the settings' end; or parts of runs, each to its own.

    times: when to sample them; account: whether energies are integrated.
    """
    data = [(rows.signals, rows) for rows in on]
    asked = (None if of is None else tuple(map(np.ascontiguousarray, of)) for of in (parts, times))
    given: list[Any] = [plan.laws.native, settings, data, *asked, account]
    if isinstance(tables, ModeBook):
        common, gap_range, changed = _native.advance_modal(tables.native, NODES, *given)
        made = Advanced(*common, gap_range=gap_range, changed=changed)
    else:
        assert plan.legs is not None
        common, marks, mark_end = _native.advance_legged(plan.legs.native, tables, NODES, *given)
        made = Advanced(*common, marks=marks, mark_end=mark_end)
    return made._replace(feet=made.feet.reshape(len(made.states), plan.feet, len(CARRIED)))


def advance_many(
    plan: Plan,
    tables: Tables,
    settings: _native.Settings,
    on: Sequence[Rows],
    parts: Continuations,
    times: Times | None = None,
    *,
    account: bool = False,
    together: int,
    threads: Workers = None,
) -> Advanced:
    """The same on several threads, of which each is given so many parts at least."""
    count = len(parts.t0)
    most = count // together
    size = count if most < 2 else -(-count // min(JOBS * workers(threads), most))

    def work(first: int) -> Advanced:
        some = slice(first, first + size)
        own = Continuations._make(of[some] for of in parts)
        if times is None:
            return advance(plan, tables, settings, on, own, account=account)
        begin = times.first[first : first + size + 1]
        asked = Times(times.times[begin[0] : begin[-1]], begin - begin[0])
        return advance(plan, tables, settings, on, own, asked, account=account)

    jobs = range(0, count, max(size, 1))
    return Advanced.joined([work(0)] if len(jobs) < 2 else list(spread(work, jobs, threads)))


@dataclass(frozen=True)
class RawRuns(Log):
    """What runs left. samples: a row for each time, of a walker as `LeggedMarch::put_sample` has them, else as
    `tarsus.core.states.states_of` takes them; energies up to then come last.

    Of the last run: last (2n,), displacements and velocities at its end, events of that moment included; energies
    (ENERGIES + np,) [J], see `tarsus.core.arrays`, with works of laws that act together, all but the last of each kind,
    None where nobody asked; of contact modes gap_range (m,) [m]: between the lowest and the highest gap of each foot at
    the starts of steps.
    """

    samples: Floats = field(kw_only=True)
    last: Floats = field(kw_only=True)
    energies: Floats | None = field(kw_only=True)
    gap_range: Floats | None = None


def settings_of(plan: Plan, duration: float, accuracy: Accuracy | None, *, track: bool = True) -> _native.Settings:
    """Settings of runs of a plan over ``duration`` [s]: relative tolerances as absolute ones for a length and a force
    of one, which the engine multiplies by a run's; whether apexes are found."""
    return _native.Settings(settings_arrays(plan, duration, accuracy, track=track))


def settings_arrays(plan: Plan, duration: float, accuracy: Accuracy | None, *, track: bool = True) -> dict[str, Any]:
    """The same as the engine takes them, by name."""
    accuracy = accuracy or Accuracy()
    low, least = (FLIGHT, LEAST_FLIGHT) if accuracy.flight is None else (0.0, accuracy.flight)
    first = 0 if plan.legs is None else int(np.searchsorted(-step_lengths(duration), -0.5 / plan.rate))
    return {
        "end": duration,
        "period": math.inf,
        "gap": accuracy.gap,
        "drive": accuracy.drive,
        "gap_zero": 1e-14,
        "force_zero": 1e-13,
        "speed_zero": 1e-13 * plan.rate,
        "rest_height": low,
        "least_flight": least,
        "least_progress": 1e-10 / plan.rate,
        "probe": 1e-7,
        "most_steps": accuracy.steps,
        "first_class": first,
        "track": int(track),
    }


@dataclass(frozen=True)
class Engine:
    """Runs a plan over ``duration`` [s] for rows of its data: a walker leg by leg, everything else by contact modes.

    shared: keeps what is made for the plan's structure.
    """

    plan: Plan
    duration: float
    shared: Shared = field(default_factory=Shared)

    @staticmethod
    def built() -> Mapping[str, str]:
        """How it was made: compiler, target (native or a processor), rows (vector instructions), checks at run time."""
        return _native.built

    @property
    def key(self) -> tuple[object, ...]:
        """What the tables of the plan's structure depend on: all of it but rest gaps and gravity."""
        plan, longest = self.plan, float(step_lengths(self.duration)[0])
        return (longest, *(structure_key(plan) if plan.legs is None else (plan.legs.blocks.tobytes(),)))

    @cached_property
    def tables(self) -> Tables:
        """Step tables of a walker's legs, or contact modes with theirs."""
        return self.shared.get(self.key, self._made)

    def _made(self) -> Tables:
        plan, lengths = self.plan, step_lengths(self.duration)
        if plan.legs is None:
            return ModeBook(plan.system, lengths, plan.laws.use_rates)
        mass, stiffness, damping = np.ascontiguousarray(plan.legs.blocks.T)
        return _native.LegTables(NODES, mass, stiffness, damping, lengths)

    def __getstate__(self) -> dict[str, Any]:
        return without_native(self)

    def run(
        self,
        rows: Rows,
        accuracy: Accuracy | None = None,
        track: bool = True,
        times: np.ndarray | None = None,
        *,
        account: bool = False,
    ) -> RawRuns:
        """All rows of the plan's data. track: find the apex of every flight; times (ns,) [s], increasing: when to
        sample motion and contacts, of a single run; account: integrate energies."""
        plan, tables = self.plan, self.tables
        settings = settings_of(plan, self.duration, accuracy, track=track)
        asked = None if times is None else Times(np.array(times, dtype=float), np.array([0, len(times)]))
        found = advance(plan, tables, settings, [rows], times=asked, account=account)
        last = found.states[-1]
        if found.changed:  # a contact was made or broken and not yet moved on from
            system = plan.system.at(rows.sources[0])
            last = contact_mode(system, mask_of(found.feet[-1])).at_rest_there(system.tangents, last)
        energies = found.energies[-1] if account else None
        return RawRuns(*found.log, samples=found.samples, last=last, energies=energies, gap_range=found.gap_range)
