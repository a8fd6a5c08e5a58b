"""What every waveform offers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from tarsus.base.quantities import Quantity
from tarsus.base.spec import Description
from tarsus.model.drive.track import Track


class Signal(Description, ABC):
    """Base of the waveforms: a voltage [V] of time t >= 0 [s], or what else is ``measured``
    (`tarsus.model.drive.other_units`)."""

    measured: ClassVar[Quantity] = Quantity.VOLTAGE
    """What its values are."""

    def rate(self) -> Signal | None:
        """The waveform of its derivative by time, where that is one of the same kind in closed form; else None."""
        return None

    @property
    def remarks(self) -> tuple[str, ...]:
        """Sentences on what is read otherwise than a reader of the description may think."""
        return ()

    @property
    def period(self) -> float | None:
        """Period [s], None if the waveform does not repeat."""
        period = float(self.periods()[0])
        return None if np.isnan(period) else period

    def periods(self) -> Any:
        """The same of every run (nr,), where numbers are one a run; NaN where one does not repeat."""
        return self.track().periods

    @abstractmethod
    def volts(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """Voltage [V] at `time` [s], any shape."""

    @abstractmethod
    def track(self) -> Track:
        """The voltage as monotone stretches in closed form.

        Numbers of the waveform may be arrays (nr,), one number a run: what `tarsus.model.drive.track` builds takes
        either, and what is reckoned from them by numpy is of all runs at once.
        """
