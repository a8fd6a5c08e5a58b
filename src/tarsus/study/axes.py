"""What varies in a sweep: lists and ranges of values, crossed as a grid or drawn as a Sobol sequence."""

from __future__ import annotations

import math
import threading
from collections.abc import Mapping
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, field_validator

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.messages import PathErrors
from tarsus.base.spec import Description


class SweepAxis(Description):
    """What one number of a sweep runs through, SI."""

    paths: tuple[str, ...] = Field(
        default=(), description="paths that take this value together; the axis's own name when absent"
    )

    @property
    def size(self) -> int | None:
        """Number of values on a grid; None where a range does not say."""
        raise NotImplementedError

    @property
    def ends(self) -> tuple[float, float]:
        """Smallest and largest value."""
        raise NotImplementedError

    def values_on_grid(self) -> Floats:
        """Values (size,) on a grid."""
        raise NotImplementedError

    def at(self, share: Floats) -> Floats:
        """Values (nr,) at shares (nr,) of the axis, from 0 to below 1."""
        raise NotImplementedError


class Values(SweepAxis):
    """The values of a list, in its order; drawn with equal chance."""

    kind: Literal["list"] = "list"
    values: tuple[float, ...] = Field(min_length=1, description="the values")

    @property
    def size(self) -> int:
        return len(self.values)

    @property
    def ends(self) -> tuple[float, float]:
        return min(self.values), max(self.values)

    def values_on_grid(self) -> Floats:
        return np.array(self.values)

    def at(self, share: Floats) -> Floats:
        return np.array(self.values)[(share * len(self.values)).astype(int)]


class Span(SweepAxis):
    """Values from a start to a stop."""

    start: float = Field(description="first value")
    stop: float = Field(description="last value")
    count: int | None = Field(default=None, ge=1, description="number of values on a grid")

    @property
    def size(self) -> int | None:
        return self.count

    @property
    def ends(self) -> tuple[float, float]:
        return min(self.start, self.stop), max(self.start, self.stop)


class Linspace(Span):
    """Evenly spaced values from start to stop, both included; drawn uniformly."""

    kind: Literal["linspace"] = "linspace"

    def values_on_grid(self) -> Floats:
        return np.linspace(self.start, self.stop, self.count or 1)

    def at(self, share: Floats) -> Floats:
        return self.start + share * (self.stop - self.start)


class Logspace(Span):
    """Values from start to stop, both above 0 and included, each the same factor above the one before; drawn uniformly
    in the logarithm."""

    kind: Literal["logspace"] = "logspace"

    @field_validator("start", "stop")
    @classmethod
    def _positive(cls, value: float) -> float:
        if not value > 0.0:
            raise PathErrors([("", f"a range of factors needs a value above 0, got {value:g}")])
        return value

    def values_on_grid(self) -> Floats:
        return np.geomspace(self.start, self.stop, self.count or 1)

    def at(self, share: Floats) -> Floats:
        return self.start * (self.stop / self.start) ** share


class Normal(SweepAxis):
    """Values scattered about a mean, normally, cut off at `CUT` standard deviations: what is further off is not sold.
    It has no values on a grid."""

    kind: Literal["normal"] = "normal"
    mean: float = Field(description="mean")
    deviation: float = Field(ge=0.0, description="standard deviation before the cut")

    @property
    def size(self) -> None:
        return None

    @property
    def ends(self) -> tuple[float, float]:
        return self.mean - CUT * self.deviation, self.mean + CUT * self.deviation

    def values_on_grid(self) -> Floats:
        raise InputError("a normal scatter has no values on a grid")

    def at(self, share: Floats) -> Floats:
        from scipy.special import ndtr, ndtri

        beyond = ndtr(-CUT)
        return self.mean + self.deviation * ndtri(beyond + share * (1.0 - 2.0 * beyond))


CUT = 3.0
"""Standard deviations at which a scatter is cut off: 0.3 % lie beyond."""

AnyAxis = Annotated[Values | Linspace | Logspace | Normal, Field(discriminator="kind")]


class Grid(Description):
    """Every combination of the values, the last axis fastest."""

    kind: Literal["grid"] = "grid"

    def runs(self, axes: Mapping[str, SweepAxis]) -> int:
        """Number of runs."""
        return math.prod(axis.size or 1 for axis in axes.values())

    def faults(self, axes: Mapping[str, SweepAxis]) -> list[tuple[str, str]]:
        """What the design cannot use, as (path in the axes, sentence)."""
        missing = "missing; expected the number of values on the grid"
        return [
            (f"{name}.count", missing if axis.size is None else "expected 2 or more values between different ends")
            for name, axis in axes.items()
            if axis.size is None or (axis.size == 1 and axis.ends[0] < axis.ends[1])
        ]

    def points(self, axes: Mapping[str, SweepAxis], part: slice) -> dict[str, Floats]:
        """Values (k,) of the runs of a part, by axis."""
        values = [axis.values_on_grid() for axis in axes.values()]
        places = np.unravel_index(np.arange(part.start, part.stop), tuple(map(len, values)))
        return {name: own[at] for name, own, at in zip(axes, values, places, strict=True)}


class Sobol(Description):
    """Runs spread over all axes at once by a scrambled Sobol sequence; most even where the count is a power of 2."""

    kind: Literal["sobol"] = "sobol"
    count: int = Field(ge=1, description="number of runs")
    seed: int = Field(default=0, ge=0, description="seed of the scrambling")

    def runs(self, axes: Mapping[str, SweepAxis]) -> int:
        """Number of runs."""
        return self.count

    def faults(self, axes: Mapping[str, SweepAxis]) -> list[tuple[str, str]]:
        """What the design cannot use, as (path in the axes, sentence)."""
        return [
            (f"{name}.count", "a Sobol design has its own count; leave this one out")
            for name, axis in axes.items()
            if not isinstance(axis, Values) and axis.size is not None
        ]

    def points(self, axes: Mapping[str, SweepAxis], part: slice) -> dict[str, Floats]:
        """Values (k,) of the runs of a part, by axis."""
        shares = sobol_shares(len(axes), self.seed, part)
        return {name: axis.at(shares[:, i]) for i, (name, axis) in enumerate(axes.items())}


def sobol_shares(dimensions: int, seed: int, part: slice) -> Floats:
    """Points (k, dimensions) of a part of scipy's scrambled Sobol sequence.

    scipy walks there from the first point, 30 ms for ten million points of four dimensions. Units are asked for in
    rising order, so a thread keeps its place and begins again only for an earlier part.
    """
    from scipy.stats import qmc

    engine = _places().get((dimensions, seed))
    if engine is None or engine.num_generated > part.start:
        # scipy before 1.15 knows no rng
        engine = _places()[dimensions, seed] = qmc.Sobol(dimensions, seed=seed)  # pyright: ignore[reportCallIssue]
    count, first = part.stop - part.start, np.empty((0, dimensions))
    if part.start > engine.num_generated:
        engine.fast_forward(part.start - engine.num_generated)
    elif part.start == 0 < count:
        first = engine.random(1)  # alone: scipy warns of a first draw whose size is no power of two
    return np.concatenate([first, engine.random(count - len(first))])


def _places() -> dict[tuple[int, int], Any]:
    """Sequences of this thread by dimensions and seed, each at the place where it was left."""
    return _THREAD.__dict__.setdefault("places", {})


_THREAD = threading.local()
