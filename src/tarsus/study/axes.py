"""What varies in a sweep: lists and ranges of values, crossed as a grid or drawn as a Sobol sequence."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator

from tarsus.base.errors import InputError
from tarsus.base.messages import PathErrors
from tarsus.base.spec import Description

__all__ = [
    "AnyAxis", "Axis", "Grid", "Linspace", "Logspace", "Normal", "Sobol", "Values", "keep_powers", "sobol_powers",
    "sobol_shares",
]  # fmt: skip

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


class Normal(Axis):
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

    def points(self, axes: Mapping[str, Axis], part: slice) -> dict[str, Floats]:
        """Values (k,) of the runs of a part, by axis."""
        values = [axis.values_on_grid() for axis in axes.values()]
        places = np.unravel_index(np.arange(part.start, part.stop), tuple(map(len, values)))
        return {name: own[at] for name, own, at in zip(axes, values, places, strict=True)}


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

    def dimensions(self, axes: Mapping[str, Axis]) -> int:
        """Dimensions of the sequence."""
        return len(axes)

    def points(self, axes: Mapping[str, Axis], part: slice) -> dict[str, Floats]:
        """Values (k,) of the runs of a part, by axis."""
        shares = sobol_shares(len(axes), self.seed, part)
        return {name: axis.at(shares[:, i]) for i, (name, axis) in enumerate(axes.items())}


def sobol_shares(dimensions: int, seed: int, part: slice) -> Floats:
    """Points (k, dimensions) of a scrambled Sobol sequence, those of scipy, of any part at once.

    A point is the exclusive or of the first one and of one direction number for each bit of the Gray code of its
    number (Antonov and Saleev 1979). The Gray code is linear, so that the points of powers of two give all others.
    """
    numbers = np.arange(part.start, part.stop)
    first, *steps = sobol_powers(dimensions, seed, part.stop)
    shares = np.repeat(first[None], len(numbers), axis=0)
    for bit, step in enumerate(steps):
        shares[(numbers >> bit) & 1 == 1] ^= step
    return np.asarray(shares * 2.0**-SOBOL_BITS, dtype=np.float64)


SOBOL_BITS = 30
"""Bits of a point: those of scipy unless told otherwise."""

_POWERS: dict[tuple[int, int], NDArray[np.int64]] = {}
"""What `sobol_powers` found: facts of the sequence, each made once."""


def sobol_powers(dimensions: int, seed: int, count: int) -> NDArray[np.int64]:
    """What the first `count` points of a sequence are made of, as whole numbers of `SOBOL_BITS` bits: the first point,
    then what separates those of the powers of two from it (bits + 1, dimensions)."""
    bits = max(count - 1, 1).bit_length()
    known = _POWERS.get((dimensions, seed))
    if known is not None and len(known) > bits:
        return known[: bits + 1]
    from scipy.stats import qmc

    # scipy before 1.15 knows no rng
    engine = qmc.Sobol(dimensions, seed=seed)  # pyright: ignore[reportCallIssue]
    rows = []
    for number in (0, *(1 << bit for bit in range(bits))):
        if number > engine.num_generated:
            engine.fast_forward(number - engine.num_generated)
        rows.append(np.rint(engine.random(1)[0] * 2.0**SOBOL_BITS).astype(np.int64))
    return keep_powers(dimensions, seed, np.array([rows[0], *(row ^ rows[0] for row in rows[1:])]))


def keep_powers(dimensions: int, seed: int, powers: NDArray[np.int64]) -> NDArray[np.int64]:
    """Take what a sequence is made of from whoever has found it: loading scipy's takes longer than to read it."""
    _POWERS[dimensions, seed] = powers
    return powers
