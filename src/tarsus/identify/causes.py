"""Causes with a line of their own: what an instrument, or the mains, adds to the motion in the air.

Each leaves a trace, or a few, in a record beside the identified device, known but for its size. What else may differ
from a model has no end, and is not guessed at.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_trapezoid

from tarsus.base.arrays import Floats
from tarsus.identify.airborne import AirRecord
from tarsus.identify.checks import GROUND, LAW, LOAD, STRUCTURE

_MAINS = (50.0, 60.0)
"""Frequencies of mains [Hz]."""


@dataclass(frozen=True)
class Cause:
    """A cause of what the air leaves unexplained.

    said: in words, ``{:.3g}`` for what is estimated; columns: the traces it leaves in a record, each for as much of it
    as is believed possible; size: of that, in the unit of the words, NaN where no number is given; touches: parts of
    the paths of the numbers that depend on it; record: what to record for it.
    """

    said: str
    columns: Callable[[AirRecord], list[Floats]]
    size: float
    touches: tuple[str, ...]
    record: str


def _late(x: float, v: float) -> Callable[[AirRecord], list[Floats]]:
    """So many times 20 us by which displacements and velocities are late; nothing of a delay that was found of the
    instruments, whose error is free beside all causes."""

    def columns(air: AirRecord) -> list[Floats]:
        found = air.instruments is not None and (air.instruments.late if v else air.instruments.lags)
        return [] if found and x else [air.seen(-20e-6 * x * air.moved[1], -20e-6 * v * air.moved[2])]

    return columns


def _clock(air: AirRecord) -> list[Floats]:
    late = -1e-3 * air.time
    return [air.seen(late * air.moved[1], late * air.moved[2])]


def _by_channel(seen: Floats) -> list[Floats]:
    """Displacements and velocities (2 np, nt), each channel alone."""
    return [np.where(np.arange(len(seen))[:, None] == k, seen, 0.0) for k in range(len(seen))]


def _gains(air: AirRecord) -> list[Floats]:
    return _by_channel(0.05 * np.concatenate(air.moved[:2]))


def _coupled(air: AirRecord) -> list[Floats]:
    """Behind a high-pass of 1 Hz displacements, and velocities, lack so much of their own integral."""
    x, v = (-2.0 * np.pi * cumulative_trapezoid(one, air.time, initial=0.0, axis=1) for one in air.moved[:2])
    return [air.seen(x, 0.0), air.seen(0.0, v)]


def _hum(air: AirRecord) -> list[Floats]:
    """Lines of the mains in the displacements, a hundredth of their motion high, in both phases."""
    size = 0.01 * air.moved[0].std(axis=1, keepdims=True)
    phases = (2.0 * np.pi * hertz * air.time for hertz in _MAINS)
    return [air.seen(size * turn(one), 0.0) for one in phases for turn in (np.sin, np.cos)]


def _saturated(air: AirRecord) -> list[Floats]:
    """A hundredth of the largest motion by which its channel falls short there, with the cube."""
    seen = np.concatenate(air.moved[:2])
    return _by_channel(-0.01 * seen**3 / np.maximum(np.abs(seen).max(axis=1, keepdims=True), 1e-300) ** 2)


_DRIVEN = LOAD, LAW, GROUND
_ALL = STRUCTURE, *_DRIVEN
_TRIGGER = "record drive and motion by one converter, or measure the delay of each channel"
CAUSES = (
    Cause(
        "the displacements are {:.3g} us late behind the voltage: a delay of their channels",
        _late(1.0, 0.0),
        20.0,
        _DRIVEN,
        _TRIGGER,
    ),
    Cause(
        "the velocities are {:.3g} us late behind the voltage: a delay of their channels",
        _late(0.0, 1.0),
        20.0,
        _ALL,
        _TRIGGER,
    ),
    Cause(
        "all motion is {:.3g} us late behind the voltage: a delay, or a low-pass filter, between the two",
        _late(1.0, 1.0),
        20.0,
        _ALL,
        _TRIGGER,
    ),
    Cause("the clock of the motion is {:.3g} ppm slower than that of the voltage", _clock, 1e3, _ALL, _TRIGGER),
    Cause("a gain of a channel is wrong", _gains, np.nan, _DRIVEN, "calibrate the gain of every channel"),
    Cause(
        "displacements or velocities are behind a high-pass, as if coupled by a capacitor",
        _coupled,
        np.nan,
        _ALL,
        "record with channels that are coupled by direct current",
    ),
    Cause("mains hum stands in the displacements", _hum, np.nan, _DRIVEN, "repeat the records without the mains' hum"),
    Cause(
        "a channel saturates: it falls short where motion is largest",
        _saturated,
        np.nan,
        _DRIVEN,
        "repeat the records with a wider range of the channels",
    ),
)
"""All of them."""
