"""How a scene gets to its engine, each stage once: described, lowered to a plan and its rows, run; what runs share."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tarsus.base.spec import get_value, with_values
from tarsus.core import _native
from tarsus.core.modes import ModeBook
from tarsus.measure import scene_period
from tarsus.model.drive.law import VoltageLaw
from tarsus.model.drive.lower import lower
from tarsus.model.drive.pieces import Pieces
from tarsus.model.drive.signal import Signal
from tarsus.model.scene import Scene
from tarsus.plan.lowering import Plan, lower_scene
from tarsus.plan.slots import Floats, Rows, rows_for, rows_of, slot
from tarsus.solve.acting import Acting
from tarsus.solve.engine import (
    Accuracy,
    Log,
    book_of,
    execute,
    row_bytes,
    step_lengths,
    structure_key,
    tables_of,
    walk,
)
from tarsus.solve.motion import Marched, Motion, Replayed

__all__ = ["RECORDED", "Engine", "Shared", "motion_of", "prepared"]

RECORDED = Accuracy(gap=1e-10)
"""Accuracy of a single run: a hundred times finer than a batch's, so that its energy ledger closes to 1e-8 of the
largest term through stiff films as well. It costs about half as many steps again."""

MEMORY = 2**30
"""Bytes of recorded steps that a run keeps at most, unless its accuracy asks for a number of steps."""

MOST_KEPT = 32
"""So many tables of structures and drives are kept for later runs."""


class Shared:
    """What engines have made that others can use, by what it depends on: tables of structures, drives; those last used.

    resident: a scene that is run again and again, whose plans are kept as well. Safe between threads.
    """

    def __init__(self, resident: Scene | None = None, most: int = MOST_KEPT) -> None:
        self.resident = resident
        self._most = most
        self._made: OrderedDict[Any, Any] = OrderedDict()
        self._lock = threading.Lock()

    def __reduce__(self) -> tuple[Any, ...]:
        """In another process everything is made again."""
        return Shared, (self.resident, self._most)

    @property
    def keys(self) -> list[Any]:
        """What is kept, by what it depends on; the last one used comes last."""
        with self._lock:
            return list(self._made)

    def drive(self, signal: Signal, law: VoltageLaw, history: tuple[float, ...]) -> tuple[Pieces, Pieces]:
        """Pieces of a drive, lowered once."""
        return self.get((signal, law, history), lambda: lower(signal, law, history))

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


@dataclass(frozen=True)
class ByModes:
    """Runs by contact modes, which are made once for all runs of a structure."""

    plan: Plan
    duration: float
    book: ModeBook

    def run(self, rows: Rows, accuracy: Accuracy | None, track: bool) -> Log:
        """All rows of the plan's data."""
        return execute(self.plan, self.duration, rows=rows, book=self.book, accuracy=accuracy, track=track)

    def keep(self, acting: Acting, accuracy: Accuracy | None, track: bool) -> Replayed:
        """The one row that laws act on, with its motion and its energy account."""
        accuracy = accuracy or replace(RECORDED, steps=min(RECORDED.steps, MEMORY // row_bytes(self.plan)))
        raw = execute(
            self.plan,
            self.duration,
            rows=acting.rows,
            book=self.book,
            accuracy=accuracy,
            track=track,
            record=True,
        )
        return Replayed(acting, raw)


@dataclass(frozen=True)
class ByLegs:
    """Runs of walkers, which share the step tables of their legs."""

    plan: Plan
    duration: float
    tables: _native.LegTables

    def run(self, rows: Rows, accuracy: Accuracy | None, track: bool) -> Log:
        return walk(self.plan, self.duration, rows=rows, tables=self.tables, accuracy=accuracy, track=track)

    def keep(self, acting: Acting, accuracy: Accuracy | None, track: bool) -> Marched:
        chosen = accuracy or RECORDED
        raw = walk(
            self.plan,
            self.duration,
            rows=acting.rows,
            tables=self.tables,
            accuracy=chosen,
            track=track,
            account=True,
        )
        return Marched(acting, raw, self.duration, chosen, track)


Engine = ByModes | ByLegs
"""Runs one plan for rows of its data."""


def motion_of(
    scene: Scene,
    values: Mapping[str, Any],
    duration: float,
    accuracy: Accuracy | None,
    shared: Shared,
    *,
    track: bool = True,
) -> Motion:
    """One run of a scene that has some values instead of its own, with its motion and its energy account.

    Raises
    ------
    InputError
        As `tarsus.with_values` and `prepared` do.
    """
    changed = with_values(scene, values) if values else scene
    given = {path: get_value(changed, path) for path in values}
    data = {path for path, one in given.items() if isinstance(one, float) and slot(scene, path) is not None}
    rest = {path: one for path, one in values.items() if path not in data}
    variant = with_values(scene, rest) if rest else scene
    engine, rows = prepared(
        variant, {path: np.array([given[path]]) for path in values if path in data}, duration, shared
    )
    return engine.keep(Acting(engine.plan, rows), accuracy, track)


def prepared(
    scene: Scene, values: Mapping[str, Floats], duration: float, shared: Shared, count: int = 1
) -> tuple[Engine, Rows]:
    """The engine for runs of a scene over ``duration`` [s], and the rows of runs that differ in slots.

    values (nr,) by path: each of a slot and within its bounds; without any there are ``count`` runs of the scene as it
    is. shared: what earlier engines have made; what this one makes is added.

    Raises
    ------
    InputError
        Where a law of the user cannot be compiled, and as `tarsus.plan.slots.rows_for` does.
    """
    if scene is shared.resident:
        engine = shared.get(("resident", duration), lambda: _engine(scene, duration, shared))
    else:
        engine = _engine(scene, duration, shared)
    if values:
        return engine, rows_for(scene, engine.plan, values, duration)
    return engine, rows_of(engine.plan, count, scene_period(scene, duration))


def _engine(scene: Scene, duration: float, shared: Shared) -> Engine:
    """The scene lowered, and what the engine makes for its structure."""
    plan = lower_scene(scene, shared.drive)
    if plan.legs is not None:
        key = (float(step_lengths(duration)[0]), plan.legs.blocks.tobytes())
        return ByLegs(plan, duration, shared.get(key, lambda: tables_of(plan, duration)))
    key = structure_key(plan, duration)
    return ByModes(plan, duration, shared.get(key, lambda: book_of(plan, duration)))
