"""What every waveform offers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tarsus.base.spec import Description
from tarsus.model.drive.track import Track, TrackSlopes

__all__ = ["Signal"]


class Signal(Description, ABC):
    """Base of the waveforms: a voltage [V] of time t >= 0 [s]."""

    @property
    def period(self) -> float | None:
        """Period [s], None if the waveform does not repeat."""
        track = self.track()
        return track.period if track.periodic else None

    @abstractmethod
    def volts(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """Voltage [V] at `time` [s], any shape."""

    @abstractmethod
    def track(self) -> Track:
        """The voltage as monotone stretches in closed form."""

    def sloped(self, moves: Mapping[str, NDArray[np.float64]]) -> tuple[Track, TrackSlopes] | None:
        """The track, cut wherever it may come to have a kink, and its derivatives in closed form; None without one.

        moves: by name of a field of n numbers, how these move (n, P) along P directions.
        """
        return None
