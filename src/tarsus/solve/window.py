"""Windows: a plan run from any moments and states, with outputs at any times, and derivatives of these."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from tarsus.base.events import EventKind, FootState
from tarsus.core.states import SampledStates
from tarsus.plan.rows import Rows, rows_of
from tarsus.solve.codes import EVENT_TYPE, ResultCode, event_places, structured_events, without_marks
from tarsus.solve.contacts import APEX, CONTACT, Contacts
from tarsus.solve.engine import SINGLE_RUN, Accuracy, Engine, Tables, settings_of
from tarsus.solve.motion import RunLaws
from tarsus.solve.window_gradients import SEEN, Copies, WindowGradients
from tarsus.solve.window_run import Ran, WindowStart, WindowStarts, run_windows

if TYPE_CHECKING:
    from tarsus.base.workers import Workers
    from tarsus.plan.lowering import Plan
    from tarsus.solve.slopes import WindowSlopes

__all__ = ["Contacts", "Window", "WindowBatch", "WindowGradients", "WindowStart", "simulate_windows"]

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Window:
    """A plan run from a given state.

    times (nt,) [s]; states: displacements, velocities, gaps, forces and pulls at the times; code: how it ended, no
    energy account being asked for; rows: every event as the engine has it; end (2n,): displacements and velocities at
    its end, events of that moment included; feet (m, k): what feet carry on from there; slopes: derivatives where asked
    for.
    """

    acting: RunLaws
    times: Floats
    states: SampledStates
    code: ResultCode
    rows: Floats
    end: Floats
    feet: Floats
    slopes: WindowSlopes | None = None

    @cached_property
    def events(self) -> npt.NDArray[np.void]:
        """Events in time order, fields as those of a run."""
        return without_marks(structured_events(self.rows))

    def event_slopes(self, name: str) -> Floats:
        """Derivatives (ne, P) of a field of `events`, in their order."""
        assert self.slopes is not None
        return self._of_events(self.slopes.rows, name)

    def event_errors(self, name: str) -> Floats:
        """Possible errors of `event_slopes`."""
        assert self.slopes is not None
        return self._of_events(self.slopes.row_errors, name)

    def _of_events(self, rows: Floats, name: str) -> Floats:
        return rows[event_places(self.rows)[name], (EVENT_TYPE.names or ()).index(name)]

    @property
    def flags(self) -> Mapping[str, tuple[str, ...]]:
        """Why derivatives by a number are not to be had of what comes after some moment, by name; none as a rule."""
        assert self.slopes is not None
        return MappingProxyType({self.slopes.names[one.number]: (str(one),) for one in self.slopes.flags})

    def repeated(self, after: float) -> npt.NDArray[np.void]:
        """As `events`, of a motion that repeats with the window, after so long [s]: the flight that the window's end
        cuts is the one that its start cuts."""
        found, (apex, apex_time) = structured_events(self.rows), self.feet[:, APEX].T
        cut = np.zeros(len(self.feet), dtype=EVENT_TYPE)
        cut["foot"], cut["kind"], cut["time"] = np.arange(len(cut)), EventKind.PERIOD_MARK, self.times[-1]
        cut["apex"], cut["apex_time"] = apex, apex_time
        before = np.concatenate([found, cut[self.feet[:, CONTACT] == FootState.AIR]])
        before["apex_time"] -= after
        return without_marks(np.concatenate([before, found]))[len(self.events) :]

    @cached_property
    def forces(self) -> Mapping[str, Floats]:
        """Force [N] (m, nt) of every smooth law on the feet by name, positive along the normal."""
        return self.acting.forces(self.states.gap, self.states.rate, self.states.held, self.times)


@dataclass(frozen=True)
class WindowBatch(Sequence[Window]):
    """Windows of one plan, one after the other; each of them is there by its number.

    starts: where each started; data: the rows of data there were, sources (nw, 2): which of these each ran on, and its
    row there; ran: what they came to; slopes: derivatives of that.
    """

    plan: Plan
    starts: Sequence[WindowStart]
    data: Sequence[Rows]
    sources: npt.NDArray[np.int64]
    ran: Ran
    slopes: WindowSlopes | None = None

    @property
    def times(self) -> Floats:
        """Times (nt,) [s] of all, end to end, those of window w from first[w] to first[w + 1]."""
        return self.ran.times

    @property
    def first(self) -> npt.NDArray[np.int64]:
        """Where those of each window begin (nw + 1,)."""
        return self.ran.first

    @property
    def states(self) -> SampledStates:
        """States at these."""
        return self.ran.states

    @property
    def rows(self) -> Floats:
        """Event rows of all."""
        return self.ran.events

    def __len__(self) -> int:
        return len(self.starts)

    def __getitem__(self, window: Any) -> Any:
        if isinstance(window, slice):
            return [self[w] for w in range(*window.indices(len(self)))]
        w = range(len(self))[window]
        ran = self.ran
        at, events = slice(*ran.first[w : w + 2]), slice(*ran.begin[w : w + 2])
        slopes = None if self.slopes is None else self.slopes.part(w, at, events)
        source, row = self.sources[w].tolist()
        own = self.data[source].taken(slice(row, row + 1))
        acting = RunLaws(self.plan, own.starting(np.asarray(self.starts[w].state, dtype=float)))
        code = ResultCode.of(int(ran.codes[w]))
        return Window(
            acting, ran.times[at], ran.states.part(at), code, ran.events[events], ran.ends[w], ran.feet[w], slopes
        )


def simulate_windows(
    plan: Plan,
    starts: Sequence[WindowStart],
    *,
    rows: Rows | None = None,
    gradients: WindowGradients | None = None,
    shared: Tables | None = None,
    accuracy: Accuracy = SINGLE_RUN,
    threads: Workers = None,
    forces: bool = True,
) -> WindowBatch:
    """Run many windows of one plan in one call of the engine, each from its own state at its own time.

    Parameters
    ----------
    plan
        The plan of a scene (`tarsus.plan.lowering.lower_scene`).
    starts
        Where each window starts, and when outputs are wanted of it.
    rows
        Rows of data in place of the plan's (`tarsus.plan.slots.rows_for`), of which each window names its own; their
        initial states and periods are not used. Not with ``gradients`` by numbers of a scene, which have theirs.
    gradients
        By what there are first derivatives of all outputs and events, each with its error; by nothing unless given.
    shared
        Contact modes of the plan's structure, or step tables of its legs, to share with other windows; made for a
        duration not below the last time.
    accuracy
        Tolerances; those of a single run by default.
    threads
        Of windows without derivatives; by default one for each processor that this process may use.
    forces
        Whether states of a walker have gaps and forces of its feet, which take as long as all else of short windows.

    Raises
    ------
    InputError
        For states, times or contacts that do not fit the plan, data that are not there, and numbers that cannot vary.
    """
    entered = () if gradients is None else gradients.entered
    data = [one.row for one in entered] or [rows_of(plan) if rows is None else rows]
    given = WindowStarts.of(plan, starts, data)
    end = float(given.times.max(initial=0.0))
    tables = shared or Engine(plan, end).tables
    settings = settings_of(plan, end, accuracy)
    along = None if gradients is None else gradients.along(len(starts), len(plan.system.mass))
    if gradients is None or along is None or not gradients.names(along):
        ran, slopes = run_windows(plan, tables, data, given, settings, threads, forces=forces), None
    else:
        seen, at = given.denser(SEEN)
        finer = settings_of(plan, end, accuracy.finer)
        ran = run_windows(plan, tables, data, seen, settings, forces=forces)
        copies = Copies(plan, tables, data, seen, gradients, along, settings, forces)
        found = copies.differenced(ran, run_windows(plan, tables, data, seen, finer, forces=forces))
        slopes, ran = found.slopes(gradients.names(along)).at(at), ran.at(at, given.first)
    return WindowBatch(plan, starts, data, given.sources, ran, slopes)
