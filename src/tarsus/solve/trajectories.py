"""Runs that wait where they are: each goes on from its state for as long as it is asked to, and no other with it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.workers import Workers, spread
from tarsus.plan.slots import Kind, slot
from tarsus.solve.codes import ResultCode
from tarsus.solve.contacts import Contacts
from tarsus.solve.engine import Accuracy
from tarsus.solve.simulate import Shared, prepared
from tarsus.solve.window import Window, WindowBatch, WindowStart, simulate_windows

if TYPE_CHECKING:
    from tarsus.model.scene import Scene
    from tarsus.plan.lowering import Plan
    from tarsus.plan.slots import Rows

Floats = NDArray[np.float64]

TOGETHER = 8
"""Runs that a thread is given at a time: what a call of the engine costs is then lost in what they take."""


@dataclass
class Trajectories:
    """Runs of one plan, kept where they are.

    time (nr,) [s]: how far each has come; state (nr, 2n): displacements and velocities there; contacts: what the feet
    of each do there; code: how each has ended so far, of which only those that are done go on; data: the rows of data
    that they run on, by number (nr,).
    """

    plan: Plan
    tables: Any
    rows: Rows
    data: NDArray[np.intp]
    time: Floats
    state: Floats
    contacts: list[Contacts]
    code: list[ResultCode]
    accuracy: Accuracy

    @classmethod
    def of(
        cls,
        scene: Scene,
        vary: Mapping[str, Floats],
        longest: float,
        *,
        accuracy: Accuracy | None = None,
        shared: Shared | None = None,
    ) -> Trajectories:
        """Runs of a scene at their starts, at time 0, which may go on up to ``longest`` [s].

        vary: values (nr,) [SI] by path, each of a slot (`tarsus.plan.slots`) and within its bounds. Raises InputError
        for other paths, where feet remember their contacts (a law with `remaining`), and as `simulate_batch` does.
        """
        places = {path: slot(scene, path) for path in vary}
        if wrong := [path for path, place in places.items() if place is None]:
            raise InputError(
                [f"{path}: makes a plan of its own; runs that go on together share one" for path in wrong]
            )
        engine, rows = prepared(scene, vary, longest, shared or Shared())
        if engine.plan.laws.remembers:
            raise InputError(
                "runs do not go on where feet remember their contacts: what they bring along is in no state"
            )
        count = len(rows)
        alike = all(place is not None and place.kind is Kind.INITIAL for place in places.values())
        data = np.zeros(count, dtype=np.intp) if alike else np.arange(count)
        return cls(
            engine.plan, engine.tables, rows, data, np.zeros(count), rows.initial.copy(), [Contacts()] * count,
            [ResultCode.DONE] * count, accuracy or Accuracy(),
        )  # fmt: skip

    def __len__(self) -> int:
        return len(self.time)

    @property
    def done(self) -> NDArray[np.bool_]:
        """Which runs (nr,) have come as far as they were asked to."""
        return np.array([code is ResultCode.DONE for code in self.code], dtype=bool)

    def of_runs(self, runs: NDArray[np.intp]) -> Trajectories:
        """Copies of some runs where they are, which go on by themselves."""
        contacts, code = [self.contacts[r] for r in runs], [self.code[r] for r in runs]
        time, state, data = self.time[runs].copy(), self.state[runs].copy(), self.data[runs]
        return Trajectories(
            self.plan, self.tables, self.rows, data, time, state, contacts, code, self.accuracy
        )

    def advance(
        self, times: Sequence[Floats], runs: NDArray[np.intp] | None = None, threads: Workers = None
    ) -> list[Window]:
        """Let runs, all or those of these numbers, go on to the last of each one's own times (nt,) [s], which are in
        order and none before where it is; what came of it: outputs at the times, and events.

        A run that does not reach its end stays where it was, and its code says why.
        """
        chosen = np.arange(len(self)) if runs is None else np.asarray(runs)
        starts = [
            WindowStart(self.state[r], float(self.time[r]), when, self.contacts[r], int(self.data[r]))
            for r, when in zip(chosen.tolist(), times, strict=True)
        ]
        jobs = [starts[first : first + TOGETHER] for first in range(0, len(starts), TOGETHER)]
        work = partial(
            simulate_windows, self.plan, rows=self.rows, shared=self.tables, accuracy=self.accuracy
        )
        batches: list[WindowBatch] = list(spread(work, jobs, threads))
        found = [window for batch in batches for window in batch]
        for r, start, window in zip(chosen.tolist(), starts, found, strict=True):
            self.code[r] = window.code
            if window.code is ResultCode.DONE:
                self.contacts[r] = start.contacts.after(window.events, start.t0, float(window.times[-1]))
                self.time[r] = window.times[-1]
                self.state[r] = np.concatenate([window.states.x[:, -1], window.states.v[:, -1]])
        return found
