"""Voltages one after the other."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import model_validator

from tarsus.base.arrays import Floats
from tarsus.base.columns import columns
from tarsus.base.messages import PathErrors
from tarsus.base.spec import Amounts, quantity
from tarsus.model.drive.signal import Signal
from tarsus.model.drive.track import Track, chosen, linear_track


class OnOff(Signal):
    """A sequence of constant voltages, each for its duration; repeated for ever, or the last one held."""

    kind: Literal["on_off"] = "on_off"
    levels: Amounts = quantity("V", "voltages in order")
    durations: Amounts = quantity("s", "time each voltage lasts", gt=0)
    repeat: bool = False

    @model_validator(mode="after")
    def _check_lengths(self) -> OnOff:
        if not self.levels:
            raise PathErrors([("levels", "expected at least one voltage, got none")])
        if len(self.levels) != len(self.durations):
            text = f"expected {len(self.levels)} durations, one a level, got {len(self.durations)}"
            raise PathErrors([("durations", text)])
        return self

    def volts(self, time: Floats) -> Floats:
        """Voltage [V] at `time` [s], any shape; on an edge the value after it."""
        t = np.asarray(time, dtype=np.float64)
        ends = np.cumsum(self.durations)
        if self.repeat:
            t = np.remainder(t, ends[-1])
        index = np.searchsorted(ends, t, side="right")
        return np.array(self.levels)[np.minimum(index, len(ends) - 1)]

    def track(self) -> Track:
        """The plateaus."""
        levels, durations = (
            np.stack([one]) if one.ndim == 1 else one for one in map(columns, (self.levels, self.durations))
        )
        start = np.concatenate([0.0 * durations[:, :1], np.cumsum(durations, axis=1)], axis=1)
        once = (levels == levels[:, :1]).all(axis=1) if self.repeat else True
        return chosen(
            once,
            lambda: linear_track(start, levels, levels, periodic=False, hold=True),
            lambda: linear_track(start, levels, levels, periodic=True),
        )
