"""The compiled walking engine that the native one is held against."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass
from typing import Any

import numpy as np

from numba_laws import own
from numba_laws import rows as compiled_rows
from tarsus.core import arrays as events_of
from tarsus.core.cache import drop_stale, is_compiled
from tarsus.core.nodes import N
from tarsus.core.stack import step_lengths
from tarsus.core.walk import arrays as a
from tarsus.core.walk.march import make_march
from tarsus.core.walk.motion import TERMS
from tarsus.core.walk.scan import CANDIDATES
from tarsus.core.walk.tables import step_tables
from tarsus.plan import source_hash
from tarsus.solve.engine import Accuracy
from tarsus.walkplan import WalkPlan

_march = None
_compiling = threading.Lock()


def march() -> Any:
    """The compiled engine, made on first use (its machine code is kept on disk between processes)."""
    global _march
    with _compiling:
        if _march is None:
            _march = make_march(source_hash())
            if not is_compiled(_march):
                drop_stale(_march)
    return _march


def needs_compiling() -> bool:
    """Whether the next walk compiles the engine first: its machine code is neither in this process nor on disk."""
    return not is_compiled(march())


@dataclass(frozen=True)
class RawWalks:
    """What the engine made of nr runs: codes (nr,); event rows and mark rows of run i end at event_end[i], mark_end[i].

    finish (nr, 3): end time [s], steps, rejected steps. samples (ns, width), of the last run: see `Columns`. end:
    the last run's body (2, nb), feet (nl, 2, 2), contact (m,) of its feet and energies (5,) at its end.
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
    parameters: np.ndarray | None = None,
    initial: np.ndarray | None = None,
    tables: a.Tables | None = None,
    accuracy: Accuracy | None = None,
    period: float = math.inf,
    track: bool = True,
    account: bool = False,
    times: np.ndarray | None = None,
) -> RawWalks:
    """Run a walker's plan for ``duration`` [s], once or for many law parameters (nr, m, np) and starts (nr, 2n).

    period [s]: marks note the way at the end of every drive period; track: find the apex of every flight; account:
    integrate energies; times (ns,) [s], increasing: when to sample motion and contacts (of a single run).
    """
    accuracy = accuracy or Accuracy()
    base = plan.plan
    tables = tables if tables is not None else tables_of(plan, duration)
    laws = own(base.laws)
    parameters = compiled_rows(base.laws, base.laws.parameters[None] if parameters is None else parameters)
    if initial is None:
        initial = np.broadcast_to(base.initial, (len(parameters), len(base.initial)))
    runs, m = len(parameters), base.feet
    nb, nl = len(plan.body.body_mass), len(plan.body.mass)
    batch = a.Batch(
        np.array(parameters, order="C"), np.array(initial, order="C"), np.zeros(runs, dtype=np.int64),
        np.zeros(runs, dtype=np.int64), np.zeros(runs, dtype=np.int64), np.zeros((runs, 3)),
    )  # fmt: skip
    state = _new_state(plan, duration, accuracy, tables, period, track, account)
    work = _new_work(plan)
    when = np.zeros(0) if times is None else np.array(times, dtype=float)
    output = a.Output(
        np.zeros((65536 + 3 * m, events_of.EVENT_WIDTH)), np.zeros((4096, 3 + nb + 2 * m)), when,
        np.full((len(when), 2 * nb + 4 * nl + 2 * m + a.ENERGIES), np.nan),
    )  # fmt: skip
    events: list[np.ndarray] = []
    marks: list[np.ndarray] = []
    kernel = march()
    while True:
        code = kernel(plan.body, tables, base.signals, laws.arrays, batch, state, output, work)
        events.append(output.events[: state.count[a.EVENTS]].copy())
        marks.append(output.marks[: state.count[a.MARKROWS]].copy())
        state.count[a.BASE] += state.count[a.EVENTS]
        state.count[a.MARK_BASE] += state.count[a.MARKROWS]
        state.count[a.EVENTS] = state.count[a.MARKROWS] = 0
        if code == events_of.DONE:
            break
    return RawWalks(
        batch.codes, np.concatenate(events), batch.event_end, np.concatenate(marks), batch.mark_end, batch.finish,
        output.samples, (state.body, state.foot, state.contact, state.energy),
    )  # fmt: skip


def tables_of(plan: WalkPlan, duration: float) -> a.Tables:
    """Step tables of a plan's legs for runs of one duration."""
    mass, stiffness, damping = plan.blocks.T
    return step_tables(mass, stiffness, damping, step_lengths(duration))


def _new_state(
    plan: WalkPlan,
    duration: float,
    accuracy: Accuracy,
    tables: a.Tables,
    period: float,
    track: bool,
    account: bool,
) -> a.State:
    base = plan.plan
    m, nb, nl = base.feet, len(plan.body.body_mass), len(plan.body.mass)
    count = np.zeros(a.COUNTS, dtype=np.int64)
    count[a.TRACK], count[a.ACCOUNT], count[a.MAX_STEPS], count[a.FRESH] = track, account, accuracy.steps, 1
    count[a.FIRST_CLASS] = int(np.searchsorted(-tables.lengths, -0.5 / base.rate))
    real = np.zeros(a.REALS)
    real[a.END] = duration
    real[a.PERIOD] = period
    real[a.TOL_GAP] = accuracy.gap * base.length
    real[a.TOL_DRIVE] = accuracy.drive
    real[a.EPS_GAP] = 1e-14 * base.length
    real[a.EPS_FORCE] = 1e-13 * base.force
    real[a.EPS_SPEED] = 1e-13 * base.length * base.rate
    real[a.REST_HEIGHT] = 0.1 * accuracy.gap * base.length
    real[a.MIN_PROGRESS] = 1e-10 / base.rate
    real[a.PROBE] = 1e-7 * base.length
    return a.State(
        count=count, real=real, body=np.zeros((2, nb)), foot=np.zeros((nl, 2, 2)), contact=np.zeros(m, dtype=np.int64),
        sense=np.zeros(m), since=np.zeros(m), order=np.zeros(m, dtype=np.int64), apex=np.zeros((max(m, 1), 3)),
        slipped=np.zeros(m), heave=np.zeros(2), energy=np.zeros(a.ENERGIES), ahead=np.zeros((nb, a.AHEAD)),
        cursor=np.zeros((max(len(base.signals.loop), 1), 2), dtype=np.int64),
    )  # fmt: skip


def _new_work(plan: WalkPlan) -> a.Work:
    m, nb, nl, nd = plan.plan.feet, len(plan.body.body_mass), len(plan.body.mass), plan.plan.drives

    def rows(*count: int) -> np.ndarray:
        return np.zeros((*(max(c, 1) for c in count), N))

    return a.Work(
        drive=rows(nd), volts=rows(m), bx=rows(nb), bv=rows(nb), nx=rows(nb), push=rows(nb), drag=rows(nb),
        momentum=rows(nb), place=rows(nb), q=rows(nl, 2), u=rows(nl, 2), w=rows(nl, 2), load=rows(nl, 2),
        smooth=rows(m), strength=rows(m), film=rows(m), filmed=np.zeros(nl, dtype=np.int64), gap=rows(m), rate=rows(m),
        margin=rows(m), bound=rows(m), along=rows(m), solver=rows(nb, 2 * N), key=np.full((nb, 2), -1.0),
        foot=np.zeros((nl, 2, 2)), body=np.zeros((2, nb)), series=np.zeros((2, TERMS)), column=rows(2), row=rows(4),
        matrix=rows(N),
        newton=np.zeros((N, N + 1)), line=np.zeros(N), when=np.zeros((max(m, 1), CANDIDATES, 3)),
    )  # fmt: skip
