"""Runs that wait where they are: each goes on from its state for as long as it is asked to, and no other with it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.events import FootState
from tarsus.plan.slots import Kind, slot
from tarsus.solve.codes import ResultCode
from tarsus.solve.contacts import CARRIED, fresh_feet
from tarsus.solve.engine import Accuracy, Advanced, Continuations, advance_many, settings_of
from tarsus.solve.run import prepared
from tarsus.solve.shared import Shared
from tarsus.solve.window import Window, WindowStart, simulate_windows

if TYPE_CHECKING:
    from tarsus.base.workers import Workers
    from tarsus.model.scene import Scene
    from tarsus.plan.lowering import Plan
    from tarsus.plan.rows import Rows

Floats = NDArray[np.float64]

TOGETHER = 8
"""Runs that a thread is given at a time: what a call of the engine costs is then lost in what they take."""


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
    settings: Any = field(repr=False)

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
            raise InputError([f"{path}: makes a plan of its own; runs that go on together share one" for path in wrong])
        engine, rows = prepared(scene, vary, longest, shared or Shared(), count)
        count = len(rows)
        alike = all(place is not None and place.kind is Kind.INITIAL for place in places.values())
        data = np.zeros(count, dtype=np.intp) if alike else np.arange(count)
        return cls(
            engine.plan,
            engine.tables,
            rows,
            data,
            np.zeros(count),
            rows.initial.copy(),
            fresh_feet(count, engine.plan.feet),
            np.zeros(count, dtype=np.int64),
            accuracy or Accuracy(),
            longest,
            settings_of(engine.plan, longest, accuracy),
        )

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

    @property
    def since(self) -> Floats:
        """Since when (nr, m) [s] those are."""
        return self.feet[..., CARRIED.index("since")]

    def of_runs(self, runs: NDArray[np.intp]) -> Trajectories:
        """Copies of some runs where they are, which go on by themselves."""
        moved = ("data", "time", "state", "feet", "code")
        return replace(self, **{name: getattr(self, name)[runs].copy() for name in moved})

    def advance(
        self, times: Sequence[Floats], runs: NDArray[np.intp] | None = None, threads: Workers = None
    ) -> list[Window]:
        """Let runs, all or those of these numbers, go on to the last of their own times (nt,) [s], which are in order
        and none before where they are; what came of it: outputs at the times, and events.

        A run that does not reach its end stays where it was, and its code says why.
        """
        chosen = np.arange(len(self)) if runs is None else np.asarray(runs)
        starts = [
            WindowStart(self.state[r], float(self.time[r]), when, self.feet[r], int(self.data[r]))
            for r, when in zip(chosen.tolist(), times, strict=True)
        ]
        found = simulate_windows(
            self.plan, starts, rows=self.rows, shared=self.tables, accuracy=self.accuracy, threads=threads
        )
        for r, window in zip(chosen.tolist(), found, strict=True):
            self.code[r] = window.code.number
            if window.code is ResultCode.DONE:
                self.time[r] = window.times[-1]
                self.state[r], self.feet[r] = window.end, window.feet
        return list(found)

    def go_on(self, until: Floats, rows: Rows, *, account: bool = False, threads: Workers = None) -> Advanced:
        """Let all runs go on to times of their own (nr,) [s], none before where it is, on rows of data (nr) that may
        have changed, and move them there, also those that end before; what happened on the way. No outputs, no
        derivatives: a step of `tarsus.Session`. account: integrate energies."""
        own = np.stack([np.zeros(len(self), dtype=np.int64), np.arange(len(self))], axis=1)
        made = advance_many(
            self.plan,
            self.tables,
            self.settings,
            [rows],
            Continuations(self.state, self.time, until, self.feet, own),
            account=account,
            together=TOGETHER,
            threads=threads,
        )
        self.code, self.state, self.feet = made.codes, made.states, made.feet
        self.time = made.finish[:, 0].copy()
        return made


_DONE = ResultCode.DONE.number
