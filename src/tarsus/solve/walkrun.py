"""A walker's run: simulated by the walking engine, with the interface of every other run."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from tarsus.measure import scene_period
from tarsus.model.scene import Scene
from tarsus.model.structure.walker import Walker
from tarsus.plan.walker import WalkPlan, lower_walker
from tarsus.solve.engine import Accuracy
from tarsus.solve.engines import Shared, shared_tables
from tarsus.solve.march import RawWalks, walk
from tarsus.solve.run import Ledger, Run, increasing
from tarsus.solve.series import grid

if TYPE_CHECKING:
    from tarsus.core.replay import Integrals, Sampled
    from tarsus.files.series import Variable
    from tarsus.solve.walkseries import WalkSeries

SMALL = 0.3
"""Angle [rad] up to which a walker's geometry is linear, to about 5 %."""

__all__ = ["WalkRun", "run_walker", "structured_marks"]


def structured_marks(rows: np.ndarray, body: int, feet: int) -> np.ndarray:
    """Rows of marks (nm, 3 + nb + 2 m) as a structured array: time [s]; body (nb,) coordinates [m, rad]; foot_x and
    slipped (m,) place along the way and path slid in contact so far [m]; lowest, highest: heave since the last mark.
    """
    kind = np.dtype(
        [("time", "f8"), ("body", "f8", (body,)), ("foot_x", "f8", (feet,)), ("slipped", "f8", (feet,)),
         ("lowest", "f8"), ("highest", "f8")]
    )  # fmt: skip
    return np.ascontiguousarray(rows).view(kind).reshape(len(rows))


@dataclass(frozen=True, repr=False)
class WalkRun(Run):
    """A finished simulation of a walker. Series are taken by marching through the run again: the engine samples itself,
    so that nothing is interpolated."""

    raw: RawWalks  # type: ignore[assignment]
    walk: WalkPlan
    accuracy: Accuracy

    @property
    def walker(self) -> Walker:
        """The walking structure."""
        structure = self.scene.robot.structure
        assert isinstance(structure, Walker)
        return structure

    @cached_property
    def marks(self) -> np.ndarray:
        """Where the walker is at the start, at the end of every drive period and at the end; see `structured_marks`."""
        return structured_marks(self.raw.marks_of(0), len(self.walk.body.body_mass), self.plan.feet)

    @property
    def remarks(self) -> tuple[str, ...]:
        """A sentence for each turn of the body, seen at the marks, beyond the small angles that a walker assumes."""
        angles = np.abs(self.marks["body"]).max(axis=0)
        return tuple(
            f"The body's {name} reached {angle:.2g} rad: a walker is linear in small angles, and this is none."
            for name, angle in zip(self.walker.body_coordinates, angles, strict=True)
            if name in ("roll", "pitch") and angle > SMALL
        )

    def _again(self, times: np.ndarray) -> RawWalks:
        return walk(
            self.walk, self.duration, accuracy=self.accuracy, period=self.period, account=True, times=times
        )

    @cached_property
    def series(self) -> WalkSeries:  # type: ignore[override]
        """States and forces on an even time grid."""
        return self.at(grid(self))

    @property
    def energies(self) -> Integrals:
        """A walker keeps no record of its steps; see `series` and `ledger`."""
        raise AttributeError("a walker's run has no record of its steps; use series.cumulative or ledger")

    @cached_property
    def ledger(self) -> Ledger:
        """Energy ledger of the whole run."""
        from tarsus.solve.walkseries import ledger_of

        return ledger_of(self)

    def at(self, times: np.ndarray) -> WalkSeries:  # type: ignore[override]
        """Series at the given times [s], increasing: the engine's own solution, not an interpolation.

        Raises InputError where the times are not in order.
        """
        from tarsus.solve.walkseries import series_of

        when = increasing(times)
        return series_of(self, self._again(when), when)

    def states(self, times: np.ndarray) -> Sampled:
        """States and contact forces alone at the given times [s], increasing."""
        return self.at(times).state

    def variables(self, times: np.ndarray | None = None) -> dict[str, Variable]:
        """The series as plain arrays by name; on an even grid unless ``times`` [s] are given."""
        from tarsus.solve.dataset import to_walk_variables

        return to_walk_variables(self, self.series if times is None else self.at(times))


def run_walker(scene: Scene, seconds: float, accuracy: Accuracy, shared: Shared | None = None) -> WalkRun:
    """Simulate a walker for ``seconds``.

    Raises
    ------
    InputError
        Where a law of the user cannot be compiled.
    """
    plan = lower_walker(scene)
    period = scene_period(scene, seconds)
    start = time.perf_counter()
    tables = None if shared is None else shared_tables(plan, seconds, shared)
    raw = walk(plan, seconds, tables=tables, accuracy=accuracy, period=period, account=True)
    return WalkRun(scene, plan.plan, raw, seconds, period, time.perf_counter() - start, plan, accuracy)
