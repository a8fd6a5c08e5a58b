"""Whether motion and drive were recorded by one clock: sweeps up and down pass a frequency at different times.

Motion recorded in steps that are longer than stated by a share p is what happened ``p t`` later: at a frequency f,
which a sweep passes at t(f), its response is turned by ``2 pi f p t(f)``, another angle in every sweep. A structure,
and the memory of a drive, turn the responses of all sweeps alike.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import resample

from tarsus.base.arrays import Floats
from tarsus.identify.with_error import WithError
from tarsus.model.drive.waveforms import SweptSine
from tarsus.records.measurement import Measurement, Quantity

PACE = 1e-6
"""Share that is taken off at least: in a record of two seconds it moves the end by two microseconds."""
_MOST = 2e-3
"""Share beyond which it is no clock's, but a wrong sampling rate."""
_FINE = 16
"""Places a sample between which a sweep is taken for a cubic: it reaches nearly to half the sampling rate."""
_TURN = 0.2
"""Part of a turn of the most turned line between the shares that are tried."""
_ROUNDS = 3
"""Linear steps to the best share, from within a fifth of a turn of it."""


def pace_of(sweeps: Sequence[tuple[Measurement, SweptSine]]) -> WithError | None:
    """Share by which steps between samples of the motion are longer than those of the drive, from records with their
    sweeps; None where all sweeps pass all frequencies at the same times."""
    found = [one for k in range(1, len(sweeps)) for one in _turned(sweeps[0], sweeps[k])]
    if not found:
        return None
    angle, turns = (np.concatenate(one) for one in zip(*found, strict=True))
    tried = np.arange(-_MOST, _MOST, _TURN / (np.abs(turns).max() / (2.0 * np.pi)))
    turn, strength = _gathered(turns, angle)
    fits = [float(np.sum(strength * np.exp(-1.0j * turn * one)).real) for one in tried]
    pace, weight = float(tried[int(np.argmax(fits))]), np.abs(angle)
    bottom = float(np.sum(weight * turns**2))
    off = np.zeros(0)
    for _ in range(_ROUNDS):
        off = np.angle(angle * np.exp(-1.0j * turns * pace))
        pace += float(np.sum(weight * turns * off)) / bottom
    return WithError(pace, float(np.sqrt(np.sum((weight * turns * off) ** 2)) / bottom))


def _gathered(turns: Floats, angle: NDArray[np.complex128]) -> tuple[Floats, NDArray[np.complex128]]:
    """Lines that turn alike, to a hundredth of a turn at the largest share, as one: how they turn, and their sum."""
    width = 2.0 * np.pi * 0.01 / _MOST
    low = float(turns.min())
    at = ((turns - low) / width).astype(np.intp)
    total = np.bincount(at, angle.real) + 1.0j * np.bincount(at, angle.imag)
    return low + width * (np.arange(len(total), dtype=np.float64) + 0.5), total


def _turned(
    first: tuple[Measurement, SweptSine], other: tuple[Measurement, SweptSine]
) -> list[tuple[NDArray[np.complex128], Floats]]:
    """By channel, the response of one sweep over the first's (nl,), as strong as both, and by how much it turns per
    share of the clock [rad] (nl,)."""
    (a, _), (b, _) = first, other
    if a.drive is None or b.drive is None or a.count != b.count or a.step != b.step:
        return []
    frequency = np.asarray(np.fft.rfftfreq(a.count, a.step), dtype=np.float64)
    ends = [sorted((one.start_frequency, one.stop_frequency)) for _, one in (first, other)]
    low, high = max(one[0] for one in ends), min(one[1] for one in ends)
    band = (frequency > low) & (frequency < high)
    apart = _passed(other[1], frequency[band]) - _passed(first[1], frequency[band])
    if not band.any() or not np.abs(apart).max() * high * _MOST > _TURN:
        return []
    turns = 2.0 * np.pi * frequency[band] * apart
    volts = [np.fft.rfft(one[one.drive or ""])[band] for one in (a, b)]
    out = []
    for k, channel in enumerate(a.channels):
        if channel.quantity in (Quantity.DISPLACEMENT, Quantity.VELOCITY) and channel.name in b.names:
            moved = [np.fft.rfft(one)[band] for one in (a.values[k], b[channel.name])]
            both = moved[1] * np.conj(volts[1]) * np.conj(moved[0]) * volts[0]
            out.append((both / np.sqrt(np.abs(both).mean() * np.maximum(np.abs(both), 1e-300)), turns))
    return out


def _passed(sweep: SweptSine, frequency: Floats) -> Floats:
    """Times [s] at which a sweep passes frequencies."""
    return (
        sweep.duration * (frequency - sweep.start_frequency) / (sweep.stop_frequency - sweep.start_frequency)
    )


def stretched(volts: Floats, slow: float) -> Floats:
    """Volts (ns,) of a sweep at the times of steps that are longer by a share."""
    fine = np.asarray(resample(np.concatenate([volts, volts[::-1]]), 2 * _FINE * len(volts)))
    place = np.arange(len(volts)) * (1.0 + slow)
    return CubicSpline(np.arange(len(fine)) / _FINE, fine)(place)
