"""What a fit asks of runs: readings and samples that were measured, goals, and limits."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.solve.run import Run

Number = str | Callable[[NDArray[np.void]], float]
"""A number of a run: a measure by name, or a function of its events with the period marks
(`tarsus.solve.GradientRun.gradient_of`), smooth in their numbers."""
Value = float | str
"""SI, or a text with a unit; of a function of the events always SI."""
Under = Mapping[str, Value]
"""What differs from the scene in the run that is meant, by path."""


@dataclass(frozen=True)
class Reading:
    """A number that was measured, with one standard deviation: residual (number - value) / error."""

    of: Number
    value: Value
    error: Value
    under: Under = field(default_factory=dict)


@dataclass(frozen=True)
class Samples:
    """A record of a foot's gap [m], or of its rate [m/s]: values (nt,) at times (nt,) [s] in order, with one standard
    deviation; nt residuals (gap - value) / error."""

    foot: str
    times: ArrayLike
    values: ArrayLike
    error: Value
    rate: bool = False
    under: Under = field(default_factory=dict)


@dataclass(frozen=True)
class Goal:
    """A number that shall be small, in units of ``scale``; large where that is negative."""

    of: Number
    scale: Value
    under: Under = field(default_factory=dict)


@dataclass(frozen=True)
class Limit:
    """A number that stays between bounds; beyond them it costs as a residual of (excess / softness)."""

    of: Number
    softness: Value
    low: Value | None = None
    high: Value | None = None
    under: Under = field(default_factory=dict)


@dataclass(frozen=True)
class OfRun:
    """Residuals (k,) that a function makes of a `Run`, in units of their errors: as many of every run. They have no
    exact derivatives."""

    function: Callable[[Run], ArrayLike]
    under: Under = field(default_factory=dict)


Term = Reading | Samples | Goal | Limit | OfRun
