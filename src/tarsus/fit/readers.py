"""How numbers are read of a run, with their derivatives by numbers of its scene."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.base.errors import InputError
from tarsus.solve.gradients import Gradient, GradientRun
from tarsus.solve.run import Run

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class ReadSlopes:
    """Derivatives (k, nu) of k numbers of a run by the unknowns, NaN where there is none; flags: sentences that say
    why, by unknown."""

    slopes: Floats
    flags: Mapping[str, tuple[str, ...]]

    @classmethod
    def of(cls, gradient: Gradient) -> ReadSlopes:
        """Of one number."""
        return cls(np.array([list(gradient.values())]), gradient.flags)


@dataclass(frozen=True)
class OfMeasure:
    """A measure by name."""

    name: str
    count: int = 1

    def numbers(self, run: Run) -> Floats:
        """Numbers (k,) of a run."""
        return np.array([run.measures[self.name].value])

    def slopes(self, run: GradientRun) -> ReadSlopes:
        """Their derivatives."""
        return ReadSlopes.of(run.gradient(self.name))


@dataclass(frozen=True)
class OfEvents:
    """A function of the events, the period marks among them."""

    function: Callable[[NDArray[np.void]], float]
    count: int = 1

    def numbers(self, run: Run) -> Floats:
        """Numbers (k,) of a run."""
        return np.array([float(self.function(run.all_events))])

    def slopes(self, run: GradientRun) -> ReadSlopes:
        """Their derivatives."""
        return ReadSlopes.of(run.gradient_of(self.function))


@dataclass(frozen=True)
class OfStates:
    """Gap [m] of foot number ``foot``, or its rate [m/s], at times (k,) [s]."""

    foot: int
    times: Floats
    rate: bool

    @property
    def count(self) -> int:
        """Number of samples."""
        return len(self.times)

    def numbers(self, run: Run) -> Floats:
        """Numbers (k,) of a run."""
        states = run.states(self.times)
        return np.asarray((states.rate if self.rate else states.gap)[self.foot])

    def slopes(self, run: GradientRun) -> ReadSlopes:
        """Their derivatives."""
        found = run.state_gradients(self.times)
        rows = [(one.rate if self.rate else one.gap)[self.foot] for one in found.values()]
        return ReadSlopes(np.array(rows).reshape(len(run.paths), self.count).T, run.flags)


@dataclass(frozen=True)
class OfFunction:
    """What a function makes of a run, which has no derivatives."""

    function: Callable[[Run], ArrayLike]
    count: int

    def numbers(self, run: Run) -> Floats:
        """Numbers (k,) of a run. Raises InputError where there are not as many."""
        found = made(self.function, run)
        if len(found) != self.count:
            raise InputError("residuals: expected as many numbers of every run")
        return found

    def slopes(self, run: GradientRun) -> ReadSlopes:
        """None."""
        return ReadSlopes(np.full((self.count, len(run.paths)), np.nan), {})


def made(function: Callable[[Run], ArrayLike], run: Run) -> Floats:
    """Numbers (k,) that a function makes of a run."""
    return np.atleast_1d(np.asarray(function(run), dtype=float))


Reader = OfMeasure | OfEvents | OfStates | OfFunction
