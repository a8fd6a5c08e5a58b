"""Sweeps as a drive without hysteresis and curvature would have made them: its force, as volts, for the volts.

A force that bends by a thousandth excites the modes by its harmonics, which no spread between sweeps that are alike
shows: it moves damping ratios by parts of a thousandth, and a film that is felt beside that damping by a hundred times
as much.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import resample

from tarsus.identify.foot import FootModel
from tarsus.records.measurement import Measurement

Floats = NDArray[np.float64]

_FINE = 4
"""Places from sample to sample at which the law is asked: a sweep reaches nearly to half the sampling rate, and its
second harmonic to the whole."""


def straightened(record: Measurement, model: FootModel) -> Measurement:
    """A record with the force of the model's law in place of its volts, in volts of the law's mean slope.

    Drive and motions are their changes from sample to sample, whose ratio is the same: plays let a sweep end at another
    rest than it began at, which is no motion of the Fourier transform's period. A record without a known drive, or
    whose volts do not move, stays.
    """
    if record.drive is None:
        return record
    volts = record[record.drive]
    fine = _resampled(volts, _FINE * len(volts))
    force = np.asarray(model.law.force(fine, model.history), dtype=np.float64)
    spread = float(np.var(fine))
    slope = float(np.mean((fine - fine.mean()) * force)) / spread if spread > 0.0 else 0.0
    if slope == 0.0:
        return record
    values = record.values.copy()
    values[record.index(record.drive)] += _resampled(force / slope - fine, len(volts))
    return replace(record, values=np.diff(values, axis=1, prepend=values[:, :1]))


def _resampled(values: Floats, count: int) -> Floats:
    """Values (n,) at ``count`` places of the same stretch of time, by Fourier's series of what they are beside the line
    through their ends."""
    line = np.polynomial.Polynomial([values[0], (values[-1] - values[0]) / (len(values) - 1)])
    places = np.arange(count) * (len(values) / count)
    return np.asarray(resample(values - line(np.arange(len(values))), count)) + line(places)
