"""A structure given by its modes."""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np
from pydantic import model_validator

from tarsus.base.linear import EPS, modes_of, product
from tarsus.base.messages import PathErrors
from tarsus.base.spec import Amounts, Named, quantity
from tarsus.model.structure.base import Array, Matrices, Structure


class Modal(Structure):
    """Modes with frequencies, damping ratios, modal masses and shapes at named points.

    The coordinates ``x`` are the modal ones, in metres: the displacement of a point is the sum of its shape
    values times ``x``.  Zero frequencies are rigid-body modes; damping ratios above one are overdamped.
    """

    kind: Literal["modal"] = "modal"
    frequencies: Amounts = quantity("Hz", "undamped natural frequencies; 0 is a rigid body", ge=0)
    damping_ratios: Amounts = quantity("1", "damping ratio of each mode; above 1 overdamped", ge=0)
    modal_masses: Amounts = quantity("kg", "modal mass of each mode", gt=0)
    shapes: Named[tuple[float, ...]] = quantity("1", "shape value of each mode at each named point")
    modal_damping: tuple[float, ...] | None = quantity(
        "N s/m", "damping added to each mode, for modes of zero frequency", default=None, ge=0
    )
    upward: tuple[float, ...] | None = quantity(
        "1",
        "modal coordinates of a unit upward translation, for gravity: times shapes they add up to about 1 at any point",
        default=None,
    )
    forward: tuple[float, ...] | None = quantity(
        "1", "modal coordinates of a unit translation forward along the ground, for gravity on an incline", default=None
    )

    @model_validator(mode="after")
    def _check_lengths(self) -> Modal:
        n = len(self.frequencies)
        faults: list[tuple[str, str]] = []
        if n == 0:
            faults.append(("frequencies", "expected at least one mode, got none"))
        lists: list[tuple[str, tuple[float, ...] | None]] = [
            ("damping_ratios", self.damping_ratios),
            ("modal_masses", self.modal_masses),
            ("modal_damping", self.modal_damping),
            ("upward", self.upward),
            ("forward", self.forward),
            *((f"shapes.{point}", shape) for point, shape in self.shapes.items()),
        ]
        for path, values in lists:
            if values is not None and len(values) != n:
                faults.append((path, f"expected {n} values, one a mode, got {len(values)}"))
        if faults:
            raise PathErrors(faults)
        return self

    @property
    def size(self) -> int:
        """Number of modes."""
        return len(self.frequencies)

    @property
    def points(self) -> tuple[str, ...]:
        """Names of the points that have a shape."""
        return tuple(self.shapes)

    def matrices(self) -> Matrices:
        """Diagonal mass, damping and stiffness, each (modes, modes)."""
        omega = 2.0 * math.pi * np.array(self.frequencies)
        mass = np.array(self.modal_masses)
        damping = 2.0 * np.array(self.damping_ratios) * omega * mass
        if self.modal_damping is not None:
            damping = damping + np.array(self.modal_damping)
        return Matrices(np.diag(mass), np.diag(damping), np.diag(mass * omega**2))

    def row(self, point: str) -> Array:
        """Shape values (modes,) at a point."""
        return np.array(self.shapes[point])

    def vertical(self) -> Array | None:
        """The given `upward` coordinates."""
        return None if self.upward is None else np.array(self.upward)

    def horizontal(self) -> Array | None:
        """The given `forward` coordinates."""
        return None if self.forward is None else np.array(self.forward)


def modal_damping_matrix(mass: Array, stiffness: Array, ratios: Any) -> Array:
    """Damping matrix (n, n) that gives every undamped mode its damping ratio.

    ``C = M P diag(2 zeta omega) P^T M`` with mass-normalised modes ``P``, in order of frequency; modes of
    zero frequency stay undamped.
    """
    squared, shapes = modes_of(mass, stiffness)
    # what the largest loses to rounding is no frequency, whose root would be 1e-8 of the highest
    omega = np.sqrt(np.where(squared > 4.0 * len(squared) * EPS * squared.max(), squared, 0.0))
    weighted = product(mass, shapes)
    return product(weighted * (2.0 * np.asarray(ratios) * omega), weighted.T)
