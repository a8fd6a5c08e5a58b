"""Runs that wait where they are: each goes on from its state for as long as it is asked to, and no other with it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.events import FootState
from tarsus.base.workers import Workers, spread, workers
from tarsus.core import _native
from tarsus.core.modes import NODES, ModeBook
from tarsus.plan.slots import Kind, slot
from tarsus.solve.codes import ResultCode
from tarsus.solve.contacts import CARRIED, fresh_feet
from tarsus.solve.engine import Accuracy, settings_of
from tarsus.solve.simulate import Shared, prepared
from tarsus.solve.window import Window, WindowBatch, WindowStart, simulate_windows

if TYPE_CHECKING:
    from tarsus.model.scene import Scene
    from tarsus.plan.lowering import Plan
    from tarsus.plan.slots import Rows

Floats = NDArray[np.float64]

TOGETHER = 8
"""Runs that a thread is given at a time: what a call of the engine costs is then lost in what they take."""


JOBS = 4
"""Parts for each thread of robots that are stepped together: the last to end is then not waited for long."""


class StepLog(NamedTuple):
    """What runs did on their way: event rows of all, one run after the other, and where those of each end (nr,);
    energies (nr, .) of a walker, recorded steps and where those of each run end of a structure, where asked for."""

    events: Floats
    event_end: NDArray[np.int64]
    energies: Floats | None
    trace: Floats | None
    trace_end: NDArray[np.int64] | None


@dataclass
class Trajectories:
    """Runs of one plan, kept where they are.

    time (nr,) [s]: how far each has come; state (nr, 2n): displacements and velocities there; feet (nr, m, k): what the
    feet of each carry on (`tarsus.solve.contacts.CARRIED`); code: how each has ended so far, of which only those that
    are done go on; data: the rows of data that they run on, by number (nr,); longest [s]: what tables are made for.
    """

    plan: Plan
    tables: Any
    rows: Rows
    data: NDArray[np.intp]
    time: Floats
    state: Floats
    feet: Floats
    code: NDArray[np.int64]
    accuracy: Accuracy
    longest: float
    made: dict[bool, Any] = field(default_factory=dict, repr=False)

    @classmethod
    def of(
        cls,
        scene: Scene,
        vary: Mapping[str, Floats],
        longest: float,
        *,
        accuracy: Accuracy | None = None,
        shared: Shared | None = None,
        count: int = 1,
    ) -> Trajectories:
        """Runs of a scene at their starts, at time 0, which may go on up to ``longest`` [s].

        vary: values (nr,) [SI] by path, each of a slot (`tarsus.plan.slots`) and within its bounds; without any there
        are ``count`` runs. Raises InputError for other paths, and as `simulate_batch` does.
        """
        places = {path: slot(scene, path) for path in vary}
        if wrong := [path for path, place in places.items() if place is None]:
            raise InputError(
                [f"{path}: makes a plan of its own; runs that go on together share one" for path in wrong]
            )
        engine, rows = prepared(scene, vary, longest, shared or Shared(), count)
        count = len(rows)
        alike = all(place is not None and place.kind is Kind.INITIAL for place in places.values())
        data = np.zeros(count, dtype=np.intp) if alike else np.arange(count)
        return cls(
            engine.plan, engine.tables, rows, data, np.zeros(count), rows.initial.copy(),
            fresh_feet(count, engine.plan.feet), np.zeros(count, dtype=np.int64), accuracy or Accuracy(), longest,
        )  # fmt: skip

    def __len__(self) -> int:
        return len(self.time)

    @property
    def done(self) -> NDArray[np.bool_]:
        """Which runs (nr,) have come as far as they were asked to."""
        return self.code == _DONE

    @property
    def held(self) -> NDArray[np.bool_]:
        """Which feet (nr, m) are on the ground."""
        return self.feet[..., CARRIED.index("contact")] != FootState.AIR

    def of_runs(self, runs: NDArray[np.intp]) -> Trajectories:
        """Copies of some runs where they are, which go on by themselves."""
        moved = ("data", "time", "state", "feet", "code")
        return replace(self, **{name: getattr(self, name)[runs].copy() for name in moved})

    def advance(
        self, times: Sequence[Floats], runs: NDArray[np.intp] | None = None, threads: Workers = None
    ) -> list[Window]:
        """Let runs, all or those of these numbers, go on to the last of each one's own times (nt,) [s], which are in
        order and none before where it is; what came of it: outputs at the times, and events.

        A run that does not reach its end stays where it was, and its code says why.
        """
        chosen = np.arange(len(self)) if runs is None else np.asarray(runs)
        starts = [
            WindowStart(self.state[r], float(self.time[r]), when, self.feet[r], int(self.data[r]))
            for r, when in zip(chosen.tolist(), times, strict=True)
        ]
        jobs = [starts[first : first + TOGETHER] for first in range(0, len(starts), TOGETHER)]
        work = partial(
            simulate_windows, self.plan, rows=self.rows, shared=self.tables, accuracy=self.accuracy
        )
        batches: list[WindowBatch] = list(spread(work, jobs, threads))
        found = [window for batch in batches for window in batch]
        for r, window in zip(chosen.tolist(), found, strict=True):
            self.code[r] = window.code.number
            if window.code is ResultCode.DONE:
                self.time[r] = window.times[-1]
                self.state[r], self.feet[r] = window.end, window.feet
        return found

    def _settings(self, record: bool) -> Any:
        if record not in self.made:
            self.made[record] = settings_of(self.plan, self.longest, self.accuracy, record=record)
        return self.made[record]

    def go_on(self, until: Floats, rows: Rows, *, account: bool = False, threads: Workers = None) -> StepLog:
        """Let all runs go on to times of their own (nr,) [s], none before where it is, on rows of data (nr) that may
        have changed and are without periods, and move them there, also those that end before; what happened on the way.
        No outputs, no derivatives: a step of `tarsus.Session`. account: energies, or the steps that they are integrated
        from."""
        settings = self._settings(account and self.plan.legs is None)
        most = len(self) // TOGETHER
        size = len(self) if most < 2 else -(-len(self) // min(JOBS * workers(threads), most))
        jobs = [slice(first, first + size) for first in range(0, len(self), size)]

        def work(part: slice) -> Sequence[Any]:
            own = replace(rows.taken(part), initial=self.state[part])
            ways = tuple(np.ascontiguousarray(one[part]) for one in (self.time, until, self.feet))
            plan, tables = self.plan, self.tables
            if plan.legs is None:
                laws = plan.laws.native
                return _native.advance_modal(tables.native, NODES, rows.signals, laws, settings, own, ways)
            return _native.advance_legged(
                plan.legs.native, tables, NODES, rows.signals, plan.laws.native, settings, own, ways, account
            )

        found = [work(jobs[0])] if len(jobs) == 1 else list(spread(work, jobs, threads))
        codes, finish, states, feet, events, ends, first, second = (
            [one[k] for one in found] for k in range(8)
        )
        self.code, self.state, self.feet = _all(codes), _all(states), _all(feet).reshape(self.feet.shape)
        self.time = _all(finish)[:, 0].copy()
        walks = not isinstance(self.tables, ModeBook)
        return StepLog(
            _all(events), _one_after_another(ends, events), _all(first) if walks else None,
            None if walks else _all(first), None if walks else _one_after_another(second, first),
        )  # fmt: skip


_DONE = ResultCode.DONE.number


def _all(parts: Sequence[Any]) -> Any:
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def _one_after_another(ends: Sequence[Any], rows: Sequence[Any]) -> NDArray[np.int64]:
    """Ends of what several calls returned, counted through all."""
    if len(ends) == 1:
        return ends[0]
    before = np.cumsum([0, *map(len, rows)])
    return np.concatenate([end + first for end, first in zip(ends, before, strict=False)])
