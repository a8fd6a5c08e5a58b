"""What varies in a sweep: lists and ranges of values, crossed as a grid or drawn as a Sobol sequence."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator

from tarsus.base.messages import PathErrors
from tarsus.base.spec import Description

__all__ = ["AnyAxis", "AnyDesign", "Axis", "Grid", "Linspace", "Logspace", "Sobol", "Values"]

Floats = NDArray[np.float64]


class Axis(Description):
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


class Values(Axis):
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


class Linspace(Axis):
    """Evenly spaced values from start to stop, both included; drawn uniformly."""

    kind: Literal["linspace"] = "linspace"
    start: float = Field(description="first value")
    stop: float = Field(description="last value")
    count: int | None = Field(default=None, ge=1, description="number of values on a grid")

    @property
    def size(self) -> int | None:
        return self.count

    @property
    def ends(self) -> tuple[float, float]:
        return min(self.start, self.stop), max(self.start, self.stop)

    def values_on_grid(self) -> Floats:
        return np.linspace(self.start, self.stop, self.count or 1)

    def at(self, share: Floats) -> Floats:
        return self.start + share * (self.stop - self.start)


class Logspace(Axis):
    """Values from start to stop, both above 0 and included, each the same factor above the one before; drawn uniformly
    in the logarithm."""

    kind: Literal["logspace"] = "logspace"
    start: float = Field(description="first value")
    stop: float = Field(description="last value")
    count: int | None = Field(default=None, ge=1, description="number of values on a grid")

    @field_validator("start", "stop")
    @classmethod
    def _positive(cls, value: float) -> float:
        if not value > 0.0:
            raise PathErrors([("", f"a range of factors needs a value above 0, got {value:g}")])
        return value

    @property
    def size(self) -> int | None:
        return self.count

    @property
    def ends(self) -> tuple[float, float]:
        return min(self.start, self.stop), max(self.start, self.stop)

    def values_on_grid(self) -> Floats:
        return np.geomspace(self.start, self.stop, self.count or 1)

    def at(self, share: Floats) -> Floats:
        return self.start * (self.stop / self.start) ** share


AnyAxis = Annotated[Values | Linspace | Logspace, Field(discriminator="kind")]


class Grid(Description):
    """Every combination of the values, the last axis fastest."""

    kind: Literal["grid"] = "grid"

    def runs(self, axes: Mapping[str, Axis]) -> int:
        """Number of runs."""
        return math.prod(axis.size or 1 for axis in axes.values())

    def faults(self, axes: Mapping[str, Axis]) -> list[tuple[str, str]]:
        """What the design cannot use, as (path in the axes, sentence)."""
        return [
            (f"{name}.count", "expected the number of values on the grid, nothing given")
            for name, axis in axes.items()
            if axis.size is None
        ]

    def points(self, axes: Mapping[str, Axis]) -> dict[str, Floats]:
        """Values (nr,) of every run, by axis."""
        mesh = np.meshgrid(*(axis.values_on_grid() for axis in axes.values()), indexing="ij")
        return {name: values.ravel() for name, values in zip(axes, mesh, strict=True)}


class Sobol(Description):
    """Runs spread over all axes at once by a scrambled Sobol sequence; most even where the count is a power of 2."""

    kind: Literal["sobol"] = "sobol"
    count: int = Field(ge=1, description="number of runs")
    seed: int = Field(default=0, ge=0, description="seed of the scrambling")

    def runs(self, axes: Mapping[str, Axis]) -> int:
        """Number of runs."""
        return self.count

    def faults(self, axes: Mapping[str, Axis]) -> list[tuple[str, str]]:
        """What the design cannot use, as (path in the axes, sentence)."""
        return [
            (f"{name}.count", "a Sobol design has its own count; leave this one out")
            for name, axis in axes.items()
            if not isinstance(axis, Values) and axis.size is not None
        ]

    def points(self, axes: Mapping[str, Axis]) -> dict[str, Floats]:
        """Values (nr,) of every run, by axis."""
        from scipy.stats import qmc

        # scipy before 1.15 knows no rng
        engine = qmc.Sobol(len(axes), seed=self.seed)  # pyright: ignore[reportCallIssue]
        # the first point by itself: scipy warns of counts that are no power of 2, which are the user's choice
        shares = np.concatenate([engine.random(1), engine.random(self.count - 1)])
        return {name: axis.at(shares[:, i]) for i, (name, axis) in enumerate(axes.items())}


AnyDesign = Annotated[Grid | Sobol, Field(discriminator="kind")]
