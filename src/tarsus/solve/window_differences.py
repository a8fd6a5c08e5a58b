"""Differences of values of many windows: their slopes, how these bend and what runs are known to, window by window."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from tarsus.solve.differences import BENT, ROUNDING

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]

SURE = 10.0
"""Times the noise of runs, as two of them show it, from which a kink is none of its."""


@dataclass(frozen=True)
class WindowValues:
    """Values of something of windows: of themselves, of one in other steps, of the two beside (c, k); which of these
    two count (2, k); first (nw + 1,): where those of each window begin; blocks: rows of one kind, weights (c,) with
    which they have one unit."""

    own: Floats
    finer: Floats
    beside: tuple[Floats, Floats]
    valid: Flags
    first: Integers
    blocks: Sequence[slice]
    weights: Floats

    def most(self, values: Floats) -> Floats:
        """Largest (blocks, nw) of weighted values (c, k) in every window; zero of none."""
        out = np.zeros((len(self.blocks), len(self.first) - 1))
        there = np.flatnonzero(np.diff(self.first))
        if len(there):
            rows = np.fmax.reduceat(np.nan_to_num(values), self.first[there], axis=1) * self.weights[:, None]
            out[:, there] = [rows[block].max(axis=0, initial=0.0) for block in self.blocks]
        return out

    def most_rows(self, values: Floats) -> Floats:
        """Largest of values (c, k) in every window row by row, for all that is in it."""
        out = np.zeros((len(values), len(self.first) - 1))
        there = np.flatnonzero(np.diff(self.first))
        if len(there):
            out[:, there] = np.fmax.reduceat(np.nan_to_num(values), self.first[there], axis=1)
        return self.each(out)

    def each(self, values: Floats) -> Floats:
        """Values (nw,) of windows for all that is in them."""
        return np.repeat(values, np.diff(self.first), axis=-1)

    def rows(self, values: Floats, *, weighted: bool = True) -> Floats:
        """Values (blocks, nw) for all that is in them, (c, k), which are weighted themselves or not."""
        out = np.repeat(self.each(values), [block.stop - block.start for block in self.blocks], axis=0)
        return out / self.weights[:, None] if weighted else out


@dataclass(frozen=True)
class Differences:
    """Differences of values by steps: slopes (c, k), what they change by over one step, and the noise of runs."""

    values: WindowValues
    places: Floats

    @cached_property
    def _off(self) -> tuple[Floats, Floats]:
        one, two = (each - self.values.own for each in self.values.beside)
        return one, two

    @cached_property
    def slope(self) -> Floats:
        """To both sides, or to the one that counts, NaN where none does."""
        (one, two), (x, y), valid = self._off, self.places, self.values.valid
        out = (one * (y / x) - two * (x / y)) / (y - x)
        out[:, ~valid[1]] = (one / x)[:, ~valid[1]]
        out[:, ~valid[0]] = (two / y)[:, ~valid[0]]
        out[:, ~valid.any(axis=0)] = np.nan
        return out

    @cached_property
    def change(self) -> Floats:
        """Zero where one side alone counts."""
        (one, two), (x, y) = self._off, self.places
        return np.where(self.values.valid.all(axis=0), np.abs((one / x - two / y) / (x - y)), 0.0)

    @cached_property
    def off(self) -> Floats:
        """How far values are from those in other steps."""
        own = self.values.own
        return np.abs(self.values.finer - own) + ROUNDING * np.abs(own)

    @cached_property
    def noise(self) -> Floats:
        """The most (blocks, nw) of it in a window: at one moment two runs may agree by chance."""
        return self.values.most(self.off)

    @cached_property
    def scale(self) -> Floats:
        """Largest slopes (blocks, nw) in a window."""
        return self.values.most(np.abs(self.slope))

    @cached_property
    def same(self) -> Flags:
        """Where no copy differs."""
        pairs = zip(self._off, self.values.valid, strict=True)
        return np.all([(off == 0.0) | ~ok for off, ok in pairs], axis=0)

    @cached_property
    def kinked(self) -> Flags:
        """Where slopes to both sides differ by a part of the window's largest that no curve leaves over a step."""
        if self.places[0] * self.places[1] > 0.0:
            return np.zeros(self.change.shape, dtype=bool)
        return (self.change > self.values.rows(np.maximum(BENT * self.scale, SURE * self.noise))) & ~self.same

    @cached_property
    def bents(self) -> Floats:
        """By which part (blocks, nw) slopes change over a step, beyond noise; NaN where there are none."""
        return self._part(np.maximum(self.values.most(self.change) - 3.0 * self.noise, 0.0))

    @cached_property
    def noises(self) -> Floats:
        """Which part (blocks, nw) of slopes their noise is; NaN where there are none."""
        return self._part(self.noise)

    def _part(self, of: Floats) -> Floats:
        return np.divide(of, self.scale, out=np.full_like(of, np.nan), where=self.scale > 0.0)

    def error(self, bent: Floats) -> Floats:
        """What slopes may be off by; bent (nw,): by which part those of motions change over a step. What a number of
        third order leaves is the square of that, and of a difference to one side the part itself."""
        size, by = np.abs(self.slope), self.values.rows(np.fmax(self.bents, bent), weighted=False)
        with np.errstate(divide="ignore", invalid="ignore"):
            part = np.where(size > 0.0, np.minimum(self.change / size, 1.0), 1.0)
        sided = 1.0 if self.places[0] * self.places[1] < 0.0 else 2.0
        both = sided * (part * self.change + by**2 * size)
        cut = np.where(self.values.valid.all(axis=0), both, by * size)
        return np.where(self.same & np.isfinite(size), 0.0, cut + self.values.most_rows(self.off))
