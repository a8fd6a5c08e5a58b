"""Electrical energy of charging actuators: C dV^2 for every rise of a voltage.

A supply at the voltage that a rise of dV ends at gives the charge C dV there, and so the energy C dV^2 above what it
would have given at the rise's start: half of it is lost in the leads at once, half is stored and lost when the voltage
falls again. Over whole periods this is what is drawn, whatever the voltage is counted from. Every rise from a low to
the next high counts as one such switching, however slow: a drive without charge recovery gains nothing by ramps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from tarsus.measure.segments import Floats
    from tarsus.model.drive.signal import Signal
    from tarsus.model.drive.track import Track
    from tarsus.model.robot import Drive


@dataclass(frozen=True)
class _Rises:
    """Rises of a voltage: when each ends [s] first, after which time it comes again [s], infinite if never, and its
    square [V^2]."""

    time: Floats
    square: Floats
    period: Floats


def charging_energy(drive: Drive, signal: Signal, edges: Floats) -> Floats:
    """Electrical energy (np,) [J] that a drive draws from its supply between instants ``edges`` (np + 1,) [s].

    C dV^2 for every rise, less the share of the charge that is recovered; NaN where the voltage of a drive without
    capacitance rises.
    """
    squares = rise_squares(signal, edges)
    if drive.capacitance is None:
        return np.where(squares > 0.0, np.nan, 0.0)
    return drive.capacitance * (1.0 - (drive.recovery or 0.0)) * squares


def rise_squares(signal: Signal, edges: Floats) -> Floats:
    """Sum (np,) [V^2] of the squares of the rises that end between instants ``edges`` (np + 1,) [s].

    A rise at an instant counts after it. A voltage that repeats from t = 0 on counts as if it always had; any other
    starts at 0 V.
    """
    rises = _rises(signal)  # pyright: ignore[reportArgumentType]  # frozen, so that it has a hash
    if not len(rises.time):
        return np.zeros(len(edges) - 1)
    before = np.asarray(edges)[:, None] - rises.time
    again = np.isfinite(rises.period)
    seen = np.where(
        again, np.ceil(before / np.where(again, rises.period, 1.0) - 1e-9), before > 1e-9 * (edges[-1] - edges[0])
    )
    return np.diff(np.maximum(seen, 0.0) @ rises.square)


def squares_per_period(track: Track) -> Floats:
    """Sum (nr,) [V^2] of the squares of the rises in a period of each run of a track that repeats from its start, as
    `rise_squares` has it over whole periods; NaN of runs that do not repeat, or only later on."""
    counts, out = np.diff(track.runs), np.full(len(track.loops), np.nan)
    for count in np.unique(counts):
        runs = np.flatnonzero((counts == count) & (track.loops == 0))
        own = track.runs[runs, None] + np.arange(count)
        volts = np.stack([track.first[own], track.last[own]], axis=-1).reshape(len(runs), 2 * count)
        turn = (np.argmin(volts, axis=1)[:, None] + np.arange(2 * count + 1)) % (2 * count)
        steps = np.diff(np.take_along_axis(volts, turn, axis=1), axis=1)
        rise, total = np.zeros(len(runs)), np.zeros(len(runs))
        for step in steps.T:  # from a lowest voltage on, once around, where no rise is open
            ended = step < 0.0
            total += np.where(ended, rise**2, 0.0)
            rise = np.where(ended, 0.0, rise + np.maximum(step, 0.0))
        out[runs] = total
    return out


@lru_cache(maxsize=1024)
def _rises(signal: Signal) -> _Rises:
    track = signal.track()
    loops_late = track.periodic and track.loop > 0
    if loops_late:  # through what comes once, then the first of what repeats, a period of it, and how that goes on
        track = track.twice().twice()
    volts = np.column_stack([track.first, track.last]).ravel()
    times = np.column_stack([track.start[:-1], track.start[1:]]).ravel()
    if not track.periodic:
        volts, times = np.append(0.0, volts), np.append(0.0, times)
    elif not loops_late:  # from a lowest voltage on, once around
        first = int(np.argmin(volts))
        volts = np.concatenate([volts[first:], volts[: first + 1]])
        times = np.concatenate([times[first:], times[: first + 1] + track.start[-1]])
    moved = np.append(True, np.diff(volts) != 0.0)
    volts, times = volts[moved], times[moved]
    rising = np.append(np.diff(volts) > 0.0, False)
    starts = np.flatnonzero(rising & ~np.append(False, rising[:-1]))
    ends = np.flatnonzero(~rising & np.append(False, rising[:-1]))
    when, square = times[ends], (volts[ends] - volts[starts]) ** 2
    if loops_late:
        end, slack = track.start[track.loop], 1e-12 * track.start[-1]
        whole = when <= end + slack
        when, square = when[whole], square[whole]
        period = np.where(when > end - track.period + slack, track.period, math.inf)
    elif track.periodic:
        when, period = when % track.period, np.full(len(when), track.period)
    else:
        period = np.full(len(when), math.inf)
    return _Rises(when, square, period)
