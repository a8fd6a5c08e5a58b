"""Whether motion and drive were recorded by one clock: sweeps up and down pass a frequency at different times.
Whether all records begin alike: a sweep whose trigger was late is turned along the frequency beside the others.

Motion recorded in steps that are longer than stated by a share p is what happened ``p t`` later: at a frequency f,
which a sweep passes at t(f), its response is turned by ``2 pi f p t(f)``, another angle in every sweep. A structure,
and the memory of a drive, turn the responses of all sweeps alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import resample

from tarsus.base.arrays import Floats
from tarsus.identify.with_error import UNTOLD, WithError
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
_GATHERED = 0.1
"""Part of a turn within which lines are taken together."""
_LATEST = 4.0
"""Samples by which the start of a sweep may be off another's: a trigger is late by one or two."""
_FIRST = 0.25
"""Samples between the delays that are tried: an eighth of a turn at the highest frequency."""
_TURNED = 0.1
"""Turn [rad], root mean square, that pace and starts may leave: of sound sweeps at 40 dB they leave 0.003, and where
samples were lost on the way 0.27."""
_STARTS = 0.02
"""Samples by which starts are off at least to be taken off: less than a twentieth of the motion's noise at 40 dB, and
over several sweeps less again."""


@dataclass(frozen=True)
class Clocks:
    """What sweeps say of the clocks of motion and drive.

    pace: share by which steps between samples of the motion are longer than those of the drive, untold where all sweeps
    pass all frequencies at the same times; starts [s]: by the source of its record, how much later than in the mean of
    the sweeps the motion of each comes behind its drive; empty where all begin alike; lost: both explain only a
    part of how the sweeps are turned, since samples of the motion were lost.
    """

    pace: WithError = UNTOLD
    starts: dict[str, float] = field(default_factory=dict)
    lost: bool = False


@dataclass(frozen=True)
class _Pair:
    """A sweep beside the first: frequency (nb,) [Hz], the time apart (nb,) [s] at which they pass it, and the strength
    and turn of its response over the first's (nb,)."""

    frequency: Floats
    apart: Floats
    response: NDArray[np.complex128]

    def turned(self, pace: float, late: float) -> NDArray[np.complex128]:
        """The response without what a pace and a delay turn it by."""
        return self.response * np.exp(-2.0j * np.pi * self.frequency * (pace * self.apart - late))


def clocks_of(sweeps: Sequence[tuple[Measurement, SweptSine]]) -> Clocks:
    """Clocks of motion and drive, from records with their sweeps."""
    found = [(k, pair) for k in range(1, len(sweeps)) if (pair := _paired(sweeps[0], sweeps[k])) is not None]
    if not found:
        return Clocks()
    pairs = [pair for _, pair in found]
    apart = any(np.abs(one.apart * one.frequency).max() * _MOST > _TURN for one in pairs)
    step = sweeps[0][0].step
    pace, *_ = _fitted(pairs, apart, np.zeros(1))
    freely, *late = _fitted(pairs, apart, np.arange(-_LATEST, _LATEST + 1e-9, _FIRST) * step)
    off = [np.angle(one.turned(freely.value, its.value)) for one, its in zip(pairs, late, strict=True)]
    weight = np.abs(np.concatenate([one.response for one in pairs]))
    lost = bool(np.average(np.concatenate(off) ** 2, weights=weight) > _TURNED**2)
    if not lost and not any(one.off(0.0, _STARTS * step) for one in late):
        return Clocks(pace)
    values = dict(zip((0, *(k for k, _ in found)), (0.0, *(one.value for one in late)), strict=True))
    mean = sum(values.values()) / len(values)
    starts = {sweeps[k][0].source: one - mean for k, one in values.items()}
    return Clocks(freely, starts, lost)


def _fitted(pairs: Sequence[_Pair], apart: bool, lates: Floats) -> list[WithError]:
    """The pace, and how late each pair is [s]: the best of a search, and linear steps from there. Without times apart
    the pace stays zero, and so do delays that are not searched: these are untold."""
    most = max(float(np.abs(one.apart * one.frequency).max()) for one in pairs)
    paces = np.arange(-_MOST, _MOST, _TURN / most) if apart else np.zeros(1)
    fits, best = np.zeros(len(paces)), []
    for one in pairs:
        turned = one.response * np.exp(-2.0j * np.pi * np.outer(paces, one.frequency * one.apart))
        size = (turned @ np.exp(2.0j * np.pi * np.outer(one.frequency, lates))).real
        fits += size.max(axis=1)
        best.append(lates[np.argmax(size, axis=1)])
    at = int(np.argmax(fits))
    values = np.array([paces[at], *(one[at] for one in best)])
    free = np.array([apart, *[len(lates) > 1] * len(pairs)])
    design = []
    for k, one in enumerate(pairs):
        rows = np.zeros((len(one.frequency), len(values)))
        rows[:, 0], rows[:, 1 + k] = one.frequency * one.apart, -one.frequency
        design.append(2.0 * np.pi * rows[:, free])
    rows, weight = np.concatenate(design), np.concatenate([np.abs(one.response) for one in pairs])
    inverse, off = np.linalg.pinv((rows.T * weight) @ rows), weight
    for _ in range(_ROUNDS):
        off = np.concatenate(
            [np.angle(one.turned(values[0], late)) for one, late in zip(pairs, values[1:], strict=True)]
        )
        values[free] += inverse @ (rows.T @ (weight * off))
    errors = np.full(len(values), np.inf)
    errors[free] = np.sqrt(np.sum((inverse @ (rows.T * (weight * off))) ** 2, axis=1))
    return [WithError(*one) for one in zip(values.tolist(), errors.tolist(), strict=True)]


def _paired(first: tuple[Measurement, SweptSine], other: tuple[Measurement, SweptSine]) -> _Pair | None:
    """A sweep beside the first, all channels together, lines that turn alike as one; None where they cannot be
    compared."""
    (a, _), (b, _) = first, other
    if a.drive is None or b.drive is None or a.count != b.count or a.step != b.step:
        return None
    frequency = np.asarray(np.fft.rfftfreq(a.count, a.step), dtype=np.float64)
    ends = [sorted((one.start_frequency, one.stop_frequency)) for _, one in (first, other)]
    low, high = max(one[0] for one in ends), min(one[1] for one in ends)
    band = (frequency > low) & (frequency < high)
    if not band.any():
        return None
    volts = [np.fft.rfft(one[one.drive or ""])[band] for one in (a, b)]
    total = np.zeros(np.count_nonzero(band), dtype=np.complex128)
    for k, channel in enumerate(a.channels):
        if channel.quantity in (Quantity.DISPLACEMENT, Quantity.VELOCITY) and channel.name in b.names:
            moved = [np.fft.rfft(one)[band] for one in (a.values[k], b[channel.name])]
            both = moved[1] * np.conj(volts[1]) * np.conj(moved[0]) * volts[0]
            total += both / np.sqrt(np.abs(both).mean() * np.maximum(np.abs(both), 1e-300))
    inside = frequency[band]
    apart = _passed(other[1], inside) - _passed(first[1], inside)
    width = _GATHERED / (2.0 * _MOST * max(first[1].duration, other[1].duration) + _LATEST * a.step)
    group = ((inside - inside[0]) / width).astype(np.intp)
    count = np.bincount(group)
    response = np.bincount(group, total.real) + 1.0j * np.bincount(group, total.imag)
    return _Pair(np.bincount(group, inside) / count, np.bincount(group, apart) / count, response)


def _passed(sweep: SweptSine, frequency: Floats) -> Floats:
    """Times [s] at which a sweep passes frequencies."""
    return sweep.duration * (frequency - sweep.start_frequency) / (sweep.stop_frequency - sweep.start_frequency)


def stretched(volts: Floats, slow: float) -> Floats:
    """Volts (ns,) of a sweep at the times of steps that are longer by a share."""
    fine = np.asarray(resample(np.concatenate([volts, volts[::-1]]), 2 * _FINE * len(volts)))
    place = np.arange(len(volts)) * (1.0 + slow)
    return CubicSpline(np.arange(len(fine)) / _FINE, fine)(place)
