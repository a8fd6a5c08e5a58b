"""Shapes measured at an impact compared with the structure's modes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tarsus.base.arrays import Floats
from tarsus.base.linear import modes_of
from tarsus.impacts.free import point_rows
from tarsus.measure.mac import mac
from tarsus.model.structure.base import Structure


@dataclass(frozen=True)
class ShapeComparison:
    """A shape against each undamped mode: frequencies (n,) [Hz] and their assurance (n,), from 0 to 1."""

    frequencies: Floats
    assurance: Floats

    @property
    def best(self) -> int:
        """Number of the mode most alike, from zero."""
        return int(np.argmax(self.assurance))


def mode_shapes(structure: Structure, points: Sequence[str]) -> tuple[Floats, Floats]:
    """Undamped frequencies (n,) [Hz] and shapes (np, n) at points, mass-normalised, in order of frequency."""
    m = structure.matrices()
    squared, modes = modes_of(m.mass, m.stiffness)
    return np.sqrt(squared.clip(0.0)) / (2.0 * np.pi), point_rows(structure, points) @ modes


def compare_with_modes(shape: ArrayLike, structure: Structure, points: Sequence[str]) -> ShapeComparison:
    """Modal assurance of a shape (np,), in any one unit, at points with each mode of a structure.

    Raises
    ------
    InputError
        If the points are unknown or not as many as the shape's values.
    """
    frequencies, shapes = mode_shapes(structure, points)
    return ShapeComparison(frequencies, mac(np.asarray(shape, dtype=float), shapes))
