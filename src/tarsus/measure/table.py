"""Runs side by side, as measures see them, and how they are asked to be measured."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from tarsus.core import _native
from tarsus.measure.history import RESOLUTION, Columns, Counting, EventHistories
from tarsus.measure.windows import WindowedHistories, Windows

if TYPE_CHECKING:
    from tarsus.measure.segments import Floats, Rows


class HasMeasures(Protocol):
    """What is judged: a run, or one run of a batch. A walker's has ``scene`` and ``marks`` besides."""

    @property
    def all_events(self) -> np.ndarray: ...
    @property
    def foot_names(self) -> tuple[str, ...]: ...
    @property
    def end_time(self) -> float: ...
    @property
    def period(self) -> float: ...


@dataclass(frozen=True)
class RunTable:
    """nr runs of feet by name: events as for `EventHistories`; ends, period (nr,) [s].

    marks: of walkers, their ways as in `tarsus.solve.codes.structured_marks`, run r's at
    ``mark_first[r]:mark_first[r + 1]``; scene: the description number ``variant[r]`` of run r, in all but its ground
    laws' parameters and its start.
    """

    events: Columns
    first: Rows
    feet: tuple[str, ...]
    ends: Floats
    period: Floats
    variant: Rows
    scene: Callable[[int], Any]
    marks: np.ndarray | None = None
    mark_first: Rows | None = None

    def __len__(self) -> int:
        return len(self.ends)

    @classmethod
    def of(cls, run: HasMeasures) -> RunTable:
        """A run as a batch of one."""
        events, marks = run.all_events, getattr(run, "marks", None)
        return cls(
            events,
            np.array([0, len(events)]),
            tuple(run.foot_names),
            np.array([run.end_time], dtype=float),
            np.array([run.period], dtype=float),
            np.zeros(1, dtype=np.intp),
            lambda _: getattr(run, "scene", None),
            marks,
            None if marks is None else np.array([0, len(marks)]),
        )


def periods_used(reached: Floats, period: Floats, skip: int | Rows | None) -> tuple[Rows, Rows]:
    """Number of the first drive period of the statistics (nr,), and of whole periods in all (nr,), of runs that reached
    a time [s]: at least one, which is a broken one if need be, but none where no time passed; see
    `tarsus.measure.period_statistics`."""
    asked = np.ascontiguousarray(np.broadcast_to(-1 if skip is None else skip, reached.shape), dtype=np.int64)
    ends, spans = (np.ascontiguousarray(one, dtype=float) for one in (reached, period))
    dropped, count = _native.periods_used(ends, spans, asked)
    return dropped, count


@dataclass(frozen=True)
class Judgement:
    """Runs, and how they are measured: by drive period [s], the runs' own unless given, after so many skipped ones, for
    all or for each (nr,), a third of them unless given; height [m] and dwell [s] as in `Counting`. Nothing is computed
    before it is asked for.
    """

    table: RunTable
    period: float | None = None
    skip: int | Rows | None = None
    height: float = RESOLUTION
    dwell: float | None = None

    @cached_property
    def spans(self) -> Floats:
        """Drive period (nr,) [s]."""
        return self.table.period if self.period is None else np.full(len(self.table), float(self.period))

    @cached_property
    def used(self) -> tuple[Rows, Rows]:
        """First and number of whole periods (nr,)."""
        return periods_used(self.table.ends, self.spans, self.skip)

    @cached_property
    def counting(self) -> Counting:
        """What counts, run by run."""
        return Counting.of(self.spans, self.height, self.dwell)

    @cached_property
    def histories(self) -> EventHistories:
        """What every foot of every run did."""
        table, m = self.table, len(self.table.feet)
        return EventHistories(table.events, table.first, table.ends, range(m), m)

    @cached_property
    def windows(self) -> Windows:
        """Drive periods of every run."""
        return Windows.of_periods(*self.used, self.spans, self.table.ends)

    @cached_property
    def seen(self) -> WindowedHistories:
        """What every foot of every run did, by drive period."""
        m = len(self.table.feet)
        if m == 1:
            return WindowedHistories(self.histories, self.windows, self.by_foot)
        dropped, count = (np.repeat(one, m) for one in self.used)
        spans, ends = (np.repeat(one, m) for one in (self.spans, self.table.ends))
        return WindowedHistories(self.histories, Windows.of_periods(dropped, count, spans, ends), self.by_foot)

    @cached_property
    def by_foot(self) -> Counting:
        """What counts, foot by foot of every run."""
        dwell = np.broadcast_to(self.counting.dwell, len(self.table))
        return Counting(self.height, np.repeat(dwell, len(self.table.feet)))
