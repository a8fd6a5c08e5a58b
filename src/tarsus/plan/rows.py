"""The data of runs, a row a run, as the engine takes them; what they determine before a run begins, it fills in."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.base.errors import InputError
from tarsus.base.units import format_quantity
from tarsus.core import _native
from tarsus.model.drive.pieces import Channels, Pieces, evaluate

if TYPE_CHECKING:
    from tarsus.plan.lowering import Plan

Floats = NDArray[np.float64]


def pack(channels: Sequence[Pieces]) -> _native.Signals:
    """Channels laid end to end as the engine takes them; one that holds its last value gets a piece for that."""
    return _native.Signals(Channels.of(channels).arrays())


@dataclass(frozen=True)
class Rows:
    """The data of nr runs of one plan, a row a run, as the engine takes them.

    pool: channels that runs are driven by, signals: the same for the engine; channels (nr, nc): those of each run, in
    the plan's order.
    parameters (nr, m, np) of the laws; initial (nr, 2n); sources (nr, m + 1): rest gaps [m] and gravity [m/s^2];
    scales (nr, 3): length [m] and force [N] that tolerances refer to, and period [s] of the marks.
    """

    pool: Sequence[Pieces]
    signals: _native.Signals
    parameters: Floats
    initial: Floats
    sources: Floats
    scales: Floats
    channels: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.initial)

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"signals": None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state, signals=pack(state["pool"]))

    def drive(self, channel: int, time: ArrayLike, run: int = 0) -> Floats:
        """Values of a channel of the plan in a run at times [s], any shape: a drive's force [N], or volts."""
        return evaluate(self.pool[self.channels[run, channel]], time)

    def starting(self, state: Floats) -> Rows:
        """The one run of these rows from another initial state (2n,)."""
        return replace(self, initial=np.array(state, dtype=float)[None])

    @property
    def periods(self) -> Floats:
        """Drive period of each run (nr,) [s]."""
        return self.scales[:, 2]


def rows_of(plan: Plan, count: int = 1, period: float = math.inf) -> Rows:
    """``count`` runs of a plan as it is, with marks every ``period`` [s]."""
    channels = len(plan.channels)

    def each(row: Any) -> Floats:
        return np.repeat(np.asarray(row, dtype=float)[None], count, axis=0)

    return Rows(
        plan.channels, plan.signals, each(plan.laws.parameters), each(plan.initial), each(plan.system.sources),
        each([plan.length, plan.force, period]), np.repeat(np.arange(channels)[None], count, axis=0),
    )  # fmt: skip


def started(plan: Plan, rows: Rows, idle: Floats, feet: Sequence[str]) -> Rows:
    """Runs with the lengths and forces that tolerances of each refer to, and of a walker that starts standing with the
    state in which each stands. idle (nr, nd) [N]: what drives exert without volts; feet: their names.

    Raises InputError for the first run that would start below the ground, or does not stand.
    """
    initial, scales, refused = _native.start_rows(plan.rules, plan.laws.native, rows.signals, rows, idle)
    if len(refused):
        raise InputError(
            [_refusal(int(run), int(fault), feet, int(foot), by) for run, fault, foot, by in refused]
        )
    return replace(rows, initial=initial.reshape(rows.initial.shape), scales=scales)


def _refusal(run: int, fault: int, feet: Sequence[str], foot: int, by: float) -> str:
    if _native.FAULTS[fault] == "below the ground":
        depth = format_quantity(float(f"{by:.6g}"), "m")
        return f"initial.displacement: in run {run} foot '{feet[foot]}' would start {depth} below the ground"
    if _native.FAULTS[fault] == "pulled down":
        missing = format_quantity(float(f"{by:.4g}"), "N")
        return f"foot '{feet[foot]}' would have to be pulled down by {missing}: it does not stand"
    return "the forces along the way do not balance: the robot would not stand still"
