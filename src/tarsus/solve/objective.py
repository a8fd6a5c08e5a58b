"""The gradient of one number of a run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.solve.codes import structured_events
from tarsus.solve.directional import STEPS, directional_slopes
from tarsus.solve.engine import Accuracy
from tarsus.solve.gradients import Gradient
from tarsus.solve.run import increasing
from tarsus.solve.simulate import simulate

if TYPE_CHECKING:
    from tarsus.files.library import SceneLike

Floats = NDArray[np.float64]
NumberOf = Callable[..., float]
"""A function of the events with the period marks, or of these and of states at given times (`SampledStates`)."""
STATES = ("x", "v", "gap", "rate", "resistive", "smooth", "pull")
"""Fields of states in the order in which the engine's derivatives have them."""


def gradient(
    objective: str | NumberOf,
    scene: SceneLike,
    wrt: Sequence[str],
    duration: float | str | None = None,
    accuracy: Accuracy | None = None,
    *,
    times: ArrayLike | None = None,
) -> Gradient:
    """Exact first derivatives of one number of a run by numbers of its scene.

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
        The derivative by each path [unit of the number over that of the path], with flags where there is none.

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
    states, moved = run.states(when), run.state_gradients(when)

    def values(rows: Floats, periods: Floats, along: Floats) -> Floats:
        out = []
        for n, one in enumerate(rows):
            by = moved[run.paths[n // len(STEPS)]]
            there = {name: getattr(states, name) + along.ravel()[n] * getattr(by, name) for name in STATES}
            out.append(
                float(objective(structured_events(np.ascontiguousarray(one)), replace(states, **there)))
            )
        return np.array(out)

    return run.gradient_along(lambda log: directional_slopes(log, values))
