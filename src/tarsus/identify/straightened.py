"""Sweeps as a drive without hysteresis and curvature would have made them: its force, as volts, for the volts.

A force that bends by a thousandth excites the modes by its harmonics, which no spread between sweeps that are alike
shows: it moves damping ratios by parts of a thousandth, and a film whose damping adds to theirs by a hundred times as
much.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.signal import resample

from tarsus.base.arrays import Floats
from tarsus.identify.drive_check import fit_drive
from tarsus.identify.foot import FootModel
from tarsus.model.drive.waveforms import Waveform
from tarsus.records.measurement import Measurement

_FINE = 8
"""Places from sample to sample at which the law is asked. A sweep reaches nearly to half the sampling rate, and plays
stay where its first turn has left them: sixteen places a period miss it by two percent at most."""


def straightened(
    records: Sequence[Measurement], drives: Sequence[tuple[float, Waveform]], model: FootModel
) -> list[Measurement]:
    """Records with the force of the model's law in place of their volts, in volts of the law's mean slope over all.

    Between its samples a drive is the one that was meant, as it fits them, and what they deviate from it. The samples
    alone do not suffice: of a sine that begins or ends at once Fourier's series overshoots, and plays keep that. One
    slope for all, for a mean of responses that differ by factors has ripples where their drives do.

    Drive and motions are their changes from sample to sample, whose ratio is the same: plays let a sweep end at another
    rest than it began at, which is no motion of the Fourier transform's period. Unless all have a known drive that
    moves they stay.

    Parameters
    ----------
    records
        Sweeps.
    drives
        Of each the time before its drive begins [s], and the drive that was meant.
    model
        With the law.
    """
    forces, top, bottom = [], 0.0, 0.0
    for record, (rest, signal) in zip(records, drives, strict=True):
        volts = np.zeros(1) if record.drive is None else record[record.drive]
        fit = fit_drive(volts, record.step, rest, signal)
        if record.drive is None or fit is None:
            return list(records)
        time = record.step / _FINE * np.arange(_FINE * len(volts), dtype=np.float64)
        fine = fit.meant(signal, rest, time, record.step)
        fine += _resampled(volts - fit.fitted, len(fine))
        forces.append(np.asarray(model.law.force(fine, model.history), dtype=np.float64))
        top += float((fine - fine.mean()) @ forces[-1])
        bottom += float(np.var(fine)) * len(fine)
    if top == 0.0 or bottom == 0.0:
        return list(records)
    out = []
    for record, force in zip(records, forces, strict=True):
        values = np.diff(record.values, axis=1, prepend=record.values[:, :1])
        values[record.index(str(record.drive))] = _increments(bottom / top * force, record.count)
        out.append(replace(record, values=values))
    return out


def _resampled(values: Floats, count: int) -> Floats:
    """Values (n,) at ``count`` places of the same stretch of time, by Fourier's series of their deviations from the
    line through their ends."""
    line = np.polynomial.Polynomial([values[0], (values[-1] - values[0]) / (len(values) - 1)])
    places = np.arange(count) * (len(values) / count)
    return np.asarray(resample(values - line(np.arange(len(values))), count)) + line(places)


def _increments(fine: Floats, count: int) -> Floats:
    """Changes over ``count`` steps of what has ``_FINE`` values a step, as far as these are slower than half the steps'
    rate. Of changes from a rest to a rest the Fourier transform's period makes no jump, whatever lies between."""
    turn = np.exp(-2.0j * np.pi * np.arange(1, count // 2 + 1) / count)
    spectrum = np.fft.rfft(np.diff(fine, prepend=fine[0]))[: count // 2 + 1]
    spectrum[1:] *= (1.0 - turn) / (1.0 - turn ** (1.0 / _FINE))
    spectrum[0] *= _FINE
    return np.fft.irfft(spectrum, count) / _FINE
