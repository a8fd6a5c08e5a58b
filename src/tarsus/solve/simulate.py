"""One run of one scene."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, overload

from tarsus.base.errors import InputError
from tarsus.base.units import parse_quantity
from tarsus.files.library import SceneLike, as_scene
from tarsus.model.scene import Scene
from tarsus.solve.engine import Accuracy
from tarsus.solve.engines import RECORDED, Shared, motion_of
from tarsus.solve.run import Run

if TYPE_CHECKING:
    from tarsus.solve.gradients import GradientRun

__all__ = ["RECORDED", "changed_run", "seconds_of", "simulate"]


@overload
def simulate(
    scene: SceneLike,
    duration: float | str | None = None,
    accuracy: Accuracy | None = None,
    *,
    shared: Shared | None = None,
    gradients: None = None,
) -> Run: ...
@overload
def simulate(
    scene: SceneLike,
    duration: float | str | None = None,
    accuracy: Accuracy | None = None,
    *,
    shared: Shared | None = None,
    gradients: Sequence[str] | Mapping[str, Mapping[str, float]],
) -> GradientRun: ...
def simulate(
    scene: SceneLike,
    duration: float | str | None = None,
    accuracy: Accuracy | None = None,
    *,
    shared: Shared | None = None,
    gradients: Sequence[str] | Mapping[str, Mapping[str, float]] | None = None,
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
        Tolerances and the bound on steps; by default `RECORDED`, with as many steps as memory is given for them.
    shared
        What the engine makes for a structure, kept from one run to the next where both are given the same one; see
        `tarsus.Session`.
    gradients
        Paths of numbers of the scene: the run is a `GradientRun` then, which has exact first derivatives by them. Or
        directions by name: how much each of some numbers moves, by path, where several follow from one.

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
    >>> run = ts.simulate(ts.load_scene("cantilever", volts=8, hz=50, wave="square"), "100 ms")
    >>> run.ok, run.ledger.closure < 1e-8
    (True, True)
    >>> peak = run.measures["peak"]
    >>> 1e-4 < peak.value < 3e-4, peak.unit
    (True, 'm')
    >>> run.states([0.0, 0.05]).gap.shape  # feet, times
    (1, 2)
    """
    scene = as_scene(scene)
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


def seconds_of(scene: Scene, duration: float | str | None) -> float:
    """The duration [s] given, or the scene's own. Raises InputError unless it is positive and finite."""
    try:
        given = scene.duration if duration is None else duration
        seconds = parse_quantity(given, "s") if isinstance(given, str) else float(given)
    except InputError as error:
        raise InputError([f"duration: {said}" for said in error.problems]) from None
    if not (math.isfinite(seconds) and seconds > 0.0):
        raise InputError([f"duration: expected a time above 0 s, got {seconds:g} s"])
    return seconds
