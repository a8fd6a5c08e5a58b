"""A run's copies along one direction, event by event: which of theirs are its own, and from when on they differ."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tarsus.solve.codes import EVENT_TYPE
from tarsus.solve.differences import BENT, ROUNDING, EventKeys, Slopes, Stencil, matched_events, slopes_of

if TYPE_CHECKING:
    from tarsus.solve.run import Run

Floats = NDArray[np.float64]

NUMBERS = tuple(name for name in EVENT_TYPE.names or () if name not in ("foot", "kind"))
"""Fields of an event that have derivatives."""
_FELT = tuple(NUMBERS.index(name) for name in ("time", "speed_before"))
"""Those by which it is judged how much runs respond: what the others follow from."""


class Parting(NamedTuple):
    """From when on [s] another run has other events, and the foot that begins with it."""

    time: float
    foot: int


@dataclass(frozen=True)
class Alike:
    """Events of another run as those of a run: rows (numbers, ne) in the order of the run's, NaN from where they part;
    times (k,) of all that it has, in order; parting: where that is, None if nowhere."""

    rows: Floats
    times: Floats
    parting: Parting | None

    @classmethod
    def of(cls, run: Run, other: Run) -> Alike:
        """As `matched_events` finds them."""
        own, theirs = run.events, other.events
        table = np.array([theirs[name] for name in NUMBERS], dtype=float).reshape(len(NUMBERS), -1)
        rows = np.full((len(NUMBERS), len(own)), np.nan)
        found = matched_events(*(EventKeys(one["foot"], one["kind"], one["time"]) for one in (own, theirs)))
        rows[:, found.here] = table[:, found.there]
        rows[:, own["time"] >= found.time] = np.nan
        parting = None if found.foot < 0 else Parting(found.time, found.foot)
        return cls(rows, np.sort(theirs["time"]), parting)


@dataclass(frozen=True)
class Beside:
    """Copies of a run along one direction, their events as the run's, and those of the run in other steps.

    bent: by which part slopes of events change over the step; noise: what runs are known to over the step, of these
    slopes; kink: the first event, and its foot, at which the slopes to both sides differ, None if at none.
    """

    stencil: Stencil
    runs: tuple[Run, ...]
    events: tuple[Alike, ...]
    slopes: Slopes
    bent: float
    noise: float
    kink: Parting | None

    @classmethod
    def of(cls, run: Run, finer: tuple[Run, Alike], stencil: Stencil, runs: Sequence[Run]) -> Beside:
        """Of a run and, beside it, the same in other steps."""
        events = tuple(Alike.of(run, one) for one in runs)
        own = np.array([run.events[name] for name in NUMBERS], dtype=float).reshape(len(NUMBERS), -1)
        there, rows = _no_better(own, np.nan_to_num(finer[1].rows)), [one.rows for one in events]
        whole = stencil.slope(own, rows), stencil.bend(own, rows), _known(own, there)
        seen = tuple(one[list(_FELT)] for one in whole)
        if not np.isfinite(seen[0]).any():  # nothing touches: how it moves at its end tells
            last = [one.motion.last.reshape(2, -1) for one in (run, finer[0], *runs)]
            seen = stencil.slope(last[0], last[2:]), stencil.bend(last[0], last[2:]), _known(last[0], last[1])
        at, kink = _kinked(stencil, own, there, rows, run.end_time), None
        if at is not None:
            kink = Parting(float(run.events["time"][at]), int(run.events["foot"][at]))
            seen = (seen[0][:, :at], seen[1][:, :at], seen[2][:, :at])
        size, change, known = (np.nanmax(np.abs(one), axis=1, initial=0.0) for one in seen)
        felt = size > 0.0
        bent, noise = (
            float(np.max(one[felt] / size[felt], initial=0.0)) for one in (change, known / stencil.step)
        )
        return cls(
            stencil, tuple(runs), events, slopes_of(stencil, bent, own, there, rows), bent, noise, kink
        )

    @property
    def parted(self) -> Parting | None:
        """Where the first copy parts from the run."""
        return min((one.parting for one in self.events if one.parting is not None), default=None)

    @property
    def rank(self) -> tuple[float, float, float]:
        """By how good its derivatives are: how far they go [s], and what they may be off by."""
        ends = [math.inf if one is None else one.time for one in (self.parted, self.kink)]
        return ends[0], ends[1], -(self.bent**2 + self.noise)

    def side(self) -> int | None:
        """The copy that has the run's own events to the end, ahead where all have; None where none has."""
        alike = [k for k, one in enumerate(self.events) if one.parting is None]
        return max(alike, key=lambda k: self.stencil.places[k], default=None)

    def series(
        self, times: Floats, mine: Floats, own: Floats, finer: Floats, beside: Sequence[Floats]
    ) -> tuple[Floats, Floats]:
        """Derivatives (..., nt) of what a run shows at times, and what they may be off by.

        mine: times of the run's own events, in order. Where an event passes a moment, so that a copy is before it and
        the run is not, the difference is to the other side alone.
        """
        finer = _no_better(own, finer)
        found = slopes_of(self.stencil, self.bent, own, finer, beside)
        value, error = found.value, found.error
        past = np.searchsorted(mine, times, side="right")
        same = np.array([np.searchsorted(one.times, times, side="right") == past for one in self.events])
        for k in np.flatnonzero(same.sum(axis=1) > 0).tolist():
            alone = same[k] & ~same.all(axis=0)
            value[..., alone] = (beside[k] - own)[..., alone] / self.stencil.places[k]
            part = self._passed(k, mine, past[alone] - 1)
            error[..., alone] = (
                part * np.abs(value[..., alone]) + np.abs(finer - own)[..., alone] / self.stencil.step
            )
        value[..., ~same.any(axis=0)] = np.nan
        return value, error

    def _passed(self, k: int, mine: Floats, events: NDArray[np.intp]) -> Floats:
        """By which part the slope to one side is off behind events of these numbers (-1 before the first): how far a
        copy's event is from the run's, of the time to the next one."""
        whole = np.concatenate([[-np.inf], mine, [np.inf]])
        at = np.clip(events + 1, 1, len(mine))
        apart = np.minimum(whole[at + 1] - whole[at], whole[at] - whole[at - 1])
        return np.minimum(self.bent + np.abs(self.events[k].times[at - 1] - mine[at - 1]) / apart, 1.0)


def _known(own: Floats, finer: Floats) -> Floats:
    """How far values of a run may be off."""
    return np.abs(finer - own) + ROUNDING * np.abs(own)


def _no_better(own: Floats, finer: Floats) -> Floats:
    """Values of a run in other steps that are as far from the run's as any before: none is known better by chance."""
    return own + np.maximum.accumulate(np.abs(finer - own), axis=-1)


def _kinked(
    stencil: Stencil, own: Floats, finer: Floats, rows: Sequence[Floats], duration: float
) -> int | None:
    """Number of the first event whose moment or speed has other slopes to both sides; None if none has."""
    if len(own[0]) == 0 or not np.ptp(np.sign(stencil.places)):
        return None
    felt = list(_FELT)
    slope, change = (
        np.abs(np.nan_to_num(one)) for one in (stencil.slope(own, rows)[felt], stencil.bend(own, rows)[felt])
    )
    noise = np.maximum(
        _known(own, finer)[felt], ROUNDING * np.array([[duration], [np.abs(own[felt[1]]).max()]])
    )
    off = change > np.maximum(BENT * np.maximum.accumulate(slope, axis=1), 3.0 * noise / stencil.step)
    return int(np.argmax(off.any(axis=0))) if off.any() else None
