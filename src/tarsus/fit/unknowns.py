"""Numbers that are searched: their bounds, their scales, and what is known of them beforehand."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

__all__ = ["Prior", "Unknown", "Unknowns"]

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Prior:
    """What is known of a number: its median [SI], and one standard deviation [SI] or, where ``factor``, as a factor."""

    median: float
    spread: float
    factor: bool = False


@dataclass(frozen=True)
class Unknown:
    """A number that is searched between bounds.

    low, high: SI, or texts with a unit; log: whether a step is a factor; paths: numbers of the scene that take it, the
    one that it is named after unless given; prior: what is known beforehand.
    """

    low: float | str
    high: float | str
    log: bool = False
    paths: tuple[str, ...] | None = None
    prior: Prior | None = None


@dataclass(frozen=True)
class Unknowns:
    """nu numbers that are searched: names, units, bounds (nu,) [SI], whether on a logarithmic scale, priors, and sizes
    [SI] that changes of those are compared with that may be of either sign (None: the number itself).

    Searches move in the *cube*: x = 0 is the lower bound and 1 the upper one, linearly or by the logarithm.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    low: Floats
    high: Floats
    log: NDArray[np.bool_]
    priors: tuple[Prior | None, ...]
    sizes: tuple[float | None, ...] = field(default=(), kw_only=True)

    def __post_init__(self) -> None:
        if not self.sizes:
            object.__setattr__(self, "sizes", (None,) * len(self.names))

    def __len__(self) -> int:
        return len(self.names)

    def at(self, cube: Floats) -> Floats:
        """SI values of points (..., nu) of the cube; those beside it are taken to its side."""
        x = np.clip(cube, 0.0, 1.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(self.log, self.high / np.where(self.log, self.low, 1.0), 1.0)
        factors = np.where(self.log, self.low, 1.0) * ratio**x
        return np.where(self.log, factors, self.low + (self.high - self.low) * x)

    def cube(self, values: Floats) -> Floats:
        """Points (..., nu) of the cube of SI values."""
        with np.errstate(divide="ignore", invalid="ignore"):
            log = np.log(values / self.low) / np.log(self.high / self.low)
        return np.where(self.log, log, (values - self.low) / (self.high - self.low))

    def slopes(self, cube: Floats) -> Floats:
        """Derivatives (..., nu) of the SI values by the cube's coordinates."""
        with np.errstate(divide="ignore", invalid="ignore"):
            rate = np.where(self.log, np.log(self.high / self.low), 0.0)
        return np.where(self.log, rate * self.at(cube), self.high - self.low)

    def precision(self, cube: Floats) -> Floats:
        """What is known of each unknown (nu,) beforehand, at a point (nu,): one over the variance in the cube of its
        bounds, and of its prior by its curvature there."""
        h = 1e-3
        at = np.clip(cube, h, 1.0 - h)
        step = h * np.eye(len(at))
        curved = self.prior_cost(at + step) - 2.0 * self.prior_cost(at) + self.prior_cost(at - step)
        return 12.0 + np.maximum(0.5 * curved / h**2, 0.0)

    def prior_residuals(self, cube: Floats) -> Floats:
        """Distances (..., nu) from the priors' medians in their deviations; zero where there is none."""
        values = self.at(cube)
        out = np.zeros(values.shape)
        for i, prior in enumerate(self.priors):
            if prior is not None:
                x = values[..., i]
                out[..., i] = (
                    np.log(x / prior.median) / np.log(prior.spread)
                    if prior.factor
                    else (x - prior.median) / prior.spread
                )
        return out

    def prior_slopes(self, cube: Floats) -> Floats:
        """Derivatives (..., nu) of `prior_residuals` by their own coordinate of the cube."""
        values, rates = self.at(cube), self.slopes(cube)
        out = np.zeros(values.shape)
        for i, prior in enumerate(self.priors):
            if prior is not None:
                by_value = (
                    1.0 / (values[..., i] * np.log(prior.spread)) if prior.factor else 1.0 / prior.spread
                )
                out[..., i] = by_value * rates[..., i]
        return out

    def prior_cost(self, cube: Floats) -> Floats:
        """Minus twice the log of the priors (...,), constants dropped."""
        return (self.prior_residuals(cube) ** 2).sum(axis=-1)
