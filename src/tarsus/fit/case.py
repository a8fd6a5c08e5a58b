"""One run of a fit: what its scene has for a set of unknowns, and derivatives of what is read of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.fit.readers import Reader, Told
from tarsus.model.scene import Scene
from tarsus.solve import Accuracy, GradientRun, simulate
from tarsus.solve.engines import Shared

__all__ = ["Case", "Slopes", "chain"]

Floats = NDArray[np.float64]
Values = Callable[[Floats], Mapping[str, float]]
"""Numbers of the scene by path, of SI values (nu,) of the unknowns."""

STEP = 1e-4
"""Step of the differences of a scene's numbers by an unknown, in parts of its bounds: of arithmetic, not of runs; the
stencil of fourth order leaves 1e-16 of what is smooth over the bounds, and 1e-12 of rounding."""
_PLACES, _WEIGHTS = np.array([-2.0, -1.0, 1.0, 2.0]), np.array([1.0, -8.0, 8.0, -1.0]) / 12.0


@dataclass(frozen=True)
class Slopes:
    """Derivatives (k, nu) of what is read of a run by the SI values of the unknowns, NaN where there is none; flags:
    sentences that say why."""

    by_unknown: Floats
    flags: tuple[str, ...] = ()


def chain(values: Values, at: Floats, span: Floats) -> tuple[tuple[str, ...], Floats]:
    """Paths (np) of a scene that depend on the unknowns at SI values (nu,), and their derivatives (np, nu); span (nu,):
    width of the unknowns' bounds. A number that jumps or bends within `STEP` of there has the slope of its secant."""
    beside = [[values(at + place * STEP * span * unit) for place in _PLACES] for unit in np.eye(len(at))]
    moving = [path for path in values(at) if any(len({one[path] for one in four}) > 1 for four in beside)]
    there = np.array([[[one[path] for one in four] for four in beside] for path in moving])
    return tuple(moving), there.reshape(len(moving), len(at), len(_PLACES)) @ _WEIGHTS / (STEP * span)


@dataclass(frozen=True)
class Case:
    """One run: a scene, what it has for the unknowns' SI values, over how long [s] and how exactly."""

    scene: Scene
    values: Values
    seconds: float
    accuracy: Accuracy | None
    shared: Shared

    def run(self, at: Floats, paths: Sequence[str]) -> GradientRun | None:
        """The run at SI values (nu,), with derivatives by paths; None where the engine has none of this scene."""
        scene = with_values(self.scene, dict(self.values(at)))
        try:
            return simulate(scene, self.seconds, self.accuracy, shared=self.shared, gradients=paths)
        except InputError:
            return None

    def slopes(self, at: Floats, span: Floats, readers: Sequence[Reader]) -> list[Slopes] | None:
        """Derivatives of what is read at SI values (nu,); None where the engine has none of this scene."""
        paths, links = chain(self.values, at, span)
        run = self.run(at, paths) if paths else None
        if run is None:
            return None if paths else [Slopes(np.zeros((one.count, len(at)))) for one in readers]
        return [_by_unknown(one.slopes(run), paths, links) for one in readers]


def _by_unknown(told: Told, paths: Sequence[str], links: Floats) -> Slopes:
    """Derivatives by the unknowns of those by paths: a missing one takes with it the unknowns that move its path."""
    missing = np.isnan(told.slopes).astype(float) @ (links != 0.0) > 0.0
    found = np.where(missing, np.nan, np.nan_to_num(told.slopes) @ links)
    texts = dict.fromkeys(text for path in paths for text in told.flags.get(path, ()))
    return Slopes(found, tuple(texts) if missing.any() else ())
