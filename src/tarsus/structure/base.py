"""What every structure offers: matrices of linear dynamics, and points on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.spec import Description

__all__ = ["Array", "Matrices", "Structure"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Matrices:
    """``mass @ x'' + damping @ x' + stiffness @ x = force``; each array (n, n), SI."""

    mass: Array
    damping: Array
    stiffness: Array


class Structure(Description):
    """A linear structure in its own coordinates ``x`` (n of them), with named points.

    Subclasses are `Modal`, `Lumped`, `Beam` and `Walker`.
    """

    @property
    def size(self) -> int:
        """Number of coordinates n."""
        raise NotImplementedError

    @property
    def points(self) -> tuple[str, ...]:
        """Names of the points."""
        raise NotImplementedError

    def matrices(self) -> Matrices:
        """Mass, damping and stiffness, each (n, n)."""
        raise NotImplementedError

    def row(self, point: str) -> Array:
        """Weights (n,) that give the displacement of a point along +z: ``row @ x`` [m].

        Raises
        ------
        KeyError
            If the structure has no such point.
        """
        raise NotImplementedError

    def vertical(self) -> Array | None:
        """Coordinates (n,) of a unit upward translation of the whole structure (projected onto them).

        The generalised weight is ``-g * mass @ vertical()``.  None when the description does not tell.
        """
        return None
