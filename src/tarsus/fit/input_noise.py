"""Inputs that were measured with noise: how far the numbers of a fit move with what a recorded signal may have been."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.spec import get_value, with_values
from tarsus.base.units import parse_quantity
from tarsus.model.drive.waveforms import Sampled
from tarsus.model.scene import Scene

if TYPE_CHECKING:
    from tarsus.fit.problem import Problem

DRAWS = 32
"""Signals that are drawn: their scatter is then known to an eighth, as that of a standard error need not be better."""


Inputs = Mapping[str, tuple[Sampled, float]]
"""Recorded signals of a scene by path, each with the standard deviation of its samples [unit of the signal]."""


def recorded_inputs(scene: Scene, noise: Mapping[str, float | str]) -> Inputs:
    """The signals that have noise, of their standard deviations by path, such as ``{"signals.pad": "20 mV"}``.

    Raises InputError where a path is that of no sampled signal, and for deviations that are none of its unit.
    """
    found: dict[str, tuple[Sampled, float]] = {}
    problems: list[str] = []
    for path, size in noise.items():
        try:
            signal = get_value(scene, path)
            if not isinstance(signal, Sampled):
                raise InputError(f"{path} is no sampled signal, whose samples could have noise")
            found[path] = signal, parse_quantity(size, signal.measured.unit)
            if found[path][1] < 0.0:
                raise InputError(f"{path}: expected a standard deviation of 0 or more")
        except InputError as error:
            problems += [f"noise: {problem}" for problem in error.problems]
    if problems:
        raise InputError(problems)
    return found


def input_errors(problem: Problem, x: Floats, inputs: Inputs, seed: int) -> Floats:
    """Standard errors (nu,) in the cube that the noise of recorded signals makes, at a point x (nu,) that was found.

    Every sample of a signal is drawn anew about its own value, and the numbers follow by one Gauss-Newton step.
    """
    random = np.random.default_rng(seed)
    jacobian, base = problem.jacobian(x), problem.residuals(x)
    step = -np.linalg.pinv(jacobian)
    moves = []
    for _ in range(DRAWS):
        changes = {path: _drawn(signal, size, random) for path, (signal, size) in inputs.items()}
        moves.append(step @ (problem.on(with_values(problem.scene, changes)).residuals(x) - base))
    return np.std(moves, axis=0)


def _drawn(signal: Sampled, size: float, random: np.random.Generator) -> Sampled:
    """The signal with other samples within its noise."""
    times, levels = signal.samples()
    drawn = levels + size * random.standard_normal(len(levels))
    return type(signal)(times=tuple(times), levels=tuple(drawn), interpolation=signal.interpolation)
