"""The engine before the native one, compiled by numba: the oracle the native engine is held against."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass
from typing import Any

import numpy as np

from numba_laws import own
from numba_laws import rows as compiled_rows
from tarsus.core import arrays as a
from tarsus.core.cache import drop_stale, is_compiled
from tarsus.core.flow import TERMS
from tarsus.core.kernel import make_advance
from tarsus.core.modes import contact_mode
from tarsus.core.nodes import N
from tarsus.core.stack import ModeBook, step_lengths
from tarsus.plan import Plan, source_hash
from tarsus.solve.engine import Accuracy

_advance = None
_compiling = threading.Lock()


def advance() -> Any:
    """The compiled engine, made on first use (its machine code is kept on disk between processes)."""
    global _advance
    with _compiling:
        if _advance is None:
            _advance = make_advance(source_hash())
            if not is_compiled(_advance):
                drop_stale(_advance)
    return _advance


class OracleBook:
    """Contact modes of one linear structure for runs of one duration, stacked into the arrays of the kernel."""

    def __init__(self, plan: Plan, duration: float) -> None:
        self.system = plan.system
        self.book = ModeBook(step_lengths(duration))
        self.require(0)

    def require(self, mask: int) -> None:
        if not self.book.has(mask):
            self.book.add(contact_mode(self.system, mask))

    def arrays(self) -> tuple[a.Modes, a.Tables]:
        return self.book.arrays()


@dataclass
class OracleRuns:
    codes: np.ndarray
    events: np.ndarray
    event_end: np.ndarray
    finish: np.ndarray
    trace: np.ndarray
    mode: int
    state: np.ndarray
    pending: int
    physical: np.ndarray


def execute(
    plan: Plan,
    duration: float,
    *,
    parameters: np.ndarray | None = None,
    initial: np.ndarray | None = None,
    book: OracleBook | None = None,
    accuracy: Accuracy | None = None,
    period: float = math.inf,
    track: bool = True,
    record: bool = False,
) -> OracleRuns:
    """Run a plan for ``duration`` [s], once or for many law parameters (nr, m, np) and initial states (nr, 2n).

    period [s]: events mark the highest gap of every drive period; track: find the apex of every flight;
    record: keep every step for series and energies.
    """
    accuracy = accuracy or Accuracy()
    book = book if book is not None else OracleBook(plan, duration)
    kernel = advance()
    laws = own(plan.laws)
    parameters = compiled_rows(plan.laws, plan.laws.parameters[None] if parameters is None else parameters)
    if initial is None:
        initial = np.broadcast_to(plan.initial, (len(parameters), len(plan.initial)))
    runs = len(parameters)
    m, n = plan.feet, len(plan.system.mass)
    ni = 2 * m + plan.drives + 1
    batch = a.Batch(
        # copies: a read-only view would be another type to the compiler, and the kernel compiled twice
        np.array(parameters, order="C"), np.array(initial, order="C"), np.zeros(runs, dtype=np.int64),
        np.zeros(runs, dtype=np.int64), np.zeros((runs, 3)),
    )  # fmt: skip
    state = _new_state(plan, duration, accuracy, book.book.lengths, period, track, record)
    work = _new_work(n, m, ni)
    size = 1024 if runs == 1 else 65536
    output = a.Output(
        np.zeros((size + 2 * m, a.EVENT_WIDTH)),
        np.zeros((4096 if record else 3, a.TRACE_HEAD + 2 * n + N * ni)),
    )
    verdict = np.zeros((max(m, 1), 2), dtype=np.int64)
    events: list[np.ndarray] = []
    rows: list[np.ndarray] = []
    while True:
        code = kernel(*book.arrays(), plan.signals, laws.arrays, batch, state, output, work, verdict)
        if code == a.NEED_MODE:
            book.require(int(state.count[a.PENDING]))
            continue
        events.append(output.events[: state.count[a.EVENTS]].copy())
        rows.append(output.trace[: state.count[a.ROWS]].copy())
        state.count[a.BASE] += state.count[a.EVENTS]
        state.count[a.EVENTS] = state.count[a.ROWS] = 0
        if code == a.DONE:
            break
    return OracleRuns(
        batch.codes, np.concatenate(events), batch.event_end, batch.finish, np.concatenate(rows),
        int(state.count[a.MODE]), state.w, int(state.count[a.PENDING]), state.physical,
    )  # fmt: skip


def _new_state(
    plan: Plan,
    duration: float,
    accuracy: Accuracy,
    lengths: np.ndarray,
    period: float,
    track: bool,
    record: bool,
) -> a.State:
    m = max(plan.feet, 1)
    size = max(2 * len(plan.system.mass), 2)
    count = np.zeros(a.COUNTS, dtype=np.int64)
    count[a.TRACK], count[a.RECORD], count[a.MAX_STEPS], count[a.FRESH] = track, record, accuracy.steps, 1
    count[a.FIRST_CLASS] = int(np.searchsorted(-lengths, -0.5 / plan.rate))
    real = np.zeros(a.REALS)
    real[a.END] = duration
    real[a.PERIOD] = period
    real[a.TOL_GAP] = accuracy.gap * plan.length
    real[a.TOL_DRIVE] = accuracy.drive
    real[a.EPS_GAP] = 1e-14 * plan.length
    real[a.EPS_FORCE] = 1e-13 * plan.force
    real[a.EPS_SPEED] = 1e-13 * plan.length * plan.rate
    real[a.REST_HEIGHT] = 0.1 * accuracy.gap * plan.length  # lower flights are lost in the error of a step
    real[a.MIN_PROGRESS] = 1e-10 / plan.rate
    real[a.PROBE] = 1e-7 * plan.length
    return a.State(
        count=count, real=real, w=np.zeros(size), physical=np.zeros(2 * len(plan.system.mass)),
        cursor=np.zeros((max(len(plan.signals.loop), 1), 2), dtype=np.int64), since=np.zeros(m),
        order=np.zeros(m, dtype=np.int64), apex=np.zeros((m, 3)),
    )  # fmt: skip


def _new_work(n: int, m: int, ni: int) -> a.Work:
    def rows(count: int) -> np.ndarray:
        return np.zeros((max(count, 1), N))

    values = rows(ni)
    values[-1] = 1.0  # the last input is the constant 1
    constant = np.zeros(ni, dtype=np.bool_)
    constant[-1] = True
    active = np.ones(ni, dtype=np.bool_)
    active[: 2 * m] = False
    return a.Work(
        values=values, constant=constant, active=active, linear=rows(2 * m), nodes=rows(2 * m + 1), volts=rows(m),
        margin=rows(m), power=rows(ni), vpower=rows(m), series=np.zeros((TERMS, max(2 * n, 2))), line=np.zeros(TERMS),
        velocity=np.zeros(max(3 * n, 3)), state=np.zeros(max(2 * n, 2)), other=np.zeros(max(m, 1)),
        matrix=np.zeros((max(m, 1) * N, max(m, 1) * N + 2)),
    )  # fmt: skip
