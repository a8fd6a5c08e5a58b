"""Windows of time, each run with its own, and what feet do in them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from tarsus.measure.segments import Floats, Rows, firsts, largest, owners, places, sums

if TYPE_CHECKING:
    from tarsus.measure.history import Counting, Flights, Histories


@dataclass(frozen=True)
class Windows:
    """Windows of nh histories: history h has those between ``edges[first[h]:first[h + 1]]`` [s], which increase; each
    has one edge at least. Windows of all histories are numbered one after the other."""

    edges: Floats
    first: Rows

    @classmethod
    def alike(cls, edges: Floats, count: int) -> Windows:
        """The same windows for so many histories."""
        edges = np.asarray(edges, dtype=float) if len(edges) else np.zeros(1)
        return cls(np.tile(edges, count), len(edges) * np.arange(count + 1))

    @classmethod
    def of_periods(cls, dropped: Rows, count: Rows, span: Floats, reached: Floats) -> Windows:
        """Drive periods of length ``span`` (nh,) [s] from number ``dropped`` (nh,) to ``count`` (nh,); a single one
        ends where the run does at the latest."""
        first = firsts(count - dropped + 1)
        own = owners(first)
        edges = (dropped[own] + places(first)) * span[own]
        single = count == 1
        edges[first[:-1][single] + 1] = np.minimum(span, reached)[single]
        return cls(edges, first)

    @cached_property
    def count(self) -> Rows:
        """Number of windows (nh,) of each history."""
        return np.diff(self.first) - 1

    @cached_property
    def cell(self) -> Rows:
        """Number of each history's first window, and of all windows (nh + 1,)."""
        return firsts(self.count)

    @cached_property
    def own(self) -> Rows:
        """Number of the history of every window."""
        return owners(self.cell)

    @cached_property
    def begin(self) -> Rows:
        """Number of the edge at which every window begins."""
        return self.first[:-1][self.own] + places(self.cell)

    @cached_property
    def lengths(self) -> Floats:
        """Length [s] of every window."""
        return self.edges[self.begin + 1] - self.edges[self.begin]

    def differences(self, values: Floats) -> Floats:
        """What grows over every window, from its values at the edges."""
        return values[self.begin + 1] - values[self.begin]

    def number(self, own: Rows, times: Floats) -> Rows:
        """Of history ``own`` (nq,), number of its last edge at or before ``times`` (nq,), -1 before the first.

        A guess for windows of one length, put right edge by edge.
        """
        first, count = self.first[own], self.count[own]
        begin = self.edges[first]
        span = self.edges[first + count] - begin
        share = np.divide(times - begin, span, out=np.full(len(times), -1.0), where=span > 0.0)
        share = np.clip(np.nan_to_num(share, nan=-1.0), -1.0, 2.0)
        k = np.clip(np.floor(share * count), -1, count).astype(np.intp)
        while True:
            above = (k < count) & (times >= self.edges[first + np.minimum(k + 1, count)])
            below = (k >= 0) & (times < self.edges[first + np.maximum(k, 0)])
            if not (above.any() or below.any()):
                return k
            k += above
            k -= below


@dataclass(frozen=True)
class WindowedHistories:
    """What nh feet did, by window."""

    histories: Histories
    windows: Windows
    counting: Counting

    @property
    def flights(self) -> Flights:
        """Flights of the feet."""
        return self.histories.flights

    def inside(self, own: Rows, times: Floats) -> tuple[Rows, Rows]:
        """Which of the times are in a window of their history, and in which; one at the last edge is in the last."""
        windows = self.windows
        k = windows.number(own, times)
        count = windows.count[own]
        k -= (k == count) & (times == windows.edges[windows.first[own] + count])
        found = np.flatnonzero((k >= 0) & (k < count))
        return found, windows.cell[own[found]] + k[found]

    def total(self, own: Rows, times: Floats, values: Floats | None = None) -> Floats:
        """Sum of the values of histories ``own`` at times in each window, or how many times there are."""
        found, cell = self.inside(own, times)
        return sums(cell, self.windows.cell[-1], None if values is None else values[found])

    def mean(self, own: Rows, times: Floats, values: Floats) -> Floats:
        """Mean of the values at times in each window, NaN where there is none."""
        found, cell = self.inside(own, times)
        count = sums(cell, self.windows.cell[-1])
        total = sums(cell, self.windows.cell[-1], values[found])
        return np.where(count > 0, total / np.maximum(count, 1.0), np.nan)

    def largest(self, own: Rows, times: Floats, values: Floats) -> Floats:
        """Largest value in each window, NaN where there is none; one at an edge is where the window before it got."""
        found, cell = self.until(own, times)
        return self._most(cell, values[found])

    def until(self, own: Rows, times: Floats) -> tuple[Rows, Rows]:
        """As `inside`, but a time at an edge belongs to the window before it."""
        windows = self.windows
        k = windows.number(own, times * (1.0 - 1e-12))
        begin = windows.edges[windows.first[own]]
        found = np.flatnonzero((k >= 0) & (k < windows.count[own]) & (times >= begin))
        return found, windows.cell[own[found]] + k[found]

    def most(self, own: Rows, times: Floats, values: Floats) -> Floats:
        """Largest value at times in each window, NaN where there is none."""
        found, cell = self.inside(own, times)
        return self._most(cell, values[found])

    def _most(self, cell: Rows, values: Floats) -> Floats:
        out = largest(cell, self.windows.cell[-1], values)
        return np.where(np.isfinite(out), out, np.nan)

    @cached_property
    def bounces(self) -> Floats:
        """Number of bounces in each window."""
        found = self.flights.bounces(self.counting)
        return self.total(self.flights.own[found], self.flights.start[found])

    @cached_property
    def contact(self) -> Floats:
        """Time in contact [s] in each window: each stay on the ground is shared out among the windows it meets."""
        own, start, end = self.flights.contacts(self.counting.height)
        windows = self.windows
        first, count = windows.first[own], windows.count[own]
        start = np.maximum(start, windows.edges[first])
        end = np.minimum(end, windows.edges[first + count])
        met = np.flatnonzero(end > start)
        own, start, end, first = own[met], start[met], end[met], first[met]
        a = windows.number(own, start)
        b = np.minimum(windows.number(own, end), windows.count[own] - 1)
        parts = firsts(b - a + 1)
        stay = owners(parts)
        k = a[stay] + places(parts)
        edge = first[stay] + k
        length = np.minimum(end[stay], windows.edges[edge + 1]) - np.maximum(start[stay], windows.edges[edge])
        return sums(windows.cell[own[stay]] + k, windows.cell[-1], length)
