"""Validation on signals that no step has seen (section 2.5): what a record shows of contacts, against a simulation.

Record and simulation are judged by the same rules, at the noise of the record: a foot counts as in contact where it
stands still at the contact level within five standard deviations, and where it meets it. What counts as a bounce is
counted by `tarsus.measure`, as for a run.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.identify.foot import FootModel
from tarsus.identify.step import Curve, Panel
from tarsus.identify.traces import Trace
from tarsus.impacts.detection import STILL, impacts_at_ground
from tarsus.measure import RESOLUTION, Counting, Flights
from tarsus.measure.history import Knots, KnownHistories, Points
from tarsus.measure.periods import by_window
from tarsus.measure.table import periods_used
from tarsus.model.drive.waveforms import Waveform
from tarsus.solve import ResultCode, simulate


@dataclass(frozen=True)
class ContactMeans:
    """Means over drive periods after transients: bounces; contact duration [s] a period; peak [m] over contact level;
    counting: what a flight had to clear and the dwell before it; periods counted."""

    bounces: float
    contact: float
    peak: float
    counting: Counting
    periods: int


@dataclass(frozen=True)
class Comparison:
    """One held-out record: its set and file, what was measured and simulated, and their series for a figure.

    periods: drive periods in the record; off: root mean square of the foot's measured less simulated motion over
    that of the measured one."""

    name: str
    file: str
    measured: ContactMeans
    simulated: ContactMeans
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


@dataclass(frozen=True)
class Moved:
    """A foot over the contact level, measured and simulated: time [s], heights [m] and speeds [m/s] (ns,)."""

    time: Floats
    seen: Floats
    felt: Floats
    height: Floats
    speed: Floats

    @property
    def off(self) -> float:
        """Root mean square of the measured less the simulated motion over that of the measured one."""
        apart, whole = np.mean((self.seen - self.height) ** 2), np.mean((self.seen - self.seen.mean()) ** 2)
        return float(np.sqrt(apart / whole))


def contacts_of(
    time: Floats, height: Floats, speed: Floats, period: float, noise_x: float, noise_v: float
) -> ContactMeans:
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
    if time[-1] + step < period * (1.0 - 1e-9):
        raise InputError(f"a record of {time[-1]:.3g} s is shorter than the drive's period of {period:.3g} s")
    (skipped,), (count,) = periods_used(np.array([time[-1] + step]), np.array([period]), None)
    counting = Counting.of(period, max(RESOLUTION, STILL * noise_x))
    history = _history(time, height, speed, noise_x, noise_v, counting.height)
    found = by_window(history, period * np.arange(skipped, count + 1, dtype=float), counting)
    values = (np.nan_to_num(found[name]) for name in ("bounces", "contact_duration", "peak"))
    bounces, contact, peak = (float(by_period.mean()) for by_period in values)
    return ContactMeans(bounces, contact, peak, counting, int(count - skipped))


def _history(
    time: Floats, height: Floats, speed: Floats, noise_x: float, noise_v: float, seen: float
) -> KnownHistories:
    """What a record shows of a foot: it stands where it is still at the contact level, from half a sample before
    to half a sample after, it touches where an impact is seen, and flies between. Heights below ``seen`` [m] are
    noise."""
    step, end = float(time[1] - time[0]), float(2.0 * time[-1] - time[-2])
    impacts, near = impacts_at_ground(height, speed, noise_x, noise_v, step)
    turns = np.diff(np.concatenate([[0], near.astype(int), [0]]))
    touched = time[impacts] + 0.5 * step
    starts = np.concatenate([time[turns[:-1] == 1] - 0.5 * step, touched])
    ends = np.concatenate([time[np.flatnonzero(turns == -1) - 1] + 0.5 * step, touched])
    order = np.argsort(starts, kind="stable")
    begin, until = starts[order], np.maximum.accumulate(ends[order]) if len(order) else ends
    apart = np.append(True, begin[1:] > until[:-1]) if len(begin) else np.zeros(0, dtype=bool)
    landing, leaving = begin[apart], until[np.append(apart[1:], True)] if len(begin) else until
    airborne, aloft = not near[0], not near[-1]
    flight_start = np.append(0.0, leaving) if airborne else leaving
    flight_end = np.append(landing if airborne else landing[1:], end)
    if not aloft:
        flight_start, flight_end = flight_start[:-1], flight_end[:-1]
    first, last = np.searchsorted(time, flight_start), np.searchsorted(time, flight_end, side="right")
    tops = [a + int(np.argmax(height[a:b])) if b > a else -1 for a, b in zip(first, last, strict=True)]
    apex = np.array([height[k] if k >= 0 else 0.0 for k in tops])
    rebound = np.isin(flight_start, touched)
    above = height > seen
    flights = Flights(
        np.array([0, len(apex)]), flight_start, flight_end, apex, time[tops], rebound, np.array([end]),
        np.array([airborne]), np.array([aloft]),
    )  # fmt: skip
    return KnownHistories(
        flights, _points(touched, np.abs(speed[impacts])), _points(time[above], height[above]),
        Knots(np.zeros(2, dtype=np.intp), np.zeros(0), np.zeros(0)),
    )  # fmt: skip


def _points(time: Floats, value: Floats) -> Points:
    return Points(np.zeros(len(time), dtype=np.intp), time, value)


def moved(model: FootModel, trace: Trace, signal: Waveform, level: float, until: float = np.inf) -> Moved:
    """A record from the begin of its drive, up to a time [s], beside a simulation of the device with that drive.

    level: contact level from the rest [m]. Raises InputError for a simulation that does not reach its end.
    """
    driven = (trace.time >= -1e-9) & (trace.time <= until)
    time = np.maximum(trace.time[driven], 0.0)
    run = simulate(model.driven(signal), float(time[-1]) + trace.step)
    if run.ended is not ResultCode.DONE:
        raise InputError(
            f"{trace.file}: the identified device cannot be simulated with this drive: {run.ended}"
        )
    states, k = run.states(time), trace.point(model.foot_point)
    seen, felt = model.normal * (trace.x[k, driven] - level), model.normal * trace.v[k, driven]
    return Moved(time, seen, felt, model.gap + model.row @ states.x, model.row @ states.v)


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
    both = moved(model, trace, signal, level)
    time, k = both.time, trace.point(model.foot_point)
    noise = float(trace.noise_x[k]), float(trace.noise_v[k])
    curves = (Curve("measured", time, both.seen), Curve("simulated", time, both.height))
    return Comparison(
        trace.set,
        trace.file,
        contacts_of(time, both.seen, both.felt, period, *noise),
        contacts_of(time, both.height, both.speed, period, *noise),
        max(int((float(time[-1]) + trace.step) / period * (1.0 + 1e-9)), 1),
        both.off,
        Panel(trace.set, "time", "s", "gap", "m", curves),
    )
