"""How numbers are read of a run, with their derivatives by numbers of its scene."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats

if TYPE_CHECKING:
    from tarsus.solve import Gradient, GradientRun, Run


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
    """A measure by name, whose value batches have."""

    name: str
    count: int = 1

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


Reader = OfMeasure | OfEvents | OfStates
