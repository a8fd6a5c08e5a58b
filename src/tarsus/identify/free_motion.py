"""What the motion in the air leaves unexplained by the identified device, linear in what may differ.

From the rest up to the first contact a record is motion in the air from a known state. The device as identified
*predicts* it. What that leaves, over the noise, is compared with what changes of the identified numbers would leave
(derivatives of runs), and what errors of the corrected delays do.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.events import IMPACTS
from tarsus.identify.estimates import Estimates
from tarsus.identify.foot import FootModel
from tarsus.identify.instruments import SOUND, Instruments
from tarsus.identify.traces import Trace, repeats_of
from tarsus.impacts.detection import STILL
from tarsus.model.drive.waveforms import Waveform
from tarsus.records.measurement import Quantity
from tarsus.records.purpose import IN_AIR

_FINER = 8
"""Places a sample at which a prediction is delayed: beyond lies a thousandth of the motion."""
_ROUNDED = 1e-6
"""Part of a sample by which the one at the beginning of the drive may be before it: rounding of its time."""
_SHORTEST = 20
"""Samples of a record in the air that are looked at: fewer tell less than they cost."""
_CLOSE = 0.5
"""Part of the height at rest below which a foot is taken to be near the ground: a device that is a little wrong lands
no earlier."""
_NUDGE = 1e-2
"""Part of a number by which it is moved at most: the motion is linear in it to a percent of what it changes."""


@dataclass(frozen=True)
class AirRecord:
    """One set of records in the air, its repeats averaged, compared with the identified device.

    set: its name; model: the device; time (nt,) [s]; predicted (2 np, nt): displacements before velocities; left (h, 2
    np, nt): measured less predicted, mean of every second repeat, or of the only one; white (h, 2 np): its noise;
    slopes (p, 2 np, nt): of the prediction by the identified numbers; delays (2, 2 np, nt): its changes by a standard
    error of the delay of displacements alone, and of all channels.
    """

    set: str
    model: FootModel
    time: Floats
    predicted: Floats
    left: Floats
    white: Floats
    slopes: Floats
    delays: Floats

    @property
    def points(self) -> int:
        """Number of points."""
        return len(self.model.points)


def air_records(
    known: Estimates,
    traces: Sequence[Trace],
    signals: Mapping[str, Waveform],
    level: float,
    instruments: Instruments = SOUND,
) -> tuple[list[AirRecord], list[str]]:
    """Every set that shows motion in the air, and sentences on those that cannot be simulated.

    Parameters
    ----------
    known
        What was identified.
    traces
        Records, repeats of a set having its name.
    signals
        Drive of each set; others are passed over.
    level
        Contact level from the rest [m].
    instruments
        Those of the records, whose delays and low-pass the prediction has as well: a prediction can be delayed exactly,
        a record between its samples cannot.
    """
    out: list[AirRecord] = []
    said: list[str] = []
    for name, repeats in repeats_of([one for one in traces if one.set in signals]).items():
        if len({round(one.step, 12) for one in repeats}) > 1:
            said.append(f"{name}: its repeats are sampled at different rates")
            continue
        try:
            found = _record(known, repeats, signals[name], level, instruments)
        except InputError as error:
            said += [f"{name}: {one}" for one in error.problems]
            continue
        if found is not None:
            out.append(found)
    return out, said


def moving(known: Estimates) -> list[int]:
    """Numbers of the identified parameters that motion in the air from the rest depends on, with draws that differ.

    The constant of the drive's law only moves the rest, from which displacements count.
    """
    own = [path.startswith("robot.") and not path.endswith((".constant", ".offset")) for path in known.paths]
    return [int(k) for k in np.flatnonzero(np.array(own, dtype=bool) & (np.std(known.samples, axis=0) > 0.0))]


def _record(
    known: Estimates, repeats: Sequence[Trace], signal: Waveform, level: float, instruments: Instruments
) -> AirRecord | None:
    model, first = known.model(), repeats[0]
    k, step = first.point(model.foot_point), first.step
    begin = int(np.searchsorted(first.time, -_ROUNDED * step))
    late = max(float(first.time[begin]), 0.0)
    count = min(_touches(one, k, level) for one in repeats) - begin
    _, events, _ = model.run(model.driven(signal, first.gap), max(count, 1) * step, np.zeros(0))
    landings = events["time"][np.isin(events["kind"], IMPACTS)]
    count = min(count, int(landings.min(initial=np.inf) / step)) if len(landings) else count
    if count < _SHORTEST:
        return None

    finer = _FINER if instruments.delaying else 1
    times = late + step / finer * np.arange(finer * (count - 1) + 1, dtype=np.float64)

    def motion(values: Floats) -> Floats:
        """Displacements and velocities of the points from the rest, as seen with some values of the numbers."""
        there = known.model(values)
        scene = there.driven(signal, first.gap)
        states = there.states(scene, count * step, times)
        x = states.x - np.array(scene.initial.displacement)[:, None]
        pairs = (there.rows @ x, Quantity.DISPLACEMENT), (there.rows @ states.v, Quantity.VELOCITY)
        return np.concatenate([instruments.seen(*one, step / finer) for one in pairs])[:, ::finer]

    predicted, slopes = motion(known.values), []
    for number in moving(known):
        values = known.values.copy()
        size = _nudge(known, number)
        values[number] += size
        slopes.append((motion(values) - predicted) / size)
    lag, delay = instruments.errors
    by = np.repeat([[lag, 0.0], [delay, delay]], len(model.points), axis=1)
    delays = by[:, :, None] * np.gradient(predicted, step, axis=1)
    halves = [half for half in (repeats[::2], repeats[1::2]) if half]
    seen = [np.mean([np.concatenate([t.x, t.v])[:, begin : begin + count] for t in half], axis=0) for half in halves]
    white = [
        np.sqrt(np.mean([np.concatenate([t.noise_x, t.noise_v]) ** 2 for t in half], axis=0) / len(half))
        for half in halves
    ]
    time = late + step * np.arange(count, dtype=np.float64)
    return AirRecord(
        first.set, model, time, predicted, np.array(seen) - predicted, np.array(white), np.array(slopes), delays
    )


def _nudge(known: Estimates, number: int) -> float:
    """By how much a number is moved to see what it changes: as far as it is unknown, or a hundredth."""
    size, std = _NUDGE * abs(float(known.values[number])), float(np.std(known.samples[:, number]))
    return min(size, std) if size else std


def _touches(trace: Trace, k: int, level: float) -> int:
    """Number of the first sample at which the foot may be on the ground; that of samples where it never is."""
    if trace.gap is not None and trace.gap >= 0.5 * IN_AIR:
        return len(trace.time)
    near = np.flatnonzero(trace.x[k] < level + max(2.0 * STILL * trace.noise_x[k], _CLOSE * abs(level)))
    return int(near[0]) if len(near) else len(trace.time)
