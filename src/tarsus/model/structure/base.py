"""What every structure offers: matrices of linear dynamics, and points on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.linear import condition_of, solve
from tarsus.base.spec import Description

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Matrices:
    """``mass @ x'' + damping @ x' + stiffness @ x = force``; each array (n, n), SI."""

    mass: Array
    damping: Array
    stiffness: Array


class Structure(Description):
    """A linear structure in its own coordinates ``x`` (n of them), with named points.

    Subclasses are `Modal`, `Lumped`, `Beam`, `Linkage` and `Walker`.
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

    @property
    def lumped_points(self) -> tuple[str, ...]:
        """Points whose displacements can stand for the coordinates, if any can: all of them."""
        return self.points

    def alone(self, point: str) -> Array:
        """Coordinates (n,) that move a point by one and every other of the `lumped_points` by nothing.

        With ``b = alone(p)`` the stiffness ``K_pp`` in the displacements of the points is ``b @ K @ b``.

        Raises
        ------
        InputError
            Unless the points are as many as the coordinates and determine them.
        """
        points = self.lumped_points
        rows = np.array([self.row(name) for name in points])
        if len(points) != self.size or condition_of(rows) > 1e10:  # beyond it five digits of K_pp are left
            raise InputError(
                f"the displacements of its points ({', '.join(points)}) cannot stand for the {self.size} coordinates "
                "of the structure: as many points with independent shapes are needed"
            )
        if point not in points:
            raise InputError(f"'{point}' is a combination of the coordinates ({', '.join(points)}), not one of them")
        own = np.array([float(name == point) for name in points])
        return solve(rows, own)

    @property
    def body_coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates of the body, of a structure that walks; none of any other."""
        return ()

    def vertical(self) -> Array | None:
        """Coordinates (n,) of a unit upward translation of the whole structure (projected onto them).

        The generalised weight on level ground is ``-g * mass @ vertical()``.  None when the
        description does not say.
        """
        return None

    def horizontal(self) -> Array | None:
        """Coordinates (n,) of a unit translation of the whole structure along +x, the way along the ground.

        On an incline a the generalised weight is ``-g * mass @ (cos a * vertical() + sin a * horizontal())``.
        None when the description does not say.
        """
        return None

    def translation(self, direction: str) -> Array | None:
        """Coordinates (n,) of a unit translation with the ground, ``"normal"`` to it or ``"along"`` it: `vertical`,
        `horizontal`."""
        return self.vertical() if direction == "normal" else self.horizontal()
