"""A structure given by its mass, damping and stiffness matrices."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from pydantic import Field, field_validator, model_validator

from tarsus.base.linear import eigh
from tarsus.base.messages import PathErrors
from tarsus.base.spec import FrozenDict, Name, Named, quantity
from tarsus.model.structure.base import Array, Matrices, Structure
from tarsus.model.structure.modal import modal_damping_matrix

Matrix = tuple[tuple[float, ...], ...]


class Lumped(Structure):
    """``M x'' + C x' + K x = f`` with any matrices that make sense.

    ``mass``, ``damping`` and ``stiffness`` are matrices, or lists that are their diagonals.  The mass matrix
    is symmetric and positive definite; damping and stiffness are general (they need be neither symmetric
    nor proportional; a zero stiffness leaves rigid-body modes).  Every coordinate is a point of its own name;
    ``weights`` adds points that are combinations of coordinates.
    """

    kind: Literal["lumped"] = "lumped"
    coordinates: tuple[Name, ...] = Field(description="names of the coordinates, each the height of a point")
    mass: Matrix = quantity("kg", "mass matrix, or the list of its diagonal")
    stiffness: Matrix = quantity("N/m", "stiffness matrix, or the list of its diagonal")
    damping: Matrix | None = quantity("N s/m", "damping matrix, or the list of its diagonal", default=None)
    damping_ratios: tuple[float, ...] | None = quantity(
        "1", "damping ratio of each undamped mode, in order of frequency, instead of a matrix", default=None, ge=0
    )
    weights: Named[tuple[float, ...]] = quantity("1", "extra points: weight of each coordinate", default=FrozenDict())
    upward: tuple[float, ...] | None = quantity(
        "1", "coordinates of a unit upward translation, for gravity; all ones when absent", default=None
    )
    forward: tuple[float, ...] | None = quantity(
        "1", "coordinates of a unit translation forward along the ground, for gravity on an incline", default=None
    )

    @field_validator("mass", "stiffness", "damping", mode="before")
    @classmethod
    def _diagonal(cls, value: Any) -> Any:
        """A list of single values is the diagonal of a matrix, and one value a 1 x 1 matrix."""
        if isinstance(value, np.ndarray):
            value = value.tolist()
        if isinstance(value, (str, int, float)):
            return ((value,),)
        if isinstance(value, (list, tuple)) and value and all(isinstance(v, (str, int, float)) for v in value):
            n = len(value)
            return tuple(tuple(value[i] if i == j else 0.0 for j in range(n)) for i in range(n))
        return value

    @model_validator(mode="after")
    def _check(self) -> Lumped:
        faults = self._shape_faults()
        if not faults:
            faults = self._matrix_faults()
        if faults:
            raise PathErrors(faults)
        return self

    def _shape_faults(self) -> list[tuple[str, str]]:
        n = len(self.coordinates)
        faults: list[tuple[str, str]] = []
        if n == 0:
            faults.append(("coordinates", "expected at least one coordinate, got none"))
        if len(set(self.coordinates)) < n:
            faults.append(("coordinates", "expected different names, got one twice"))
        for name in ("mass", "damping", "stiffness"):
            matrix: Matrix | None = getattr(self, name)
            if matrix is not None and (len(matrix) != n or any(len(line) != n for line in matrix)):
                widths = "x".join(str(w) for w in sorted({len(line) for line in matrix})) or "0"
                faults.append(
                    (name, f"expected a {n} x {n} matrix, one row a coordinate, got {len(matrix)} x {widths}")
                )
        lists = [("damping_ratios", self.damping_ratios), ("upward", self.upward), ("forward", self.forward)]
        lists += [(f"weights.{point}", weights) for point, weights in self.weights.items()]
        for path, values in lists:
            if values is not None and len(values) != n:
                faults.append((path, f"expected {n} values, one a coordinate, got {len(values)}"))
        if self.damping is not None and self.damping_ratios is not None:
            faults.append(("damping", "give either a damping matrix or damping_ratios, not both"))
        faults += [
            (f"weights.{point}", "this name is already that of a coordinate")
            for point in self.weights
            if point in self.coordinates
        ]
        return faults

    def _matrix_faults(self) -> list[tuple[str, str]]:
        mass, stiffness = np.array(self.mass), np.array(self.stiffness)
        faults: list[tuple[str, str]] = []
        scale = float(np.abs(mass).max())
        negative = [(i, mass[i, i]) for i in range(len(mass)) if mass[i, i] < 0.0]
        if negative:
            faults += [
                (f"mass.{i}.{i}", f"expected a mass (kg) above 0, got {value:g}: a mass is never negative")
                for i, value in negative
            ]
        elif float(np.abs(mass - mass.T).max()) > 1e-9 * scale:
            faults.append(("mass", "the mass matrix must be symmetric"))
        else:
            values = eigh(_unit_diagonal(mass))[0] if np.all(np.diag(mass) > 0) else np.zeros(1)
            if values[0] < -1e-12:
                faults.append(("mass", "the mass matrix is not positive definite: some motion has negative inertia"))
            elif values[0] <= 1e-13:
                faults.append(("mass", "the mass matrix is singular: some motion has no inertia"))
        if self.damping_ratios is not None and float(np.abs(stiffness - stiffness.T).max()) > 1e-9 * float(
            np.abs(stiffness).max()
        ):
            faults.append(("damping_ratios", "need a symmetric stiffness; give a damping matrix instead"))
        return faults

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self.coordinates)

    @property
    def points(self) -> tuple[str, ...]:
        """Names of the coordinates, then of the extra points."""
        return (*self.coordinates, *self.weights)

    @property
    def lumped_points(self) -> tuple[str, ...]:
        """The coordinates."""
        return self.coordinates

    def matrices(self) -> Matrices:
        """The given matrices, each (n, n); no damping when none is given."""
        mass, stiffness = np.array(self.mass), np.array(self.stiffness)
        if self.damping is not None:
            damping = np.array(self.damping)
        elif self.damping_ratios is not None:
            damping = modal_damping_matrix(mass, stiffness, self.damping_ratios)
        else:
            damping = np.zeros_like(mass)
        return Matrices(mass, damping, stiffness)

    def row(self, point: str) -> Array:
        """One coordinate (n,), or the weights of an extra point."""
        if point in self.weights:
            return np.array(self.weights[point])
        if point not in self.coordinates:
            raise KeyError(point)
        return np.array([1.0 if name == point else 0.0 for name in self.coordinates])

    def vertical(self) -> Array:
        """The given `upward` coordinates, or ones: every coordinate a height."""
        return np.ones(self.size) if self.upward is None else np.array(self.upward)

    def horizontal(self) -> Array | None:
        """The given `forward` coordinates."""
        return None if self.forward is None else np.array(self.forward)


def _unit_diagonal(mass: Array) -> Array:
    """The mass matrix scaled so that its diagonal is one: singularity does not depend on units."""
    root = np.sqrt(np.diag(mass))
    return mass / np.outer(root, root)
