"""Whether motion and drive were recorded by one clock: sweeps up and down pass a frequency at different times.
Whether all records begin alike: compared with the others, a sweep whose trigger was late is turned along the frequency.

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
from tarsus.identify.with_error import UNKNOWN, WithError
from tarsus.model.drive.waveforms import SweptSine
from tarsus.records.measurement import Measurement, Quantity

PACE = 1e-6
"""Share that is corrected at least: in a record of two seconds it moves the end by two microseconds."""
_MOST = 2e-3
"""Share beyond which it is no clock's, but a wrong sampling rate."""
_FINE = 16
"""Places a sample between which a sweep is taken for a cubic: it reaches nearly to half the sampling rate."""
_TURN = 0.2
"""Part of a turn of the most turned line, at the largest share, from which on sweeps show a pace."""
_GATHERED = 0.1
"""Part of a turn within which lines are taken together."""
_LATEST = 4.0
"""Samples by which the start of a sweep may be off another's: a trigger is late by one or two."""
_TURNED = 0.1
"""Turn [rad], root mean square, that pace and starts may leave: of sound sweeps at 40 dB they leave 0.003, and where
samples were lost on the way 0.27."""
_STARTS = 0.02
"""Samples by which starts are off at least to be corrected: less than a twentieth of the motion's noise at 40 dB, and
over several sweeps less again."""


@dataclass(frozen=True)
class Clocks:
    """What sweeps say of the clocks of motion and drive.

    pace: share by which steps between samples of the motion are longer than those of the drive, unknown where all
    sweeps pass all frequencies at the same times; starts [s]: by the source of its record, how much later than in the
    mean of the sweeps the motion of each comes behind its drive; empty where all begin alike; lost: both explain only a
    part of how the sweeps are turned, since samples of the motion were lost.
    """

    pace: WithError = UNKNOWN
    starts: dict[str, float] = field(default_factory=dict)
    lost: bool = False


@dataclass(frozen=True)
class _Pair:
    """A sweep compared with the first: frequency (nb,) [Hz], the time between (nb,) [s] at which they pass it, and the
    strength and turn of its response over the first's (nb,)."""

    frequency: Floats
    apart: Floats
    response: NDArray[np.complex128]


def clocks_of(sweeps: Sequence[tuple[Measurement, SweptSine]]) -> Clocks:
    """Clocks of motion and drive, from records with their sweeps."""
    found = [(k, pair) for k in range(1, len(sweeps)) if (pair := _paired(sweeps[0], sweeps[k])) is not None]
    if not found:
        return Clocks()
    pairs, rows = [pair for _, pair in found], []
    for k, one in enumerate(pairs):
        late = -one.frequency[:, None] * np.eye(len(pairs))[k]
        rows.append(2.0 * np.pi * np.column_stack([one.frequency * one.apart, late]))
    design, weight = np.concatenate(rows), np.concatenate([np.abs(one.response) for one in pairs])
    turned = np.concatenate([np.unwrap(np.angle(one.response)) for one in pairs])
    if np.abs(design[:, 0]).max() * _MOST < 2.0 * np.pi * _TURN:
        design[:, 0] = 0.0  # all pass all frequencies at the same times: they do not show a pace
    (pace,), _ = _fitted(design[:, :1], turned, weight)
    (freely, *late), left = _fitted(design, turned, weight)
    lost = left > _TURNED
    if not lost and not any(one.off(0.0, _STARTS * sweeps[0][0].step) for one in late):
        return Clocks(pace)
    values = dict(zip((0, *(k for k, _ in found)), (0.0, *(one.value for one in late)), strict=True))
    mean = sum(values.values()) / len(values)
    return Clocks(freely, {sweeps[k][0].source: one - mean for k, one in values.items()}, lost)


def _fitted(design: Floats, turned: Floats, weight: Floats) -> tuple[list[WithError], float]:
    """Weighted least squares of turns (n,) by columns (n, p), a column of zeros having no value; and the root mean
    square that is left."""
    inverse = np.linalg.pinv((design.T * weight) @ design)
    values = inverse @ (design.T @ (weight * turned))
    left = turned - design @ values
    errors = np.sqrt(np.sum((inverse @ (design.T * (weight * left))) ** 2, axis=1))
    errors = np.where(design.any(axis=0), errors, np.inf)
    pairs = zip(values.tolist(), errors.tolist(), strict=True)
    return [WithError(*one) for one in pairs], float(np.sqrt(np.average(left**2, weights=weight)))


def _paired(first: tuple[Measurement, SweptSine], other: tuple[Measurement, SweptSine]) -> _Pair | None:
    """A sweep compared with the first, all channels together, lines that turn alike as one; None where they cannot be
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
