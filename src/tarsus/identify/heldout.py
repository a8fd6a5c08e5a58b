"""Validation on signals that no step has seen (section 2.5): the motion of the foot, against a simulation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.identify.foot import FootModel
from tarsus.identify.step import Curve, Panel
from tarsus.identify.traces import Trace
from tarsus.model.drive.waveforms import Waveform


@dataclass(frozen=True)
class Comparison:
    """One held-out record: its set and file, and both motions for a figure.

    periods: drive periods in the record; off: root mean square of the foot's measured less simulated motion over that
    of the measured one; over: the same over what the record's noise leaves."""

    name: str
    file: str
    periods: int
    off: float
    over: float
    panel: Panel


@dataclass(frozen=True)
class Moved:
    """A foot over the contact level, measured and simulated: time [s], seen and simulated heights [m] (ns,)."""

    time: Floats
    seen: Floats
    height: Floats

    @property
    def off(self) -> float:
        """Root mean square of the measured less the simulated motion over that of the measured one."""
        apart, whole = np.mean((self.seen - self.height) ** 2), np.mean((self.seen - self.seen.mean()) ** 2)
        return float(np.sqrt(apart / whole))


def moved(model: FootModel, trace: Trace, signal: Waveform, level: float, until: float = np.inf) -> Moved:
    """A record from the begin of its drive, up to a time [s], compared with a simulation of the device with that drive.

    level: contact level from the rest [m]. Raises InputError for a simulation that does not reach its end.
    """
    driven = (trace.time >= -1e-9) & (trace.time <= until)
    time = np.maximum(trace.time[driven], 0.0)
    states = model.states(model.driven(signal), float(time[-1]) + trace.step, time)
    seen = model.normal * (trace.x[trace.point(model.foot_point), driven] - level)
    return Moved(time, seen, model.gap + model.row @ states.x)


def compare(model: FootModel, trace: Trace, signal: Waveform, level: float) -> Comparison:
    """A held-out record against a simulation of the identified device.

    Parameters
    ----------
    model
        The device as identified.
    trace
        The record.
    signal
        Its drive.
    level
        Contact level from the rest [m].

    Raises
    ------
    InputError
        For a simulation that does not reach its end.
    """
    both, k = moved(model, trace, signal, level), trace.point(model.foot_point)
    noise, lasts = float(trace.noise_x[k] / np.std(both.seen)), float(both.time[-1]) + trace.step
    curves = (Curve("measured", both.time, both.seen), Curve("simulated", both.time, both.height))
    return Comparison(
        trace.set,
        trace.file,
        max(int(lasts / (signal.period or lasts) * (1.0 + 1e-9)), 1),
        both.off,
        both.off / noise if noise > 0.0 else np.inf,
        Panel(trace.set, "time", "s", "gap", "m", curves),
    )
