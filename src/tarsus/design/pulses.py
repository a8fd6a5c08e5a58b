"""Unknowns of an on-off signal: when it switches, and to which levels between the two that it holds.

A period is a step of the foot: *landing plateaus*, the support level held, *release plateaus*, the lift level held.
N pairs of switchings are 2 N plateaus, shared out between the two edges. A signal of S plateaus is a row (2S,): the
levels [V], then the durations [s].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from tarsus.model.drive.waveforms import OnOff

Floats = NDArray[np.float64]

MOST_FAMILIES = 200
"""Sequences of listed levels that are searched at most; more levels than that want `free`."""


@dataclass(frozen=True)
class Levels:
    """Voltages [V] of the plateaus between the held ones: any of a list, or all from low to high where ``free``."""

    listed: tuple[float, ...]
    free: bool = False

    @property
    def low(self) -> float:
        return min(self.listed)

    @property
    def high(self) -> float:
        return max(self.listed)


@dataclass(frozen=True)
class Family:
    """A sequence of plateaus. landing, release: the level [V] of each plateau of the two edges; empty levels are free.

    sizes: number of plateaus at the two edges.
    """

    sizes: tuple[int, int]
    landing: tuple[float, ...] = ()
    release: tuple[float, ...] = ()

    @property
    def plateaus(self) -> int:
        return sum(self.sizes)


@dataclass(frozen=True)
class Step:
    """What all signals of a design share.

    period [s]; support, lift [V]: the held levels; supported [s]: from the landing edge to the release edge; shortest,
    longest [s]: of a plateau; levels: of the plateaus.
    """

    period: float
    support: float
    lift: float
    supported: float
    shortest: float
    longest: float
    levels: Levels

    def unknowns(self, pairs: int) -> int:
        """Number of unknowns of a signal with so many pairs."""
        return 2 * pairs * (2 if self.levels.free else 1)

    def place(self, which: Sequence[Family], number: NDArray[np.int64], cube: Floats) -> Floats:
        """Signals (n, 2S) of points (n, nu) of the unit cube, each of a family of its own.

        Raises nothing: plateaus that together would leave no time to hold are shortened in proportion.
        """
        count, m = len(cube), which[0].plateaus
        spans = self.shortest + np.clip(cube[:, :m], 0.0, 1.0) ** 2 * (self.longest - self.shortest)
        free = self.levels.low + np.clip(cube[:, m : 2 * m], 0.0, 1.0) * (self.levels.high - self.levels.low)
        levels, durations = np.zeros((count, m + 2)), np.zeros((count, m + 2))
        for index in np.unique(number):
            family, rows = which[int(index)], np.flatnonzero(number == index)
            a = family.sizes[0]
            between = free[rows] if self.levels.free else np.tile([*family.landing, *family.release], (len(rows), 1))
            first, last = spans[rows, :a], spans[rows, a:]
            halves = (self.supported, self.period - self.supported)
            first, last = (self._fit(part, half) for part, half in zip((first, last), halves, strict=True))
            hold = [half - part.sum(axis=1) for half, part in zip(halves, (first, last), strict=True)]
            durations[rows] = np.column_stack([first, hold[0], last, hold[1]])
            held = [np.full(len(rows), self.support), np.full(len(rows), self.lift)]
            levels[rows] = np.column_stack([between[:, :a], held[0], between[:, a:], held[1]])
        return np.concatenate([levels, durations], axis=1)

    def _fit(self, spans: Floats, half: float) -> Floats:
        """At least half of the time between two edges is held: what is less is no step any more."""
        total = spans.sum(axis=1, keepdims=True)
        return spans * np.minimum(1.0, 0.5 * half / np.where(total > 0.0, total, 1.0))

    def waveform(self, signal: Floats) -> OnOff:
        """The waveform of one signal (2S,)."""
        levels, durations = np.split(signal, 2)
        return OnOff(levels=tuple(levels.tolist()), durations=tuple(durations.tolist()), repeat=True)

    def plain(self) -> Floats:
        """The step (1, 4) without pairs."""
        return np.array([[self.support, self.lift, self.supported, self.period - self.supported]])

    def tunable(self, signal: Floats) -> list[int]:
        """Columns of a signal's (2S,) levels that may have any voltage: all but the two that are held."""
        levels, durations = np.split(signal, 2)
        held = int(np.argmin(np.abs(np.cumsum(durations) - self.supported)))
        return [i for i in range(len(levels) - 1) if i != held] if self.levels.free else []


@dataclass(frozen=True)
class OwnStep(Step):
    """A step whose signal is given, and some of whose switching times alone may move.

    own: the signal; moving: numbers of the plateaus whose durations are unknown; the longest other one gives way, so
    that the period stays.
    """

    own: OnOff
    moving: tuple[int, ...]

    def tunable(self, signal: Floats) -> list[int]:
        return []

    def unknowns(self, pairs: int) -> int:
        return len(self.moving)

    def plain(self) -> Floats:
        return np.array([[*self.own.levels, *self.own.durations]])

    def place(self, which: Sequence[Family], number: NDArray[np.int64], cube: Floats) -> Floats:
        signals = np.repeat(self.plain(), len(cube), axis=0)
        levels, durations = np.split(signals, 2, axis=1)  # views of them
        moving = list(self.moving)
        rest = [i for i in range(levels.shape[1]) if i not in moving]
        taker = rest[int(np.argmax(durations[0, rest]))]
        room = float(durations[0, [taker, *moving]].sum()) - self.shortest
        spans = self.shortest + np.clip(cube, 0.0, 1.0) ** 2 * (self.longest - self.shortest)
        total = spans.sum(axis=1, keepdims=True)
        spans = spans * np.minimum(1.0, room / total)
        durations[:, moving] = spans
        durations[:, taker] = room + self.shortest - spans.sum(axis=1)
        return signals


def families(step: Step, pairs: int) -> list[Family]:
    """Every way to share 2 ``pairs`` plateaus between the edges, and every sequence of the listed levels on them: no
    plateau is as the one before it. Of two levels a pair cannot be torn apart."""
    if isinstance(step, OwnStep):
        return [Family((len(step.moving), 0))]
    found: list[Family] = []
    for a in range(2 * pairs + 1):
        b = 2 * pairs - a
        if step.levels.free:
            found.append(Family((a, b)))
            continue
        for landing in _sequences(step.levels.listed, a, step.lift, step.support):
            for release in _sequences(step.levels.listed, b, step.support, step.lift):
                found.append(Family((a, b), landing, release))
                if len(found) >= MOST_FAMILIES:
                    return found
    return found


def _sequences(levels: Sequence[float], count: int, before: float, after: float) -> list[tuple[float, ...]]:
    return [
        one
        for one in product(levels, repeat=count)
        if all(x != y for x, y in zip((before, *one), (*one, after), strict=True))
    ]
