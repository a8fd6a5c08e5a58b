"""One run of one scene."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import replace
from typing import overload

from tarsus.base.errors import InputError
from tarsus.measure import scene_period
from tarsus.model.scene import Scene
from tarsus.model.structure.walker import Walker
from tarsus.plan.lowering import lower_scene
from tarsus.solve.engine import Accuracy, SharedBook, execute, row_bytes
from tarsus.solve.engines import Shared, shared_book
from tarsus.solve.gradients import GradientRun
from tarsus.solve.run import Run
from tarsus.solve.tangents import entering
from tarsus.solve.walkrun import run_walker
from tarsus.solve.window import record

RECORDED = Accuracy(gap=1e-10)
"""Accuracy of a single run: a hundred times finer than a batch's, so that its energy ledger closes to 1e-8 of the
largest term through stiff films as well. It costs about half as many steps again."""

MEMORY = 2**30
"""Bytes of recorded steps that a run keeps at most, unless its accuracy asks for a number of steps."""


@overload
def simulate(
    scene: Scene,
    duration: float | None = None,
    accuracy: Accuracy | None = None,
    *,
    shared: Shared | None = None,
    gradients: None = None,
) -> Run: ...
@overload
def simulate(
    scene: Scene,
    duration: float | None = None,
    accuracy: Accuracy | None = None,
    *,
    shared: Shared | None = None,
    gradients: Sequence[str],
) -> GradientRun: ...
def simulate(
    scene: Scene,
    duration: float | None = None,
    accuracy: Accuracy | None = None,
    *,
    shared: Shared | None = None,
    gradients: Sequence[str] | None = None,
) -> Run:
    """Simulate a scene exactly from event to event: a walker by the walking engine, everything else by contact modes.

    Parameters
    ----------
    scene
        What to simulate; a user's laws are part of its ground (``ground.laws``).
    duration
        How long [s]; the scene's own duration by default.
    accuracy
        Tolerances and the bound on steps; by default `RECORDED`, with as many steps as fit into `MEMORY`.
    shared
        What the engine makes for a structure, kept from one run to the next where both are given the same one; see
        `tarsus.Session`.
    gradients
        Paths of numbers of the scene: the run is a `GradientRun` then, which has exact first derivatives by them.

    Raises
    ------
    InputError
        For a duration that is not positive, a user's law that cannot be compiled, and paths by which there is no
        derivative; a walker's run has none yet.

    The run always ends, with a `ResultCode` that is a sentence.
    """
    seconds = scene.duration if duration is None else float(duration)
    check_duration(seconds)
    if isinstance(scene.robot.structure, Walker):
        if gradients is not None:
            raise InputError("gradients: the walking engine has no derivatives yet")
        return run_walker(scene, seconds, accuracy or RECORDED, shared)
    plan = lower_scene(scene)
    book = None if shared is None else shared_book(plan, seconds, shared)
    period = scene_period(scene, seconds)
    start = time.perf_counter()
    if accuracy is None:
        accuracy = replace(RECORDED, steps=min(RECORDED.steps, MEMORY // row_bytes(plan)))
    if gradients is not None:
        given = entering(scene, plan, gradients, seconds)
        given.row.scales[:, 2] = period
        made = record(plan, book or SharedBook(plan, seconds), seconds, given.row, accuracy)
        spent = time.perf_counter() - start
        return GradientRun(scene, plan, made.raw, seconds, period, spent, made.notes, given.paths, accuracy)
    raw = execute(plan, seconds, book=book, accuracy=accuracy, period=period, record=True)
    return Run(scene, plan, raw, seconds, period, time.perf_counter() - start)


def check_duration(seconds: float) -> None:
    """Raise InputError unless a duration [s] is positive and finite."""
    if not (math.isfinite(seconds) and seconds > 0.0):
        raise InputError([f"duration: expected a time above 0 s, got {seconds:g} s"])
