"""A sine."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.model.drive.track import Track, sine_track
from tarsus.model.drive.waveforms.periodic import Periodic


class Sine(Periodic):
    """offset + amplitude sin(2 pi frequency t + phase)."""

    kind: Literal["sine"] = "sine"

    def rate(self) -> Sine:
        """A sine again, a quarter of a turn ahead."""
        turns = 2.0 * math.pi * self.frequency
        now = {"amplitude": turns * self.amplitude, "phase": self.phase + 0.5 * math.pi, "offset": 0.0 * turns}
        return self.model_copy(update=now)

    def volts(self, time: Floats) -> Floats:
        """Voltage [V] at `time` [s], any shape."""
        cycles = np.remainder(self.frequency * np.asarray(time, dtype=np.float64), 1.0)
        return self.offset + self.amplitude * np.sin(2.0 * math.pi * cycles + self.phase)

    def track(self) -> Track:
        """Monotone stretches of one period."""
        return sine_track(self.amplitude, self.period, self.phase, self.offset)
