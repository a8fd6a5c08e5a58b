"""A ramp that is held."""

from __future__ import annotations

from typing import Literal

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.spec import Amount, quantity
from tarsus.model.drive.signal import Signal
from tarsus.model.drive.track import Track, linear_track


class Ramp(Signal):
    """A straight ramp from `start` to `stop`, then `stop` held."""

    kind: Literal["ramp"] = "ramp"
    start: Amount = quantity("V", "voltage at t = 0", default=0.0)
    stop: Amount = quantity("V", "voltage at the end of the ramp, held afterwards")
    duration: Amount = quantity("s", "time the ramp takes", gt=0)

    def volts(self, time: Floats) -> Floats:
        """Voltage [V] at `time` [s], any shape."""
        return np.interp(time, [0.0, self.duration], [self.start, self.stop])

    def track(self) -> Track:
        """The ramp and the hold."""
        return linear_track([0.0, self.duration], [self.start], [self.stop], periodic=False, hold=True)
