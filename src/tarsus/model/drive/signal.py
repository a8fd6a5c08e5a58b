"""What every waveform offers."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from tarsus.base.dual import Dual
from tarsus.base.spec import Description
from tarsus.model.drive.track import Track

__all__ = ["Signal"]


class Signal(Description, ABC):
    """Base of the waveforms: a voltage [V] of time t >= 0 [s]."""

    @property
    def period(self) -> float | None:
        """Period [s], None if the waveform does not repeat; (nr,) of numbers that are one a run, NaN there."""
        periods = self.track().periods
        if len(periods) > 1 or isinstance(periods, Dual):
            return periods
        return None if np.isnan(periods[0]) else float(periods[0])

    @abstractmethod
    def volts(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """Voltage [V] at `time` [s], any shape."""

    @abstractmethod
    def track(self) -> Track:
        """The voltage as monotone stretches in closed form.

        Numbers of the waveform may be arrays (nr,), one number a run, and carry derivatives (`tarsus.base.dual`): what
        `tarsus.model.drive.track` builds takes either, and what is reckoned from them by numpy is of all runs at once.
        """
