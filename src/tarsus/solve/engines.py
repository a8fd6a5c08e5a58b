"""Which engine runs a scene many times, and what its runs share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from tarsus.core.walk.arrays import Tables
from tarsus.plan import Plan, lower_scene
from tarsus.scene import Scene
from tarsus.solve.engine import Accuracy, RawRuns, SharedBook, execute
from tarsus.solve.march import RawWalks, tables_of, walk
from tarsus.structure.walker import Walker
from tarsus.walkplan import WalkPlan, lower_walker

__all__ = ["Engine", "engine_for"]


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
    tables: Tables

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


def engine_for(scene: Scene, duration: float, shared: dict[Any, Any]) -> Engine:
    """The engine for runs of a scene over ``duration`` [s].

    shared: what earlier engines have made, by what it depends on; this one's is added.

    Raises
    ------
    InputError
        Where a law of the user cannot be compiled.
    """
    if isinstance(scene.robot.structure, Walker):
        plan = lower_walker(scene)
        legs = plan.blocks.tobytes()
        if legs not in shared:
            shared[legs] = tables_of(plan, duration)
        return ByLegs(plan, duration, shared[legs])
    ground = scene.ground
    loads = tuple(drive.load for drive in scene.robot.drives.values())
    key = (scene.robot.structure, scene.robot.feet, ground.gravity, ground.impact, loads)
    plain = lower_scene(scene)
    if key not in shared:
        shared[key] = SharedBook(plain, duration)
    return ByModes(plain, duration, shared[key])
