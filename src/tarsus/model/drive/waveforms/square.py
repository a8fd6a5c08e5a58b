"""A square wave."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.spec import Amount, quantity
from tarsus.model.drive.track import Track, chosen, constant_track, polyline_track
from tarsus.model.drive.waveforms.periodic import Periodic


class Square(Periodic):
    """Square wave: offset + amplitude for the fraction `duty` of each period, then offset - amplitude."""

    kind: Literal["square"] = "square"
    duty: Amount = quantity("1", "fraction of the period at the upper level", default=0.5, ge=0, le=1)

    def volts(self, time: Floats) -> Floats:
        """Voltage [V] at `time` [s], any shape; on an edge the value after it."""
        high = self.cycles(np.asarray(time, dtype=np.float64)) < self.duty
        return self.offset + np.where(high, self.amplitude, -self.amplitude)

    def track(self) -> Track:
        """Plateaus of one period."""
        top, bottom = self.offset + self.amplitude, self.offset - self.amplitude
        never = self.duty == 0.0
        constant = (top == bottom) | never | (self.duty == 1.0)
        edges, levels, begin = [0.0, self.duty, 1.0], [top, bottom], self.phase / (2.0 * math.pi)
        return chosen(
            constant,
            lambda: constant_track(np.where(never, bottom, top)),
            lambda: polyline_track(edges, levels, levels, begin, self.period),
        )
