"""Which engine runs a scene many times, and what its runs share."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from tarsus.core import _native
from tarsus.core.book import step_lengths
from tarsus.model.drive.law import VoltageLaw
from tarsus.model.drive.lower import lower
from tarsus.model.drive.pieces import Pieces
from tarsus.model.drive.signal import Signal
from tarsus.model.scene import Scene
from tarsus.model.structure.walker import Walker
from tarsus.plan.lowering import Plan, lower_scene
from tarsus.plan.slots import Rows
from tarsus.plan.walker import WalkPlan, lower_walker
from tarsus.solve.engine import Accuracy, RawRuns, SharedBook, execute, structure_key
from tarsus.solve.march import RawWalks, tables_of, walk

__all__ = ["Engine", "Shared", "engine_for", "shared_book", "shared_tables"]

MOST_KEPT = 32
"""So many tables of structures and drives are kept for later runs."""


class Shared:
    """What engines have made that others can use, by what it depends on: tables of structures, drives; those last used.

    Safe between threads.
    """

    def __init__(self, most: int = MOST_KEPT) -> None:
        self._most = most
        self._made: OrderedDict[Any, Any] = OrderedDict()
        self._lock = threading.Lock()

    @property
    def keys(self) -> list[Any]:
        """What is kept, by what it depends on; the last one used comes last."""
        with self._lock:
            return list(self._made)

    def get(self, key: Any, make: Callable[[], Any]) -> Any:
        """What belongs to a key; made if it is not there, outside of the lock: of two the first made stays."""
        with self._lock:
            found = self._made.get(key)
            if found is not None:
                self._made.move_to_end(key)
                return found
        made = make()
        with self._lock:
            made = self._made.setdefault(key, made)
            self._made.move_to_end(key)
            while len(self._made) > self._most:
                self._made.popitem(last=False)
        return made


class Engine(Protocol):
    """Runs one plan for many rows of its data."""

    @property
    def plan(self) -> Plan: ...

    def run(self, rows: Rows, accuracy: Accuracy | None, track: bool) -> RawRuns | RawWalks: ...


@dataclass(frozen=True)
class ByModes:
    """Runs by contact modes, which are made once for all runs of a structure."""

    plan: Plan
    duration: float
    book: SharedBook

    def run(self, rows: Rows, accuracy: Accuracy | None, track: bool) -> RawRuns:
        return execute(self.plan, self.duration, rows=rows, book=self.book, accuracy=accuracy, track=track)


@dataclass(frozen=True)
class ByLegs:
    """Runs of walkers, which share the step tables of their legs."""

    walk: WalkPlan
    duration: float
    tables: _native.LegTables

    @property
    def plan(self) -> Plan:
        return self.walk.plan

    def run(self, rows: Rows, accuracy: Accuracy | None, track: bool) -> RawWalks:
        return walk(self.walk, self.duration, rows=rows, tables=self.tables, accuracy=accuracy, track=track)


def engine_for(scene: Scene, duration: float, shared: Shared) -> Engine:
    """The engine for runs of a scene over ``duration`` [s].

    shared: what earlier engines have made; what this one makes is added.

    Raises
    ------
    InputError
        Where a law of the user cannot be compiled.
    """

    def drive(signal: Signal, law: VoltageLaw, history: tuple[float, ...]) -> tuple[Pieces, Pieces]:
        return shared.get((signal, law, history), lambda: lower(signal, law, history))

    if isinstance(scene.robot.structure, Walker):
        walker = lower_walker(scene, drive)
        return ByLegs(walker, duration, shared_tables(walker, duration, shared))
    plan = lower_scene(scene, drive)
    return ByModes(plan, duration, shared_book(plan, duration, shared))


def shared_book(plan: Plan, duration: float, shared: Shared) -> SharedBook:
    """The contact modes of a plan, those of an earlier one where its tables serve it."""
    return shared.get(structure_key(plan, duration), lambda: SharedBook(plan, duration))


def shared_tables(walker: WalkPlan, duration: float, shared: Shared) -> _native.LegTables:
    """The step tables of a walker's legs, those of an earlier one where they serve it."""
    key = (float(step_lengths(duration)[0]), walker.blocks.tobytes())
    return shared.get(key, lambda: tables_of(walker, duration))
