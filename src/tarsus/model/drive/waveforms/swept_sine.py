"""A sine whose frequency changes."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.spec import Amount, quantity
from tarsus.model.drive.signal import Signal
from tarsus.model.drive.track import Track, swept_track


class SweptSine(Signal):
    """A sine whose frequency runs linearly from one value to another; its last value is held afterwards.

    V = offset + amplitude sin(2 pi (f0 t + (f1 - f0) t^2 / (2 duration))).
    """

    kind: Literal["swept_sine"] = "swept_sine"
    amplitude: Amount = quantity("V", "half of the peak-to-peak voltage", ge=0)
    start_frequency: Amount = quantity("Hz", "frequency at t = 0", gt=0)
    stop_frequency: Amount = quantity("Hz", "frequency at the end", gt=0)
    duration: Amount = quantity("s", "time the sweep takes", gt=0)
    offset: Amount = quantity("V", "voltage added", default=0.0)

    def volts(self, time: Floats) -> Floats:
        """Voltage [V] at `time` [s], any shape."""
        t = np.minimum(np.asarray(time, dtype=np.float64), self.duration)
        rate = (self.stop_frequency - self.start_frequency) / self.duration
        cycles = np.remainder((self.start_frequency + 0.5 * rate * t) * t, 1.0)
        return self.offset + self.amplitude * np.sin(2.0 * math.pi * cycles)

    def track(self) -> Track:
        """Half cycles of the sweep, and the hold."""
        return swept_track(self.amplitude, self.start_frequency, self.stop_frequency, self.duration, self.offset)
