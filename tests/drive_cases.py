"""Waveforms and laws that the drive's tests share."""

from __future__ import annotations

import math

import numpy as np

from tarsus.model.drive.laws import Cubic, TwoBranch
from tarsus.model.drive.signal import Signal
from tarsus.model.drive.waveforms import Constant, OnOff, Poling, Ramp, RampedSquare, Sampled, Sine, Square, SweptSine
from tarsus.model.drive.waveforms.sampled import Interpolation

RISING = Cubic(constant=1.4796e-6, linear=-0.7057e-6, quadratic=-0.0255e-6, cubic=0.0016e-6)
FALLING = Cubic(constant=-0.6350e-6, linear=-0.6062e-6, quadratic=0.0076e-6)
PRINTED = TwoBranch(rising=RISING, falling=FALLING)
WAVEFORMS: dict[str, Signal] = {
    "sine": Sine(amplitude=8.0, frequency=50.0),
    "sine-phase": Sine(amplitude=3.0, frequency=7.3, phase=2.1, offset=-1.5),
    "sine-cosine": Sine(amplitude=3.0, frequency=7.3, phase=math.pi / 2),
    "square": Square(amplitude=8.0, frequency=50.0),
    "square-duty": Square(amplitude=4.0, frequency=11.0, duty=0.3, phase=1.0, offset=1.0),
    "ramped": RampedSquare(amplitude=8.0, frequency=5.0, duty=0.25),
    "ramped-phase": RampedSquare(amplitude=8.0, frequency=5.0, duty=0.7, phase=4.0, offset=2.0),
    "triangle": RampedSquare(amplitude=2.0, frequency=3.0, duty=1.0, phase=0.3),
    "ramp": Ramp(start=-8.0, stop=8.0, duration=0.02),
    "chirp": SweptSine(amplitude=8.0, start_frequency=1.0, stop_frequency=40.0, duration=0.5),
    "chirp-down": SweptSine(amplitude=2.0, start_frequency=90.0, stop_frequency=3.0, duration=0.4, offset=1.0),
    "on-off": OnOff(levels=(8.0, 0.0, -3.0), durations=(0.01, 0.02, 0.005)),
    "on-off-repeat": OnOff(levels=(8.0, 0.0, -3.0), durations=(0.01, 0.02, 0.005), repeat=True),
    "poling": Poling(level=10.0, hold=0.3, fall=0.1),
    "poling-step": Poling(level=10.0, hold=0.3),
    "constant": Constant(level=5.0),
    "samples": Sampled(times=(0.01, 0.02, 0.05, 0.06), levels=(1.0, 5.0, 5.0, -7.0)),
    "spline": Sampled(
        times=(0.0, 0.02, 0.03, 0.06, 0.07), levels=(1.0, 5.0, 5.0, -7.0, 0.0), interpolation=Interpolation.CUBIC
    ),
}


def jumps(waveform: Signal) -> np.ndarray:
    """Times at which the voltage jumps, within two periods or until it is held."""
    track = waveform.track()
    if track.periodic:
        track = track.twice()
    edges = track.start[1:-1][track.first[1:] != track.last[:-1]]
    period = waveform.period
    if period is None or track.first[0] == track.last[-1]:
        return edges
    return np.concatenate([edges, [0.0, period, 2.0 * period]])


def grid(waveform: Signal, count: int = 4001) -> np.ndarray:
    """Times over two periods, or until well after the hold began, that stay clear of jumps."""
    track = waveform.track()
    end = 2.0 * track.start[-1] if track.periodic else track.start[-1] * 1.2
    t = np.linspace(0.0, end, count)
    clear = np.ones(len(t), dtype=bool)
    for edge in jumps(waveform):
        clear &= np.abs(t - edge) > 1e-9 * end
    return t[clear]
