"""A square wave with ramps for edges."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.spec import Amount, quantity
from tarsus.model.drive.track import Track, chosen, constant_track, polyline_track
from tarsus.model.drive.waveforms.periodic import Periodic


class RampedSquare(Periodic):
    """Ramped square wave of Fig. 2.6: a symmetric trapezoid with straight ramps of equal length up and down.

    The figure is missing from the source's text, which says only that the duty variable lambda "determines
    the slope of the input signal" and uses lambda = 25 % at 5 Hz (Figs 2.8, 2.10). The reading taken here:
    each ramp lasts the fraction lambda of half a period, lambda / (2 frequency), and each plateau the rest
    of it, so that lambda = 0 is the square wave and lambda = 1 the triangle wave; 25 % at 5 Hz ramps for 25
    ms and stays for 75 ms. The slope is 4 amplitude frequency / lambda. Ramps are centred on the edges of
    the square wave with the same amplitude and phase: at phase 0 the voltage passes the offset upwards at t
    = 0.
    """

    kind: Literal["ramped_square"] = "ramped_square"
    duty: Amount = quantity("1", "lambda: fraction of half a period that each ramp takes", ge=0, le=1)

    def volts(self, time: Floats) -> Floats:
        """Voltage [V] at `time` [s], any shape."""
        x = np.remainder(self.cycles(np.asarray(time, dtype=np.float64)) - 0.25, 1.0)
        triangle = 4.0 * np.abs(x - 0.5) - 1.0
        if self.duty == 0.0:
            shape = np.where((x < 0.25) | (x >= 0.75), 1.0, -1.0)
        else:
            shape = np.clip(triangle / self.duty, -1.0, 1.0)
        return self.offset + self.amplitude * shape

    def track(self) -> Track:
        """Ramps and plateaus of one period."""
        top, bottom = self.offset + self.amplitude, self.offset - self.amplitude
        w = 0.25 * self.duty
        edges = [-w, w, 0.5 - w, 0.5 + w, 1.0 - w]
        first, last = [bottom, top, top, bottom], [top, top, bottom, bottom]
        begin = self.phase / (2.0 * math.pi)
        return chosen(
            top == bottom, lambda: constant_track(top), lambda: polyline_track(edges, first, last, begin, self.period)
        )
