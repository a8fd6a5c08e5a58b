"""Waveforms: the voltage [V] on an actuator over time t >= 0 [s].

Periodic waveforms repeat for ever; the others hold their last value.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from tarsus.drive.sampled import Sampled
from tarsus.drive.signal import Signal
from tarsus.drive.track import (
    Track,
    constant_track,
    linear_track,
    polyline_track,
    sine_track,
    swept_track,
)
from tarsus.errors import InputError
from tarsus.explain import PathErrors
from tarsus.spec import quantity

__all__ = [
    "Constant",
    "OnOff",
    "Poling",
    "Ramp",
    "RampedSquare",
    "Sampled",
    "Signal",
    "Sine",
    "Square",
    "SweptSine",
    "Waveform",
]

Floats = NDArray[np.float64]


class _Periodic(Signal):
    """What periodic waveforms share."""

    amplitude: float = quantity("V", "half of the peak-to-peak voltage", ge=0)
    frequency: float = quantity("Hz", "frequency of repetition", gt=0)
    phase: float = quantity("rad", "phase at t = 0", default=0.0)
    offset: float = quantity("V", "voltage added", default=0.0)

    @property
    def period(self) -> float:
        """Period [s]."""
        period = 1.0 / self.frequency
        if not math.isfinite(3.0 * period):
            raise InputError(f"a frequency of {self.frequency!r} Hz is too low: its period overflows")
        return period

    def _cycles(self, time: Floats) -> Floats:
        """Position within the cycle, in [0, 1)."""
        return np.remainder(np.remainder(self.frequency * time, 1.0) + self.phase / (2.0 * math.pi), 1.0)


class Sine(_Periodic):
    """offset + amplitude sin(2 pi frequency t + phase)."""

    kind: Literal["sine"] = "sine"

    def volts(self, time: Floats) -> Floats:
        """Voltage [V] at `time` [s], any shape."""
        cycles = np.remainder(self.frequency * np.asarray(time, dtype=np.float64), 1.0)
        return self.offset + self.amplitude * np.sin(2.0 * math.pi * cycles + self.phase)

    def track(self) -> Track:
        """Monotone stretches of one period."""
        return sine_track(self.amplitude, self.period, self.phase, self.offset)


class Square(_Periodic):
    """Square wave: offset + amplitude for the fraction `duty` of each period, then offset - amplitude."""

    kind: Literal["square"] = "square"
    duty: float = quantity("1", "fraction of the period at the upper level", default=0.5, ge=0, le=1)

    def volts(self, time: Floats) -> Floats:
        """Voltage [V] at `time` [s], any shape; on an edge the value after it."""
        high = self._cycles(np.asarray(time, dtype=np.float64)) < self.duty
        return self.offset + np.where(high, self.amplitude, -self.amplitude)

    def track(self) -> Track:
        """Plateaus of one period."""
        top, bottom = self.offset + self.amplitude, self.offset - self.amplitude
        if top == bottom or self.duty in (0.0, 1.0):
            return constant_track(top if self.duty else bottom)
        levels = [top, bottom]
        return polyline_track(
            [0.0, self.duty, 1.0], levels, levels, self.phase / (2.0 * math.pi), self.period
        )


class RampedSquare(_Periodic):
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
    duty: float = quantity("1", "lambda: fraction of half a period that each ramp takes", ge=0, le=1)

    def volts(self, time: Floats) -> Floats:
        """Voltage [V] at `time` [s], any shape."""
        x = np.remainder(self._cycles(np.asarray(time, dtype=np.float64)) - 0.25, 1.0)
        triangle = 4.0 * np.abs(x - 0.5) - 1.0
        if self.duty == 0.0:
            shape = np.where((x < 0.25) | (x >= 0.75), 1.0, -1.0)
        else:
            shape = np.clip(triangle / self.duty, -1.0, 1.0)
        return self.offset + self.amplitude * shape

    def track(self) -> Track:
        """Ramps and plateaus of one period."""
        top, bottom = self.offset + self.amplitude, self.offset - self.amplitude
        if top == bottom:
            return constant_track(top)
        w = 0.25 * self.duty
        edges = [-w, w, 0.5 - w, 0.5 + w, 1.0 - w]
        first, last = [bottom, top, top, bottom], [top, top, bottom, bottom]
        return polyline_track(edges, first, last, self.phase / (2.0 * math.pi), self.period)


class Constant(Signal):
    """One voltage for ever."""

    kind: Literal["constant"] = "constant"
    level: float = quantity("V", "the voltage")

    def volts(self, time: Floats) -> Floats:
        """Voltage [V] at `time` [s], any shape."""
        return np.full(np.shape(time), self.level)

    def track(self) -> Track:
        """One constant stretch."""
        return constant_track(self.level)


class Ramp(Signal):
    """A straight ramp from `start` to `stop`, then `stop` held."""

    kind: Literal["ramp"] = "ramp"
    start: float = quantity("V", "voltage at t = 0", default=0.0)
    stop: float = quantity("V", "voltage at the end of the ramp, held afterwards")
    duration: float = quantity("s", "time the ramp takes", gt=0)

    def volts(self, time: Floats) -> Floats:
        """Voltage [V] at `time` [s], any shape."""
        return np.interp(time, [0.0, self.duration], [self.start, self.stop])

    def track(self) -> Track:
        """The ramp and the hold."""
        return linear_track([0.0, self.duration], [self.start], [self.stop], periodic=False, hold=True)


class SweptSine(Signal):
    """A sine whose frequency runs linearly from one value to another; its last value is held afterwards.

    V = offset + amplitude sin(2 pi (f0 t + (f1 - f0) t^2 / (2 duration))).
    """

    kind: Literal["swept_sine"] = "swept_sine"
    amplitude: float = quantity("V", "half of the peak-to-peak voltage", ge=0)
    start_frequency: float = quantity("Hz", "frequency at t = 0", gt=0)
    stop_frequency: float = quantity("Hz", "frequency at the end", gt=0)
    duration: float = quantity("s", "time the sweep takes", gt=0)
    offset: float = quantity("V", "voltage added", default=0.0)

    def volts(self, time: Floats) -> Floats:
        """Voltage [V] at `time` [s], any shape."""
        t = np.minimum(np.asarray(time, dtype=np.float64), self.duration)
        rate = (self.stop_frequency - self.start_frequency) / self.duration
        cycles = np.remainder((self.start_frequency + 0.5 * rate * t) * t, 1.0)
        return self.offset + self.amplitude * np.sin(2.0 * math.pi * cycles)

    def track(self) -> Track:
        """Half cycles of the sweep, and the hold."""
        return swept_track(
            self.amplitude, self.start_frequency, self.stop_frequency, self.duration, self.offset
        )


class OnOff(Signal):
    """A sequence of constant voltages, each for its duration; repeated for ever, or the last one held."""

    kind: Literal["on_off"] = "on_off"
    levels: tuple[float, ...] = quantity("V", "voltages in order")
    durations: tuple[float, ...] = quantity("s", "time each voltage lasts", gt=0)
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


class Poling(Signal):
    """A voltage held to pole the film, a straight fall to 0 V, then 0 V (2.3.2: 10 V held, then released)."""

    kind: Literal["poling"] = "poling"
    level: float = quantity("V", "poling voltage")
    hold: float = quantity("s", "time the poling voltage is held", gt=0)
    fall: float = quantity("s", "time of the fall to 0 V; 0 is a step", default=0.0, ge=0)

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


Waveform = Annotated[
    Sine | Square | RampedSquare | Ramp | SweptSine | OnOff | Poling | Sampled | Constant,
    Field(discriminator="kind"),
]
"""Any waveform; `kind` tells which."""
