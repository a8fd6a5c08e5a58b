"""Whether a run's contacts repeat at its end: measures are then those of a motion that lasts, else of a transient.

A run has settled with multiple k where the events of its last max(2 k, 4) drive periods are those of k periods before:
the same feet and kinds in the same order, at the same phases and impact speeds to `SETTLED`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats
from tarsus.tables.numbers import how_many

SETTLED = 1e-6
"""Difference of phases, and of speeds as part of the fastest, below which events repeat: a thousand times what steps of
single runs leave, a hundred times what those of batches do."""
MOST_MULTIPLE = 8
"""Largest multiple of the drive period that is looked for."""
FEWEST = 4
"""Drive periods that must equal those before them at least."""


@dataclass(frozen=True)
class Settled:
    """How a run's contacts repeat. multiple: after so many drive periods, 0 where they do not, None where its events do
    not tell; since: drive periods of the run before they do; periods: whole ones of the run."""

    multiple: int | None
    since: int
    periods: int

    def __str__(self) -> str:
        if self.multiple is None:
            few = f"it lasts {how_many(self.periods, 'drive period')}, and {FEWEST + 1} are needed"
            why = few if self.periods <= FEWEST else "in the last drive periods no contact begins or ends"
            return f"Whether it has settled is not known: {why}."
        if not self.multiple:
            return (
                f"Not settled: after {self.periods} drive periods contacts do not repeat; measures are of a transient, "
                "or of a motion that never repeats."
            )
        every = "drive period" if self.multiple == 1 else f"{self.multiple} drive periods"
        return f"Settled: contacts repeat every {every}, after the first {self.since}."


def drive_period(scene: Any) -> float | None:
    """Period of the slowest periodic signal of the scene [s]; None if none repeats."""
    tracks = [signal.track() for signal in scene.waves.values()]
    return max((track.period for track in tracks if track.periodic), default=None)


def settled(run: Any) -> Settled | None:
    """Whether the contacts of a run repeat at its end; None without a periodic drive."""
    period = drive_period(run.scene)
    if period is None:
        return None
    count = _whole(run.duration, period)
    return repetition(run.events, period, run.duration) or Settled(None, count, count)


def repetition(events: NDArray[np.void], period: float, end: float) -> Settled | None:
    """How the events of a run that ends at ``end`` [s] repeat from drive period [s] to drive period.

    None where they do not tell: of runs of fewer than `FEWEST` + 1 periods, and where the last ones have no event.
    """
    count = _whole(end, period)
    if count <= FEWEST or not len(events):
        return None
    turns = events["time"] / period
    cut = _quiet(turns[turns > count - 2 * MOST_MULTIPLE])
    if cut is None:
        return None
    last = count - 1 if cut + count - 1 <= end / period else count - 2  # whole periods from a quiet phase on
    number = np.floor(turns - cut).astype(int)
    first = np.searchsorted(number, np.arange(last + 1))
    rows = np.stack([events["foot"], events["kind"], turns - cut - number, _speeds(events)], axis=1)
    each = [rows[a:b] for a, b in pairwise(first)]
    for k in range(1, MOST_MULTIPLE + 1):
        same = [_alike(one, before) for one, before in zip(each[k:], each[:-k], strict=True)]
        needed = max(2 * k, FEWEST)
        if len(same) >= needed and all(same[-needed:]):
            if not sum(map(len, each[-k:])):
                return None
            since = len(same) - next((i for i, one in enumerate(reversed(same)) if not one), len(same))
            return Settled(k, since, count)
    return Settled(0, count, count)


def _whole(end: float, period: float) -> int:
    """Whole periods [s] up to an end [s]."""
    return math.floor(end / period * (1.0 + 1e-9))


def _quiet(turns: Floats) -> float | None:
    """Middle of the longest part of a period without an event, as a phase; None without any event."""
    phases = np.sort(np.remainder(turns, 1.0))
    if not len(phases):
        return None
    gaps = np.diff(phases, append=phases[0] + 1.0)
    longest = int(np.argmax(gaps))
    return float(np.remainder(phases[longest] + 0.5 * gaps[longest], 1.0))


def _speeds(events: NDArray[np.void]) -> Floats:
    """Approach speeds (ne,) as part of the fastest, 0 where there is none."""
    speeds = np.abs(np.nan_to_num(events["speed_before"]))
    fastest = float(speeds.max(initial=0.0))
    return speeds / fastest if fastest else speeds


def _alike(one: Floats, other: Floats) -> bool:
    """Whether events of two periods are the same."""
    return one.shape == other.shape and bool(np.abs(one - other).max(initial=0.0) <= SETTLED)
