"""What the motion in the air leaves unexplained by the identified device, linear in what may differ.

From the rest up to the first contact a record is motion in the air from a known state. The device as identified
*predicts* it, as late and behind the low-pass that were found of the instruments: a prediction can be delayed exactly,
a record between its samples cannot. What that leaves, over the noise, is set beside the traces that changes of the
identified numbers would leave (derivatives of runs).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.events import IMPACTS
from tarsus.base.spec import with_values
from tarsus.identify.estimates import Estimates
from tarsus.identify.foot import FootModel, response
from tarsus.identify.instruments import Instruments
from tarsus.identify.traces import Trace, repeats_of
from tarsus.impacts.detection import STILL
from tarsus.model.drive.waveforms import Waveform
from tarsus.model.standing import rest_state
from tarsus.records.measurement import Quantity
from tarsus.records.purpose import IN_AIR
from tarsus.solve import ResultCode, simulate

_FINE = 4
"""Places a sample at which slopes are delayed: of what a number changes, a percent is enough."""
_FINER = 48
"""Places a period of the fastest mode at which a prediction is delayed and filtered: straight lines between them are
0.15 % of its motion off, and cubic ones far less."""
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
    """One set of records in the air, its repeats averaged, beside the identified device.

    set: its name; model: the device; time (nt,) [s]; predicted (2 np, nt): displacements before velocities; left (h, 2
    np, nt): measured less predicted, mean of every second repeat, or of the only one; white (h, 2 np): its noise;
    slopes (p, 2 np, nt): of the prediction by the identified numbers; nudges (q, 2 np, nt): of the prediction, by a
    standard error of each number of the instruments that delay it.
    """

    set: str
    model: FootModel
    time: Floats
    predicted: Floats
    left: Floats
    white: Floats
    slopes: Floats
    nudges: Floats

    @property
    def points(self) -> int:
        """Number of points."""
        return len(self.model.points)

    @property
    def off(self) -> dict[str, float]:
        """By point, root mean square of the measured less the predicted displacement over that of the measured one."""
        left = self.left[:, : self.points].mean(axis=0)
        seen = self.predicted[: self.points] + left
        off = np.sqrt(np.mean(left**2, axis=1) / np.mean(seen**2, axis=1))
        return dict(zip(self.model.points, off.tolist(), strict=True))


def shown(motion: Floats, step: float, points: Sequence[str], instruments: Instruments | None) -> Floats:
    """Displacements and velocities of points (..., 2 np, nf), from the rest and a step [s] apart, as instruments show
    them."""
    if instruments is None:
        return motion
    out, time = motion.copy(), step * np.arange(motion.shape[-1])
    for k, quantity in enumerate((Quantity.DISPLACEMENT, Quantity.VELOCITY)):
        for j, point in enumerate(points, k * len(points)):
            low, late = instruments.delays(point, quantity)
            if low is not None:
                poles, shares = low.parts()
                for one in np.ndindex(motion.shape[:-2]):
                    out[*one, j] = response(np.diag(poles), shares[:, None] * motion[*one, j], step).sum(axis=0)
            if late:
                out[..., j, :] = CubicSpline(time, out[..., j, :], axis=-1)(np.maximum(time - late, 0.0))
    return out


def air_records(
    known: Estimates,
    traces: Sequence[Trace],
    signals: Mapping[str, Waveform],
    level: float,
    instruments: Instruments | None = None,
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
        Those that delay the records, if any do: the prediction is delayed as they are.
    """
    if instruments is not None and not instruments.delaying:
        instruments = None
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
    known: Estimates, repeats: Sequence[Trace], signal: Waveform, level: float, instruments: Instruments | None
) -> AirRecord | None:
    model, first = known.model(), repeats[0]
    k, step = first.point(model.foot_point), first.step
    gaps = {} if first.gap is None else {f"robot.feet.{model.foot}.gap": first.gap}
    begin = int(np.searchsorted(first.time, -_ROUNDED * step))
    late = max(float(first.time[begin]), 0.0)
    count = min(_touches(one, k, level) for one in repeats) - begin
    events = simulate(with_values(model.driven(signal), gaps), max(count, 1) * step).events
    landings = events["time"][np.isin(events["kind"], IMPACTS)]
    count = min(count, int(landings.min(initial=np.inf) / step)) if len(landings) else count
    if count < _SHORTEST:
        return None

    def seen_by(values: Floats, finer: int, *those: Instruments | None) -> list[Floats]:
        """Motion with some values of the numbers, as instruments show it that see so many places a sample."""
        there = known.model(values)
        scene = with_values(there.driven(signal), gaps)
        run = simulate(scene, count * step)
        if run.ended is not ResultCode.DONE:
            raise InputError(f"the identified device cannot be simulated with this drive: {run.ended}")
        places = late + step / finer * np.arange(finer * (count - 1) + 1, dtype=np.float64)
        states = run.states(places)
        x = states.x - np.array(rest_state(scene))[:, None]
        moved = np.concatenate([there.rows @ x, there.rows @ states.v])
        return [shown(moved, step / finer, model.points, one)[..., ::finer] for one in those]

    finer, fine, more = 1, 1, tuple[Instruments, ...]()
    if instruments is not None:
        fastest = float(np.abs(np.linalg.eigvals(model.flow)).max()) / (2.0 * np.pi)
        finer, fine, more = int(np.ceil(_FINER * step * fastest)), _FINE, instruments.nudged()
    predicted, *others = seen_by(known.values, finer, instruments, *more)
    base = predicted if fine == finer else seen_by(known.values, fine, instruments)[0]
    slopes = []
    for number in moving(known):
        values = known.values.copy()
        size = _nudge(known, number)
        values[number] += size
        slopes.append((seen_by(values, fine, instruments)[0] - base) / size)
    time = late + step * np.arange(count, dtype=np.float64)
    nudges = np.array([one - predicted for one in others]).reshape(-1, *predicted.shape)
    halves = [half for half in (repeats[::2], repeats[1::2]) if half]
    seen = [np.mean([np.concatenate([t.x, t.v])[:, begin : begin + count] for t in half], axis=0) for half in halves]
    white = [
        np.sqrt(np.mean([np.concatenate([t.noise_x, t.noise_v]) ** 2 for t in half], axis=0) / len(half))
        for half in halves
    ]
    return AirRecord(
        first.set, model, time, predicted, np.array(seen) - predicted, np.array(white), np.array(slopes), nudges
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
