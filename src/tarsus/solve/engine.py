"""Drives the compiled loop over one plan: buffers, contact modes on demand, codes. No descriptions here."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass, field

import numpy as np

from tarsus.core import arrays as a
from tarsus.core.flow import TERMS
from tarsus.core.kernel import make_advance
from tarsus.core.modes import contact_mode
from tarsus.core.nodes import N
from tarsus.core.stack import ModeBook, step_lengths
from tarsus.plan import Plan, source_hash

_advance = None
_lock = threading.Lock()


def advance():  # noqa: ANN201 - numba dispatcher
    """The compiled engine, made on first use (its machine code is kept on disk between processes)."""
    global _advance
    with _lock:
        if _advance is None:
            _advance = make_advance(source_hash())
    return _advance


@dataclass(frozen=True)
class Accuracy:
    """How exactly a run is computed. The defaults put impact times within about 1e-9 of the exact ones.

    gap: local error of a foot's gap per step, relative to the plan's length scale.
    drive: local error of a drive force per step, relative to its range.
    steps: bound on the number of steps, so that a run always ends.
    """

    gap: float = 1e-10
    drive: float = 1e-9
    steps: int = 200_000_000


@dataclass
class RawRun:
    """What the kernel produced: code, event rows (ne, 11), trace rows (nt, width), step counts."""

    code: int
    time: float
    events: np.ndarray
    trace: np.ndarray
    book: ModeBook
    steps: int
    rejected: int
    state: np.ndarray = field(default_factory=lambda: np.zeros(0))


def new_book(plan: Plan, duration: float) -> ModeBook:
    """Contact modes of a plan, to share between runs of the same structure."""
    book = ModeBook(step_lengths(duration))
    book.add(contact_mode(plan.system, 0))
    return book


def execute(
    plan: Plan,
    duration: float,
    book: ModeBook | None = None,
    accuracy: Accuracy | None = None,
    track: bool = True,
    record: bool = False,
    lock: threading.Lock | None = None,
) -> RawRun:
    """Run a plan for ``duration`` [s]: ``track`` finds the apex of every flight, ``record`` keeps every step."""
    accuracy = accuracy or Accuracy()
    book = book if book is not None else new_book(plan, duration)
    kernel = advance()
    m, nd = plan.feet, plan.drives
    ni = 2 * m + nd + 1
    n = plan.system.mass.shape[0]
    state = _new_state(plan, duration, accuracy, book, track, record)
    work = _new_work(n, m, ni)
    output = a.Output(
        np.zeros((512 + 2 * m, a.EVENT_WIDTH)),
        np.zeros((4096 if record else 3, a.TRACE_HEAD + 2 * n + N * ni)),
    )
    verdict = np.zeros(max(m, 1), dtype=np.int64)
    events: list[np.ndarray] = []
    rows: list[np.ndarray] = []
    while True:
        modes, tables = book.arrays()
        code = kernel(modes, tables, plan.signals, plan.laws, state, output, work, verdict)
        if code in (a.EVENTS_FULL, a.TRACE_FULL) or code != a.NEED_MODE:
            events.append(output.events[: state.count[a.EVENTS]].copy())
            rows.append(output.trace[: state.count[a.ROWS]].copy())
            state.count[a.EVENTS] = 0
            state.count[a.ROWS] = 0
        if code == a.NEED_MODE:
            with lock or threading.Lock():
                mask = int(state.count[a.PENDING])
                if not book.has(mask):
                    book.add(contact_mode(plan.system, mask))
        elif code not in (a.EVENTS_FULL, a.TRACE_FULL):
            break
    return RawRun(
        code=int(code), time=float(state.real[a.TIME]), events=np.concatenate(events), trace=np.concatenate(rows),
        book=book, steps=int(state.count[a.STEPS]), rejected=int(state.count[a.REJECTED]), state=state.w.copy(),
    )  # fmt: skip


def _new_state(
    plan: Plan, duration: float, accuracy: Accuracy, book: ModeBook, track: bool, record: bool
) -> a.State:
    m = plan.feet
    n = plan.system.mass.shape[0]
    lengths = book.lengths
    count = np.zeros(13, dtype=np.int64)
    count[a.TRACK], count[a.RECORD], count[a.MAX_STEPS] = track, record, accuracy.steps
    count[a.CLASS] = int(np.searchsorted(-lengths, -0.5 / plan.rate))
    real = np.zeros(11)
    real[a.END] = duration
    real[a.TOL_GAP] = accuracy.gap * plan.length
    real[a.TOL_DRIVE] = accuracy.drive
    real[a.EPS_GAP] = 1e-14 * plan.length
    real[a.EPS_FORCE] = 1e-13 * plan.force
    real[a.EPS_SPEED] = 1e-13 * plan.length * plan.rate
    real[a.REST_HEIGHT] = 1e-12 * plan.length
    real[a.MIN_PROGRESS] = 1e-10 / plan.rate
    real[a.PROGRESS] = -math.inf
    real[a.PROBE] = 1e-7 * plan.length
    cursor = np.zeros((max(len(plan.signals.loop), 1), 2), dtype=np.int64)
    cursor[: len(plan.signals.loop), 0] = plan.signals.first[:-1]
    return a.State(
        count=count, real=real, w=np.zeros(max(2 * n, 2)), physical=plan.initial.copy(), cursor=cursor,
        since=np.zeros(max(m, 1)), order=np.zeros(max(m, 1), dtype=np.int64), apex=np.zeros((max(m, 1), 2)),
    )  # fmt: skip


def _new_work(n: int, m: int, ni: int) -> a.Work:
    def rows(count: int) -> np.ndarray:
        return np.zeros((max(count, 1), N))

    return a.Work(
        values=_inputs(ni), constant=_constant(ni), active=_active(ni, m), linear=rows(2 * m), nodes=rows(2 * m + 1),
        volts=rows(m), margin=rows(m), power=rows(ni), vpower=rows(m), series=np.zeros((TERMS, max(2 * n, 2))),
        line=np.zeros(TERMS), velocity=np.zeros(max(2 * n, 2)), magnitude=np.zeros(max(n, 1)),
        state=np.zeros(max(2 * n, 2)), other=np.zeros(max(m, 1)),
    )  # fmt: skip


def _inputs(ni: int) -> np.ndarray:
    values = np.zeros((ni, N))
    values[-1] = 1.0
    return values


def _constant(ni: int) -> np.ndarray:
    constant = np.zeros(ni, dtype=np.bool_)
    constant[-1] = True
    return constant


def _active(ni: int, m: int) -> np.ndarray:
    active = np.ones(ni, dtype=np.bool_)
    active[: 2 * m] = False
    return active
