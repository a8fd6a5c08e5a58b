"""A voltage held, then released."""

from __future__ import annotations

from typing import Literal

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.spec import Amount, quantity
from tarsus.model.drive.signal import Signal
from tarsus.model.drive.track import Track, linear_track


class Poling(Signal):
    """A voltage held to pole the film, a straight fall to 0 V, then 0 V (2.3.2: 10 V held, then released)."""

    kind: Literal["poling"] = "poling"
    level: Amount = quantity("V", "poling voltage")
    hold: Amount = quantity("s", "time the poling voltage is held", gt=0)
    fall: Amount = quantity("s", "time of the fall to 0 V; 0 is a step", default=0.0, ge=0)

    def volts(self, time: Floats) -> Floats:
        """Voltage [V] at `time` [s], any shape."""
        t = np.asarray(time, dtype=np.float64)
        if self.fall == 0.0:
            return np.where(t < self.hold, self.level, 0.0)
        return np.interp(t, [self.hold, self.hold + self.fall], [self.level, 0.0])

    def track(self) -> Track:
        """Hold, fall and rest."""
        times = [0.0, self.hold, self.hold + self.fall]
        return linear_track(times, [self.level, self.level], [self.level, 0.0], periodic=False, hold=True)
