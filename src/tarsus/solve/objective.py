"""The gradient of one number of a run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from os import PathLike

import numpy as np
from numpy.typing import NDArray

from tarsus.model.scene import Scene
from tarsus.solve.engine import Accuracy
from tarsus.solve.gradients import Gradient
from tarsus.solve.simulate import simulate

__all__ = ["gradient"]


def gradient(
    objective: str | Callable[[NDArray[np.void]], float],
    scene: Scene | str | PathLike[str],
    wrt: Sequence[str],
    duration: float | str | None = None,
    accuracy: Accuracy | None = None,
) -> Gradient:
    """Exact first derivatives of one number of a run by numbers of its scene.

    Parameters
    ----------
    objective
        Name of a measure or of a term of the ledger, as `GradientRun.gradient` takes it, or a function of the events
        with the period marks, smooth in their numbers.
    scene
        The scene.
    wrt
        Paths of its numbers.
    duration, accuracy
        As for `simulate`.

    Raises
    ------
    InputError
        As `simulate` and `GradientRun.gradient` do.
    """
    run = simulate(scene, duration, accuracy, gradients=wrt)
    return run.gradient(objective) if isinstance(objective, str) else run.gradient_of(objective)
