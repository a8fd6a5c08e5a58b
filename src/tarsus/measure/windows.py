"""Windows of time, each run with its own, and what feet do in them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from tarsus.core import _native
from tarsus.measure.segments import Floats, Rows, firsts, owners, places

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
        return cls(*_native.period_edges(dropped, count, *(np.ascontiguousarray(one) for one in (span, reached))))

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
        """Of history ``own`` (nq,), number of its last edge at or before ``times`` (nq,), -1 before the first."""
        return np.asarray(_native.edge_numbers(self.edges, self.first, own, np.ascontiguousarray(times)))


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

    def of(self, name: str) -> Floats:
        """Values (nw,) of a measure in all windows; NaN where there is none."""
        histories, windows = self.histories, self.windows
        dwell = histories.dwell(self.counting)
        return histories.native.in_windows(name, windows.edges, windows.first, self.counting.height, dwell)

    def inside(self, own: Rows, times: Floats) -> tuple[Rows, Rows]:
        """Which of the times are in a window of their history, and in which; one at the last edge is in the last."""
        return self._windows(own, times, ended=False)

    def until(self, own: Rows, times: Floats) -> tuple[Rows, Rows]:
        """As `inside`, but a time at an edge belongs to the window before it."""
        return self._windows(own, times, ended=True)

    def _windows(self, own: Rows, times: Floats, *, ended: bool) -> tuple[Rows, Rows]:
        windows, when = self.windows, np.ascontiguousarray(times)
        found = np.asarray(_native.window_numbers(windows.edges, windows.first, own, when, ended))
        inside = np.flatnonzero(found >= 0)
        return inside, found[inside]
