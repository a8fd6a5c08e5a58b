"""Parameters as pure numbers of order one: logarithms of what has a sign, shares of a size for what has none."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.base.errors import InputError

__all__ = ["Coordinates"]

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Coordinates:
    """np parameters about their values: ``u = log(x / value)``, or ``u = (x - value) / size`` for those with a size.

    names; values (np,) in SI; sizes (np,): NaN for a parameter that keeps its sign, else the size that its changes are
    compared with, such as the range of an offset.
    """

    names: tuple[str, ...]
    values: Floats
    sizes: Floats

    @classmethod
    def of(
        cls, names: tuple[str, ...], values: ArrayLike, sizes: Mapping[str, float] | None = None
    ) -> Coordinates:
        """Coordinates of parameters; ``sizes`` by name for those that may pass through zero.

        Raises
        ------
        InputError
            If a value is not finite, a value of zero has no size, or a size is not positive or of no parameter.
        """
        given = dict(sizes or {})
        numbers = np.asarray(values, dtype=float)
        problems = [f"sizes: '{name}' is none of the parameters" for name in given if name not in names]
        problems += [
            f"{name}: expected a size above 0, got {size:g}" for name, size in given.items() if not size > 0.0
        ]
        if numbers.shape != (len(names),):
            problems.append(f"expected {len(names)} values, one a parameter, got shape {numbers.shape}")
        else:
            for name, value in zip(names, numbers, strict=True):
                if not np.isfinite(value):
                    problems.append(f"{name}: expected a finite value, got {value}")
                elif value == 0.0 and name not in given:
                    problems.append(
                        f"{name}: a value of 0 has no logarithm; give a size to compare changes with"
                    )
        if problems:
            raise InputError(problems)
        return cls(tuple(names), numbers, np.array([given.get(name, np.nan) for name in names]))

    @property
    def logarithmic(self) -> NDArray[np.bool_]:
        """(np,) True for parameters taken as logarithms."""
        return np.isnan(self.sizes)

    def size(self, j: int) -> float | None:
        """Size that changes of parameter number j are compared with; None where that is the parameter itself."""
        return None if self.logarithmic[j] else float(self.sizes[j])

    def inward(self, x: ArrayLike) -> Floats:
        """Pure numbers (..., np) of parameters (..., np); NaN where a logarithm has the wrong sign."""
        with np.errstate(divide="ignore", invalid="ignore"):
            logs = np.log(np.asarray(x, dtype=float) / self.values)
        return np.where(self.logarithmic, logs, (np.asarray(x, dtype=float) - self.values) / self.sizes)
