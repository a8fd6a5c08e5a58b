"""What every law from volts to force offers, and the cubic of the voltage they share."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from tarsus.base.arrays import Floats
from tarsus.base.columns import columns
from tarsus.base.spec import Amount, Description, quantity
from tarsus.model.drive.parts import Parts, to_pieces
from tarsus.model.drive.pieces import Channels
from tarsus.model.drive.track import Track, linear_track


class VoltageLaw(Description, ABC):
    """Base of the laws from voltage to force; rate-independent, but for one that says `by_rate`: only the order of
    voltages matters."""

    @abstractmethod
    def force(self, volts: ArrayLike, history: Sequence[float] = ()) -> Floats:
        """Force (N,) [N] along a sequence of voltages (N,) [V], monotone from each to the next.

        `history` [V] was visited before; every drive starts at 0 V.
        """

    @abstractmethod
    def parts(self, track: Track, history: Sequence[float]) -> Parts:
        """The track cut where the force changes its formula, with the cubic of the voltage on each part.

        Numbers of the law and of the history, like those of the track, may be one a run (nr,).
        """

    def channels(self, track: Track, history: Sequence[float], late: Floats | None = None) -> Channels:
        """The force as piecewise polynomials of time, a channel for each run of the track.

        late: what a law that goes by the rate lags at the start, as `late` gives it, at rest without.
        """
        track = track.twice() if self.has_memory else track
        return to_pieces(track, self.parts(track, history))

    def held(self, volts: Floats, past: Floats) -> Floats:
        """Forces (R,) [N] at voltages (R,) [V] that are held, of actuators that have visited others (R, H) [V] before;
        numbers of the law may be one of each."""
        return np.array([self.force([v], tuple(row))[0] for v, row in zip(volts, past, strict=True)])

    def late(self, track: Track, history: Sequence[float], late: Floats | None = None, seconds: float = 0.0) -> Floats:
        """What lags (nl,) [N] have come to after so many seconds of the track of one run, from what they were at its
        start; of a law that only goes by the order of voltages there are none."""
        return np.zeros(0)

    def small_signal_gain(self) -> Floats:
        """Ascending powers (3,) of the voltage in the gain [N/V] of a small signal about it.

        The slope of the force just after the voltage turned, while what the law remembers stays as it is; by
        reciprocity also the gain [C/m] from motion to charge.
        """
        cubic = self.parts(linear_track([0.0, 1.0], [1.0], [0.0], periodic=False), (1.0,)).law[0]
        return cubic[1:] * np.arange(1.0, 4.0)

    @property
    def has_memory(self) -> bool:
        """True if the force depends on the voltages before."""
        return True

    @property
    def by_rate(self) -> bool:
        """True if it depends on when they were there: `channels` then lowers one run at a time, of plain numbers."""
        return False


class Cubic(Description):
    """A cubic polynomial of the voltage: constant + linear V + quadratic V^2 + cubic V^3."""

    constant: Amount = quantity("N", "force at 0 V", default=0.0)
    linear: Amount = quantity("N/V", "gain on V", default=0.0)
    quadratic: Amount = quantity("N/V^2", "gain on V^2", default=0.0)
    cubic: Amount = quantity("N/V^3", "gain on V^3", default=0.0)

    def coefficients(self) -> Floats:
        """(4,), ascending; (nr, 4) where a number is one a run."""
        return columns((self.constant, self.linear, self.quadratic, self.cubic))

    def __call__(self, volts: ArrayLike) -> Floats:
        """Force [N] at `volts` [V], any shape."""
        v = np.asarray(volts, dtype=np.float64)
        return ((self.cubic * v + self.quadratic) * v + self.linear) * v + self.constant
