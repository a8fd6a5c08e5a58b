"""What every law from volts to force offers, and the cubic of the voltage they share."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.base.spec import Amount, Description, quantity
from tarsus.model.drive.parts import Parts
from tarsus.model.drive.track import Track, TrackSlopes

__all__ = ["Cubic", "VoltageLaw"]

Floats = NDArray[np.float64]


class VoltageLaw(Description, ABC):
    """Base of the laws from voltage to force; rate-independent: only the order of voltages matters."""

    @abstractmethod
    def force(self, volts: ArrayLike, history: Sequence[float] = ()) -> Floats:
        """Force (N,) [N] along a sequence of voltages (N,) [V], monotone from each to the next.

        `history` [V] was visited before; every drive starts at 0 V.
        """

    def forces(self, volts: Floats, history: Sequence[float] = ()) -> Floats:
        """Force (n, N) [N] along n sequences of voltages (n, N) [V], each after the same `history`."""
        return np.array([self.force(row, history) for row in volts])

    @abstractmethod
    def parts(self, track: Track, history: Sequence[float]) -> Parts:
        """The track cut where the force changes its formula, with the cubic of the voltage on each part."""

    def remembered(
        self, track: Track, history: Sequence[float], parts: Parts, slopes: TrackSlopes
    ) -> Floats | float:
        """Derivatives (Q, P) of the force on each part by what the drive has been through before it, from those of its
        track."""
        return 0.0

    @property
    def has_memory(self) -> bool:
        """True if the force depends on the voltages before."""
        return True


class Cubic(Description):
    """A cubic polynomial of the voltage: constant + linear V + quadratic V^2 + cubic V^3."""

    constant: Amount = quantity("N", "force at 0 V", default=0.0)
    linear: Amount = quantity("N/V", "gain on V", default=0.0)
    quadratic: Amount = quantity("N/V^2", "gain on V^2", default=0.0)
    cubic: Amount = quantity("N/V^3", "gain on V^3", default=0.0)

    def coefficients(self) -> Floats:
        """(4,), ascending."""
        return np.array([self.constant, self.linear, self.quadratic, self.cubic])

    def __call__(self, volts: ArrayLike) -> Floats:
        """Force [N] at `volts` [V], any shape."""
        v = np.asarray(volts, dtype=np.float64)
        return ((self.cubic * v + self.quadratic) * v + self.linear) * v + self.constant
