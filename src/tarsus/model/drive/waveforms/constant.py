"""A constant voltage."""

from __future__ import annotations

from typing import Literal

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.spec import Amount, quantity
from tarsus.model.drive.signal import Signal
from tarsus.model.drive.track import Track, constant_track


class Constant(Signal):
    """One voltage for ever."""

    kind: Literal["constant"] = "constant"
    level: Amount = quantity("V", "the voltage")

    def rate(self) -> Constant:
        """Nothing."""
        return self.model_copy(update={"level": 0.0 * self.level})

    def volts(self, time: Floats) -> Floats:
        """Voltage [V] at `time` [s], any shape."""
        return np.full(np.shape(time), self.level)

    def track(self) -> Track:
        """One constant stretch."""
        return constant_track(self.level)
