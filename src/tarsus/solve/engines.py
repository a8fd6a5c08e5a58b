"""Which engine runs a scene many times, and what its runs share."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from tarsus.core import _native
from tarsus.laws import PullAsPrinted
from tarsus.plan import Plan, lower_scene
from tarsus.scene import Scene
from tarsus.solve.engine import Accuracy, RawRuns, SharedBook, execute
from tarsus.solve.march import RawWalks, tables_of, walk
from tarsus.structure.walker import Walker
from tarsus.walkplan import WalkPlan, lower_walker

__all__ = ["Engine", "Shared", "engine_for"]

MOST_KEPT = 32
"""Contact modes and step tables of so many different structures are kept for later runs."""


class Shared:
    """What engines have made that others can use, by what it depends on: the last ones used; safe between threads."""

    def __init__(self, most: int = MOST_KEPT) -> None:
        self._most = most
        self._made: OrderedDict[Any, Any] = OrderedDict()
        self._lock = threading.Lock()

    def get(self, key: Any, make: Callable[[], Any]) -> Any:
        """What belongs to a key; made now if it is not there."""
        with self._lock:
            if key not in self._made:
                self._made[key] = make()
            self._made.move_to_end(key)
            while len(self._made) > self._most:
                self._made.popitem(last=False)
            return self._made[key]


class Engine(Protocol):
    """Runs one plan for many law parameters (nr, m, np) and initial states (nr, 2n)."""

    @property
    def plan(self) -> Plan: ...

    def run(
        self,
        parameters: np.ndarray,
        initial: np.ndarray,
        period: float,
        accuracy: Accuracy | None,
        track: bool,
    ) -> RawRuns | RawWalks: ...


@dataclass(frozen=True)
class ByModes:
    """Runs by contact modes, which are made once for all runs of a structure."""

    plan: Plan
    duration: float
    book: SharedBook

    def run(
        self,
        parameters: np.ndarray,
        initial: np.ndarray,
        period: float,
        accuracy: Accuracy | None,
        track: bool,
    ) -> RawRuns:
        return execute(
            self.plan, self.duration, parameters=parameters, initial=initial, book=self.book, accuracy=accuracy,
            period=period, track=track,
        )  # fmt: skip


@dataclass(frozen=True)
class ByLegs:
    """Runs of walkers, which share the step tables of their legs."""

    walk: WalkPlan
    duration: float
    tables: _native.LegTables

    @property
    def plan(self) -> Plan:
        return self.walk.plan

    def run(
        self,
        parameters: np.ndarray,
        initial: np.ndarray,
        period: float,
        accuracy: Accuracy | None,
        track: bool,
    ) -> RawWalks:
        return walk(
            self.walk, self.duration, parameters=parameters, initial=initial, tables=self.tables, accuracy=accuracy,
            period=period, track=track,
        )  # fmt: skip


def engine_for(scene: Scene, duration: float, shared: Shared) -> Engine:
    """The engine for runs of a scene over ``duration`` [s].

    shared: what earlier engines have made; what this one makes is added.

    Raises
    ------
    InputError
        Where a law of the user cannot be compiled.
    """
    if isinstance(scene.robot.structure, Walker):
        walker = lower_walker(scene)
        legs = (duration, walker.blocks.tobytes())
        return ByLegs(walker, duration, shared.get(legs, lambda: tables_of(walker, duration)))
    ground = scene.ground
    plan = lower_scene(scene)
    loads = tuple(drive.load for drive in scene.robot.drives.values())
    as_printed = isinstance(ground.landing, PullAsPrinted)  # the other rules are in the law parameters
    structure = (
        duration,
        scene.robot.structure,
        scene.robot.feet,
        ground.gravity,
        ground.impact,
        as_printed,
        loads,
        plan.laws.use_rates,
    )
    return ByModes(plan, duration, shared.get(structure, lambda: SharedBook(plan, duration)))
