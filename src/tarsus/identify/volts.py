"""Volts between the samples of a record: corners that no sample hit, and the force of a law with memory along
them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats
from tarsus.model.drive.laws import PrandtlIshlinskii, VoltageLaw
from tarsus.solve import SUBSTEPS

_EDGE = 0.2
"""Part of the span in a sample from which on a drive is taken to jump."""
_CORNER = 6.0
"""Times the usual bend around that a corner has."""
_LEAST_BEND = 2e-4
"""Part of the span that a corner bends by at least: about the digit of a recorder of 12 bits."""
_JUMP = 0.1
"""Part of the span of volts that a jump moves by in a sample."""
_STEEP = 10.0
"""And times by which it moves more than before and after."""


@dataclass(frozen=True)
class Volts:
    """Volts of a record at its samples, at even places between them, and at the corners wherever these are.

    levels (nl,) [V] in order of time; grid (substeps (ns - 1) + 1,): which of them lie on the even places; substeps
    from sample to sample; kept: states of plays along them.
    """

    levels: Floats
    grid: NDArray[np.intp]
    substeps: int
    kept: dict[object, Floats] = field(default_factory=dict, repr=False, compare=False)

    @staticmethod
    def of(volts: Floats, substeps: int = SUBSTEPS) -> Volts:
        """From the samples (ns,) [V], joined by lines: a corner between two of them is where the lines through its
        neighbours meet, but of volts that jump."""
        place = np.arange(substeps * (len(volts) - 1) + 1) / substeps
        levels, corners, heights = _between(volts, place)
        order = np.argsort(np.concatenate([place, corners]), kind="stable")
        merged = np.concatenate([levels, heights])[order]
        return Volts(merged, np.flatnonzero(order < len(place)), substeps)

    @property
    def fine(self) -> Floats:
        """Volts at the even places."""
        return self.levels[self.grid]

    def states(self, law: PrandtlIshlinskii, history: tuple[float, ...]) -> Floats:
        """States of a law's plays at the even places: they are the same whatever the plays weigh."""
        place = law.thresholds, history
        if place not in self.kept:
            self.kept.clear()
            self.kept[place] = law.states(self.levels, history)[self.grid]
        return self.kept[place]

    def force(self, law: VoltageLaw, history: tuple[float, ...]) -> Floats:
        """Force [N] by a law at the even places."""
        if isinstance(law, PrandtlIshlinskii):
            return law.force_with(self.fine, self.states(law, history))
        return law.force(self.levels, history)[self.grid]


class Stretches:
    """Parts of records one after the other, along which forces are asked of one law after the other.

    parts: volts, first sample and how many samples of each, which ends with its record; ends (2, nr): first and last of
    the places of each among all.
    """

    def __init__(self, parts: Sequence[tuple[Volts, int, int]]) -> None:
        self.parts: list[tuple[Volts, slice]] = []
        for volts, first, count in parts:
            stop = min(volts.substeps * (first + count - 1), len(volts.grid) - 1)
            self.parts.append((volts, slice(volts.substeps * first, stop + 1)))
        last = np.cumsum([part.stop - part.start for _, part in self.parts]) - 1
        self.ends = np.array([np.append(0, last[:-1] + 1), last])
        self.plays: tuple[object, Floats, Floats] | None = None

    def force(self, law: VoltageLaw, history: tuple[float, ...]) -> Floats:
        """Force [N] at the even places of all parts."""
        if not isinstance(law, PrandtlIshlinskii):
            each = {id(volts): volts.force(law, history) for volts, _ in self.parts}
            return np.concatenate([each[id(volts)][part] for volts, part in self.parts])
        place = law.thresholds, history
        if self.plays is None or self.plays[0] != place:
            levels = np.concatenate([volts.levels[volts.grid[part]] for volts, part in self.parts])
            states = np.concatenate([volts.states(law, history)[part] for volts, part in self.parts])
            self.plays = place, levels, states
        return law.force_with(*self.plays[1:])


def jumps_of(volts: Floats) -> NDArray[np.intp]:
    """Last samples before the voltage (ns,) jumps, by a tenth of its span or more and far more than around it; of a
    jump that a sample lies within, both."""
    move = np.abs(np.diff(volts))
    around = np.maximum(np.roll(move, 1), np.roll(move, -1))
    single = (move > _JUMP * np.ptp(volts)) & (move > _STEEP * around)
    both = np.abs(volts[2:] - volts[:-2])
    outer = np.maximum(np.roll(move, 1)[:-1], np.roll(move, -2)[:-1])
    double = (both > _JUMP * np.ptp(volts)) & (both > _STEEP * outer)
    double &= np.minimum(move[1:], move[:-1]) > both / _STEEP
    single[:-1] |= double
    single[1:] |= double
    return np.flatnonzero(single)


def moved(volts: Floats, samples: float, pace: float = 0.0, origin: float = 0.0) -> Floats:
    """Volts (ns,) so many samples later, and asked in steps that are longer by a share from an origin [samples] on."""
    if not samples and not pace:
        return volts
    place = np.arange(len(volts), dtype=np.float64)
    place += pace * (place - origin) - samples
    return _between(volts, np.clip(place, 0.0, len(volts) - 1.0))[0]


def _between(volts: Floats, place: Floats) -> tuple[Floats, Floats, Floats]:
    """Volts at places [samples], and the places and heights of corners between samples."""
    corners = heights = np.zeros(0)
    if np.max(np.abs(np.diff(volts)), initial=0.0) <= _EDGE * float(np.ptp(volts)):
        corners, heights = _corners(volts)
    where = np.concatenate([np.arange(len(volts)), corners])
    order = np.argsort(where)
    return np.interp(place, where[order], np.concatenate([volts, heights])[order]), corners, heights


def _corners(volts: Floats) -> tuple[Floats, Floats]:
    """Places [samples] and heights [V] of corners between samples: two of these bend the same way there."""
    slope = np.diff(volts)
    bend = np.zeros(len(volts))
    bend[1:-1] = np.diff(slope)
    size = np.abs(bend)
    around = np.array([np.roll(size, k) for k in (-4, -3, -2, 2, 3, 4)])
    corner = size > _CORNER * np.median(around, axis=0) + _LEAST_BEND * float(np.ptp(volts))
    at = np.flatnonzero(corner[1:-2] & corner[2:-1] & (bend[1:-2] * bend[2:-1] > 0.0)) + 1
    left, right = slope[at - 1], slope[at + 1]
    late = np.clip((slope[at] - right) / (left - right), 0.0, 1.0)
    return at + late, volts[at] + late * left
