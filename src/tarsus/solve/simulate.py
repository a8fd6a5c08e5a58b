"""The way of a scene to its run, each stage once: lowered to a plan and its rows, run; and what runs share."""

from __future__ import annotations

import math
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.spec import by_path, get_value, with_values
from tarsus.base.units import parse_quantity
from tarsus.files.library import SceneLike, as_scene
from tarsus.model.drive.lower import lower
from tarsus.plan.lowering import lower_scene
from tarsus.plan.slots import Courses, Floats, Rows, rows_for, slot
from tarsus.solve.acting import Acting
from tarsus.solve.engine import RECORDED, Accuracy, Engine
from tarsus.solve.motion import RunMotion
from tarsus.solve.run import Run

if TYPE_CHECKING:
    from tarsus.model.drive.law import VoltageLaw
    from tarsus.model.drive.pieces import Pieces
    from tarsus.model.drive.signal import Signal
    from tarsus.model.scene import Scene
    from tarsus.solve.gradients import GradientRun

__all__ = ["RECORDED", "Shared", "changed_run", "motion_of", "prepared", "seconds_of", "simulate"]

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


@overload
def simulate(
    scene: SceneLike,
    duration: float | str | None = None,
    accuracy: Accuracy | None = None,
    *,
    shared: Shared | None = None,
    gradients: None = None,
    **values: Any,
) -> Run: ...
@overload
def simulate(
    scene: SceneLike,
    duration: float | str | None = None,
    accuracy: Accuracy | None = None,
    *,
    shared: Shared | None = None,
    gradients: Sequence[str] | Mapping[str, Mapping[str, float]],
    **values: Any,
) -> GradientRun: ...
def simulate(
    scene: SceneLike,
    duration: float | str | None = None,
    accuracy: Accuracy | None = None,
    *,
    shared: Shared | None = None,
    gradients: Sequence[str] | Mapping[str, Mapping[str, float]] | None = None,
    **values: Any,
) -> Run:
    """Simulate a scene exactly from event to event: a walker by the walking engine, everything else by contact modes.

    Parameters
    ----------
    scene
        What to simulate, or a device's name or a scene file's path; a user's laws are part of its ground
        (``ground.laws``).
    duration
        How long [s], or a text with a unit (``"50 ms"``); the scene's own duration by default.
    accuracy
        Tolerances and the bound on steps; by default `RECORDED`.
    shared
        What the engine makes for a structure, kept from one run to the next where both are given the same one; see
        `tarsus.Session`.
    gradients
        Paths of numbers of the scene: the run is a `GradientRun` then, which has first derivatives by them, each
        with its error. Or
        directions by name: how much each of some numbers moves, by path, where several follow from one.
    **values
        What is changed in the scene before, as `load_scene` takes it: ``volts=6, hz=100``, or values by path.

    Returns
    -------
    Run
        Events, measures, ledger, states at any time [SI], and how it ended (`Run.code`); a `GradientRun` with
        ``gradients``.

    Raises
    ------
    InputError
        For an unknown device, a duration that is not positive, a user's law that cannot be compiled, and paths by
        which there is no derivative.

    The run always ends, with a `ResultCode` that is a sentence.

    Examples
    --------
    >>> import tarsus as ts
    >>> run = ts.simulate("cantilever", "100 ms", volts=8, hz=50, wave="square")
    >>> run.ok, run.ledger.closure < 1e-8
    (True, True)
    >>> peak = run.measures["peak"]
    >>> 1e-4 < peak.value < 3e-4, peak.unit
    (True, 'm')
    >>> run.states([0.0, 0.05]).gap.shape  # feet, times
    (1, 2)
    """
    scene = as_scene(scene, **values)
    seconds, shared = seconds_of(scene, duration), shared or Shared()
    if gradients is not None:
        from tarsus.solve.gradients import gradient_run

        return gradient_run(scene, gradients, seconds, accuracy, shared)
    return changed_run(scene, {}, seconds, accuracy, shared)


def changed_run(
    scene: Scene, values: Mapping[str, Any], seconds: float, accuracy: Accuracy | None, shared: Shared
) -> Run:
    """A run of a scene with values in place of its own, by path. Raises InputError as `simulate` and `with_values`."""
    start = time.perf_counter()
    motion = motion_of(scene, values, seconds, accuracy, shared)
    period = float(motion.acting.rows.periods[0])
    wall = time.perf_counter() - start
    return Run(scene, seconds, period, motion.log, values, accuracy, kept=motion, wall_s=wall)


def motion_of(
    scene: Scene,
    values: Mapping[str, Any],
    duration: float,
    accuracy: Accuracy | None,
    shared: Shared,
    *,
    track: bool = True,
) -> RunMotion:
    """One run of a scene that has some values instead of its own, with its motion and its energy account.

    Raises
    ------
    InputError
        As `tarsus.with_values` and `prepared` do.
    """
    values = by_path(scene, values)
    whole = with_values(scene, values) if values else scene
    given = {path: get_value(whole, path) for path in values}
    data = {path for path, one in given.items() if isinstance(one, float) and slot(scene, path) is not None}
    rest = {path: one for path, one in values.items() if path not in data}
    variant = with_values(scene, rest) if rest else scene
    engine, rows = prepared(
        variant, {path: np.array([given[path]]) for path in values if path in data}, duration, shared
    )
    return RunMotion(Acting(engine.plan, rows), engine, accuracy or RECORDED, track)


def prepared(
    scene: Scene,
    values: Mapping[str, Floats],
    duration: float,
    shared: Shared,
    count: int = 1,
    courses: Courses | None = None,
) -> tuple[Engine, Rows]:
    """The engine for runs of a scene over ``duration`` [s], and the rows of runs that differ in slots.

    values (nr,) by path: each of a slot and within its bounds; without any there are ``count`` runs of the scene as it
    is. shared: what earlier engines have made; what this one makes is added. courses: as `tarsus.plan.slots.rows_for`
    takes them.

    Raises
    ------
    InputError
        Where a law of the user cannot be compiled, and as `tarsus.plan.slots.rows_for` does.
    """

    def made() -> Engine:
        return Engine(lower_scene(scene, shared.drive), duration, shared)

    engine = shared.get(("resident", duration), made) if scene is shared.resident else made()
    return engine, rows_for(scene, engine.plan, values, duration, count=count, courses=courses)


def seconds_of(scene: Scene, duration: float | str | None) -> float:
    """The duration [s] given, or the scene's own. Raises InputError unless it is positive and finite."""
    if not isinstance(duration, int | float | str | np.number | None):
        said = f"duration: expected a time [s] or a text with a unit, got {duration!r:.60}"
        raise InputError([f"{said}; values of the scene are named, as in volts=6"])
    try:
        given = scene.duration if duration is None else duration
        seconds = parse_quantity(given, "s") if isinstance(given, str) else float(given)
    except InputError as error:
        raise InputError([f"duration: {said}" for said in error.problems]) from None
    if not (math.isfinite(seconds) and seconds > 0.0):
        raise InputError([f"duration: expected a time above 0 s, got {seconds:g} s"])
    return seconds
