"""One run of a fit: what its scene has for a set of unknowns, and derivatives of what is read of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.fit.readers import Reader, ReadSlopes
from tarsus.model.scene import Scene
from tarsus.solve import Accuracy, Shared, simulate

if TYPE_CHECKING:
    from tarsus.solve import GradientRun

Values = Callable[[Floats], Mapping[str, float]]
"""Numbers of the scene by path, of SI values (nu,) of the unknowns."""

STEP = 1e-4
"""Step of the differences of a scene's numbers by an unknown, in parts of its bounds: of arithmetic, not of runs; the
stencil of fourth order leaves 1e-16 of what is smooth over the bounds, and 1e-12 of rounding."""
_PLACES, _WEIGHTS = np.array([-2.0, -1.0, 1.0, 2.0]), np.array([1.0, -8.0, 8.0, -1.0]) / 12.0


def directions(values: Values, at: Floats, span: Floats) -> dict[str, dict[str, float]]:
    """How much each number of a scene moves with each of the unknowns at SI values (nu,), by the unknown's number and
    by path; span (nu,): width of the unknowns' bounds. A number that jumps or bends within `STEP` of there has the
    slope of its secant."""
    out = {}
    for i, unit in enumerate(np.eye(len(at))):
        four = [values(at + place * STEP * span * unit) for place in _PLACES]
        moved = {path: np.array([one[path] for one in four]) for path in four[0]}
        out[str(i)] = {
            path: float(_WEIGHTS @ column) / (STEP * span[i]) for path, column in moved.items() if np.ptp(column) > 0.0
        }
    return out


@dataclass(frozen=True)
class Case:
    """One run: a scene, what it has for the unknowns' SI values, over how long [s] and how exactly; refused: sentences
    on runs of which the engine had no derivatives."""

    scene: Scene
    values: Values
    seconds: float
    accuracy: Accuracy | None
    shared: Shared
    refused: list[str] = field(default_factory=list)

    def run(self, at: Floats, span: Floats) -> GradientRun | None:
        """The run at SI values (nu,), with derivatives by all unknowns; None where the engine has none of this
        scene, with the reasons in `refused`."""
        scene = with_values(self.scene, dict(self.values(at)))
        moved = directions(self.values, at, span)
        try:
            return simulate(scene, self.seconds, self.accuracy, shared=self.shared, gradients=moved)
        except InputError as error:
            self.refused.extend(error.problems)
            return None

    def slopes(self, at: Floats, span: Floats, readers: Sequence[Reader]) -> list[ReadSlopes] | None:
        """Derivatives of what is read at SI values (nu,); None where the engine has none of this scene."""
        run = self.run(at, span)
        return None if run is None else [one.slopes(run) for one in readers]
