"""The gradient of one number of a run."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from tarsus.files.library import SceneLike
from tarsus.solve.engine import Accuracy
from tarsus.solve.gradients import Gradient
from tarsus.solve.simulate import simulate

__all__ = ["gradient"]


def gradient(
    objective: str | Callable[[NDArray[np.void]], float],
    scene: SceneLike,
    wrt: Sequence[str],
    duration: float | str | None = None,
    accuracy: Accuracy | None = None,
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

    Returns
    -------
    Gradient
        The number [its unit] and its derivative by each path [its unit over that of the path].

    Raises
    ------
    InputError
        As `simulate` and `GradientRun.gradient` do.
    """
    run = simulate(scene, duration, accuracy, gradients=wrt)
    return run.gradient(objective) if isinstance(objective, str) else run.gradient_of(objective)
