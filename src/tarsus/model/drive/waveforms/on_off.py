"""Voltages one after the other."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator

from tarsus.base.messages import PathErrors
from tarsus.base.spec import Amounts, quantity
from tarsus.model.drive.signal import Signal
from tarsus.model.drive.track import Track, TrackSlopes, linear_track, lines

__all__ = ["OnOff"]

Floats = NDArray[np.float64]


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
        start = np.concatenate([[0.0], np.cumsum(self.durations)])
        repeat = self.repeat and len(set(self.levels)) > 1
        return linear_track(start, self.levels, self.levels, periodic=repeat, hold=not repeat)

    def sloped(self, moves: Mapping[str, Floats]) -> tuple[Track, TrackSlopes] | None:
        """The plateaus with their derivatives by levels and durations; None for a level that repeats for ever."""
        if not set(moves) <= {"levels", "durations"} or (self.repeat and len(set(self.levels)) == 1):
            return None
        none = np.zeros((len(self.levels), next(iter(moves.values())).shape[1]))
        times = np.concatenate([[0.0], np.cumsum(self.durations)])
        later = np.concatenate([none[:1], np.cumsum(moves.get("durations", none), axis=0)])
        levels, by = np.array(self.levels), moves.get("levels", none)
        return lines(times, levels, levels, TrackSlopes(later, by, by), periodic=self.repeat)
