"""The data of the runs of a plan: a row for each run, as the engine takes them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.core import _native
from tarsus.core.modes import Floats
from tarsus.model.drive.pieces import Channels, Pieces, evaluate

if TYPE_CHECKING:
    from tarsus.plan.lowering import Plan


@dataclass(frozen=True)
class Rows:
    """The data of nr runs of one plan, a row a run, as the engine takes them.

    pool: channels that runs are driven by, signals: the same for the engine; channels (nr, nc): those of each run, in
    the plan's order.
    parameters (nr, m, np) of the laws; initial (nr, 2n); sources (nr, m + 2): rest gaps [m] and gravity [m/s^2];
    scales (nr, 3): length [m] and force [N] that tolerances refer to, and period [s] of the marks; profile (nr, .):
    uneven ground, as `lower_profile` has it.
    """

    pool: Sequence[Pieces]
    signals: _native.Signals
    parameters: Floats
    initial: Floats
    sources: Floats
    scales: Floats
    channels: NDArray[np.int64]
    profile: Floats

    def __len__(self) -> int:
        return len(self.initial)

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"signals": None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state, signals=pack(state["pool"]))

    def taken(self, part: slice) -> Rows:
        """Some of the runs, of the same pool."""
        return replace(self, **{name: getattr(self, name)[part] for name in BY_RUN})

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


BY_RUN = ("parameters", "initial", "sources", "scales", "channels", "profile")
"""What of rows there is for each run."""


def rows_of(plan: Plan, count: int = 1, period: float = math.inf) -> Rows:
    """``count`` runs of a plan as it is, with marks every ``period`` [s]."""
    channels = len(plan.channels)

    def each(row: Any) -> Floats:
        return np.repeat(np.asarray(row, dtype=float)[None], count, axis=0)

    return Rows(
        plan.channels,
        plan.signals,
        each(plan.laws.parameters),
        each(plan.initial),
        each(plan.system.sources),
        each([plan.length, plan.force, period]),
        np.repeat(np.arange(channels)[None], count, axis=0),
        each(plan.profile),
    )


def marked_period(periods: Floats, duration: float) -> Floats:
    """Period [s] of the marks of each run: the longest of its drives' periods (nd, ...) within it, or all of it."""
    within = np.where(periods <= duration, periods, 0.0).max(axis=0, initial=0.0)
    return np.where(within > 0.0, within, duration)


def marked_rows(plan: Plan, count: int, duration: float) -> Rows:
    """``count`` runs of a plan as it is over ``duration`` [s], with marks at the end of every drive period."""
    return rows_of(plan, count, float(marked_period(plan.periods, duration)))


def pack(channels: Sequence[Pieces]) -> _native.Signals:
    """Channels laid end to end as the engine takes them; one that holds its last value gets a piece for that."""
    return _native.Signals(Channels.of(channels).arrays)
