"""What periodic waveforms share."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.columns import alike
from tarsus.base.spec import Amount, quantity
from tarsus.model.drive.signal import Signal


class Periodic(Signal):
    """Base of the periodic waveforms."""

    amplitude: Amount = quantity("V", "half of the peak-to-peak voltage", ge=0)
    frequency: Amount = quantity("Hz", "frequency of repetition", gt=0)
    phase: Amount = quantity("rad", "phase at t = 0", default=0.0)
    offset: Amount = quantity("V", "voltage added", default=0.0)

    @property
    def period(self) -> float:
        """Period [s]."""
        return 1.0 / self.frequency

    def periods(self) -> Any:
        """Of every run (nr,) [s]."""
        return alike(self.period)[0]

    def cycles(self, time: Floats) -> Floats:
        """Position within the cycle, in [0, 1)."""
        return np.remainder(np.remainder(self.frequency * time, 1.0) + self.phase / (2.0 * math.pi), 1.0)
