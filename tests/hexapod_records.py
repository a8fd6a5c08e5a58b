"""Synthetic vibrometer records of the printed hexapod, near the ground and in the air; each run is made once."""

from __future__ import annotations

from functools import cache

import numpy as np

import tarsus as ts
from printed_robots import POINTS, hexapod, printed
from tarsus.records.measurement import Channel, Measurement, Quantity
from tarsus.solve import Run
from tarsus.synthesis.vibrometer import Vibrometer

RESTITUTION = 0.51


@cache
def runs(duration: float = 0.06) -> tuple[Run, Run]:
    """Near the ground (10 um) and in the air, 10 V square at 20 Hz."""
    near = hexapod(signal=ts.Square(amplitude=10.0, frequency=20.0), restitution=RESTITUTION)
    far = ts.with_values(near, {"robot.feet.foot1.gap": 0.03})
    return ts.simulate(near, duration), ts.simulate(far, duration)


@cache
def vibrometer(decibels: float = 40.0) -> Vibrometer:
    """200 kHz, triggered up to a sample late."""
    return Vibrometer(jitter=5e-6).at_level(runs()[0], POINTS, decibels)


@cache
def records(seed: int = 1, decibels: float = 40.0) -> tuple[Measurement, Measurement]:
    """A close and an in-air record."""
    close, in_air = runs()
    instrument = vibrometer(decibels)
    return instrument.measure(close, POINTS, 2 * seed), instrument.measure(in_air, POINTS, 2 * seed + 1)


def structure() -> ts.Lumped:
    """The printed hexapod's structure."""
    found = runs()[0].scene.robot.structure
    assert isinstance(found, ts.Lumped)
    return found


def true_column() -> np.ndarray:
    """Velocity changes (6,) per unit change at foot 1, of an impulse at it."""
    mobility = np.linalg.inv(printed()[0])[:, 0]
    return mobility / mobility[0]


def measurement(*rows: np.ndarray, step: float = 1e-5, noise: float | None = None) -> Measurement:
    """Velocities of channels ``a``, ``b``, ... ."""
    channels = tuple(Channel("abcdef"[i], Quantity.VELOCITY, noise=noise) for i in range(len(rows)))
    return Measurement(channels, np.array(rows), step)
