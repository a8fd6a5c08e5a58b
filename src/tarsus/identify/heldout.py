"""Validation on signals that no step has seen (section 2.5): what a record shows of contacts, against a simulation.

Record and simulation are judged by the same rules, at the noise of the record: a foot counts as in contact where it
stands still at the contact level within five standard deviations.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tarsus.drive.waveforms import Waveform
from tarsus.errors import InputError
from tarsus.identify.bounce import impacts_of
from tarsus.identify.foot import FootModel
from tarsus.identify.step import Curve, Panel
from tarsus.identify.traces import STILL, Trace
from tarsus.solve import simulate

__all__ = ["Comparison", "Contacts", "compare", "contacts_of"]

Floats = NDArray[np.float64]

RESOLUTION = 1e-7
"""Height [m] that a bounce must clear at least, as in `tarsus.measure`; noise may ask for more."""

_ALWAYS = 0.999
"""Part of the time in contact from which a foot counts as held throughout, with a peak of 0."""


@dataclass(frozen=True)
class Contacts:
    """Means over drive periods after transients: bounces; contact duration [s] a period; peak [m] over contact level;
    resolution [m] that a bounce had to clear; periods counted."""

    bounces: float
    contact: float
    peak: float
    resolution: float
    periods: int


@dataclass(frozen=True)
class Comparison:
    """One held-out record: its set and file, what was measured and simulated, and their series for a figure.

    periods: drive periods in the record; off: root mean square of the foot's measured less simulated motion over
    that of the measured one."""

    name: str
    file: str
    measured: Contacts
    simulated: Contacts
    periods: int
    off: float
    panel: Panel

    def error(self, which: str) -> float:
        """(measured - simulated) / measured of "bounces", "contact" or "peak"; NaN where nothing was measured and
        something simulated, 0 where both are nothing."""
        measured, simulated = float(getattr(self.measured, which)), float(getattr(self.simulated, which))
        if measured == 0.0:
            return 0.0 if simulated == 0.0 else np.nan
        return (measured - simulated) / measured


def contacts_of(
    time: Floats, height: Floats, speed: Floats, period: float, noise_x: float, noise_v: float
) -> Contacts:
    """What the motion of a foot over the ground shows.

    Parameters
    ----------
    time
        Times [s] (ns,), 0 where the drive begins.
    height, speed
        Of the foot over the contact level [m], [m/s].
    period
        Of the drive [s].
    noise_x, noise_v
        Standard deviations of the record's samples.

    Raises
    ------
    InputError
        If the record is shorter than a period.
    """
    step = float(time[1] - time[0])
    count = int(np.floor((time[-1] + step) / period * (1.0 + 1e-9)))
    if count < 1:
        raise InputError(f"a record of {time[-1]:.3g} s is shorter than the drive's period of {period:.3g} s")
    skipped = (count + 2) // 3 if count > 1 else 0
    impacts, _ = impacts_of(height, speed, noise_x, noise_v, step)
    near = (np.abs(height) < STILL * noise_x) & (np.abs(speed) < STILL * noise_v)
    resolution = max(RESOLUTION, STILL * noise_x)
    ends = np.append(np.flatnonzero(np.diff(near.astype(int)) == 1), len(time) - 1)
    bounced = []
    for i in impacts:
        stop = min([int(e) for e in (*impacts, *ends) if e > i], default=len(time) - 1)
        if height[i : stop + 1].max(initial=0.0) > resolution:
            bounced.append(time[i])
    edges = period * np.arange(skipped, count + 1)
    inside = (time >= edges[0]) & (time < edges[-1])
    held = float(near[inside].mean()) > _ALWAYS
    peaks = [float(height[(time >= a) & (time < b)].max(initial=0.0)) for a, b in pairwise(edges)]
    periods = len(edges) - 1
    return Contacts(
        float(np.histogram(bounced, bins=edges)[0].mean()),
        float(np.count_nonzero(near & inside) * step / periods),
        0.0 if held else float(np.mean(peaks)),
        resolution,
        periods,
    )


def compare(model: FootModel, trace: Trace, signal: Waveform, level: float) -> Comparison:
    """A held-out record against a simulation of the identified device.

    Parameters
    ----------
    model
        The device as identified.
    trace
        The record.
    signal
        Its drive, periodic.
    level
        Contact level from the rest [m].

    Raises
    ------
    InputError
        For a drive without a period, or a simulation that does not reach its end.
    """
    period = signal.period
    if period is None:
        raise InputError(f"{trace.file}: a held-out signal must be periodic, to be judged by period")
    driven = trace.time >= -1e-9
    time = np.maximum(trace.time[driven], 0.0)
    run = simulate(model.driven(signal), float(time[-1]) + trace.step)
    if not run.ok:
        raise InputError(
            f"{trace.file}: the identified device cannot be simulated with this drive: {run.code}"
        )
    states = run.states(time)
    k, normal = trace.point(model.foot_point), model.normal
    height, speed = model.gap + model.row @ states.x, model.row @ states.v
    seen, felt = normal * (trace.x[k, driven] - level), normal * trace.v[k, driven]
    noise = float(trace.noise_x[k]), float(trace.noise_v[k])
    curves = (Curve("measured", time, seen), Curve("simulated", time, height))
    return Comparison(
        trace.set,
        trace.file,
        contacts_of(time, seen, felt, period, *noise),
        contacts_of(time, height, speed, period, *noise),
        max(int((float(time[-1]) + trace.step) / period * (1.0 + 1e-9)), 1),
        float(np.sqrt(np.mean((seen - height) ** 2) / np.mean((seen - seen.mean()) ** 2))),
        Panel(trace.set, "time", "s", "gap", "m", curves),
    )
