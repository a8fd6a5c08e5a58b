"""The gradient of one number of a run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from tarsus.solve.engine import Accuracy
from tarsus.solve.gradients import Gradient
from tarsus.solve.run import increasing
from tarsus.solve.simulate import simulate

if TYPE_CHECKING:
    from tarsus.files.library import SceneLike

NumberOf = Callable[..., float]
"""A function of the events with the period marks, or of these and of states at given times (`SampledStates`)."""


def gradient(
    objective: str | NumberOf,
    scene: SceneLike,
    wrt: Sequence[str],
    duration: float | str | None = None,
    accuracy: Accuracy | None = None,
    *,
    times: ArrayLike | None = None,
) -> Gradient:
    """First derivatives of one number of a run by numbers of its scene, each with what it may be off by.

    Parameters
    ----------
    objective
        Name of a measure or of a term of the ledger, as `GradientRun.gradient` takes it, or a function of the events
        (ne,) with the period marks, smooth in their numbers.
    scene
        The scene, or a device's name or a scene file's path.
    wrt
        Paths of its numbers.
    duration, accuracy
        As for `simulate`.
    times
        Times [s] (nt,), increasing: the function is one of the events and of the states then (`SampledStates`).

    Returns
    -------
    Gradient
        The derivative by each path [unit of the number over that of the path], with its error, and flags where there
        is none.

    Raises
    ------
    InputError
        As `simulate` and `GradientRun.gradient` do.
    """
    run = simulate(scene, duration, accuracy, gradients=wrt)
    if isinstance(objective, str):
        return run.gradient(objective)
    if times is None:
        return run.gradient_of(objective)
    when = increasing(times)
    return run.gradient_of_runs(lambda one: objective(one.all_events, one.states(when)))
