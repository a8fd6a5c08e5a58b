"""What the motion in the air leaves unexplained by the identified device, linear in what may differ.

From the rest up to the first contact a record is motion in the air from a known state. The device as identified
*predicts* it, as late and behind the low-pass that were found of the instruments: a prediction can be delayed exactly,
a record between its samples cannot. What that leaves, over the noise, is set beside the traces that changes of the
identified numbers would leave (derivatives of runs) and those of differences from the model
(`tarsus.identify.alternatives`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

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

FINE = 4
"""Steps a sample on which forces beside the drive's are held: of what a difference leaves, a percent is enough."""
_FINER = 48
"""Places a period of the fastest mode at which a prediction is delayed and filtered: straight lines between them are
0.15 % of its motion off, and cubic ones far less."""
_WITHIN = 8
"""Places in a step at which a force is taken for its mean: a jump of the voltage counts by the moment it has."""
_ROUNDED = 1e-6
"""Part of a sample by which the one at the beginning of the drive may be before it: rounding of its time."""
_SHORTEST = 20
"""Samples of a record in the air that are looked at: fewer tell less than they cost."""
_CLOSE = 0.5
"""Part of the height at rest below which a foot is taken to be near the ground: a device that is a little wrong lands
no earlier."""
_NUDGE = 1e-6
"""Part of a number by which the state at rest, linear in nearly all of them, is differenced."""


@dataclass(frozen=True)
class AirRecord:
    """One set of records in the air, its repeats averaged, beside the identified device.

    set: its name; model: the device; gap: of its foot there at the neutral position [m]; time (nt,) [s]; fine (nf,)
    [s]: ends of `FINE` steps a sample; volts, force (nf,) [V], [N]: the drive's there; jumped (nf - 1,) [N]: mean of
    its force in each step, less that of both ends; states (2n, nf): of the device, about the rest; rest (n,): the state
    there; predicted (2 np, nt): displacements before velocities; left (h, 2 np, nt): measured less predicted, mean of
    every second repeat, or of the only one; white (h, 2 np): its noise; slopes (p, 2 np, nt): of the prediction by the
    identified numbers; instruments: through which it is seen, where they delay it; nudges (q, 2 np, nt): of the
    prediction, by a standard error of each of their numbers.
    """

    set: str
    model: FootModel
    gap: float
    time: Floats
    fine: Floats
    volts: Floats
    force: Floats
    jumped: Floats
    states: Floats
    rest: Floats
    predicted: Floats
    left: Floats
    white: Floats
    slopes: Floats
    instruments: Instruments | None
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

    @property
    def height(self) -> Floats:
        """Gap of the foot (nf,) [m]."""
        return self.gap + self.model.row @ (self.states[: len(self.rest)] + self.rest[:, None])

    @property
    def speed(self) -> Floats:
        """Of the foot along its normal (nf,) [m/s]."""
        return self.model.row @ self.states[len(self.rest) :]

    @cached_property
    def moved(self) -> tuple[Floats, Floats, Floats]:
        """Displacements, velocities and accelerations (np, nt) of the points."""
        x, v = np.split(self.predicted, 2)
        return x, v, np.gradient(v, self.time, axis=1)

    def seen(self, x: Floats | float, v: Floats | float) -> Floats:
        """Displacements and velocities (np, nt), one before the other (2 np, nt)."""
        shape = (self.points, len(self.time))
        return np.concatenate([np.broadcast_to(x, shape), np.broadcast_to(v, shape)])

    def pushed(self, force: Floats, more: Floats | float = 0.0) -> Floats:
        """What generalised forces (n, nf) [N] beside the drive's leave, as `seen`; more: as for `response`."""
        n = len(self.model.mass)
        mobility = np.concatenate([np.zeros((n, n)), np.linalg.inv(self.model.mass)]).astype(np.float64)
        state = response(
            self.model.flow,
            mobility @ force,
            float(self.fine[1] - self.fine[0]),
            mobility @ np.broadcast_to(more, force[:, 1:].shape),
        )
        return self.shown(np.concatenate([self.model.rows @ state[:n], self.model.rows @ state[n:]]))

    def shown(self, motion: Floats) -> Floats:
        """What instruments show at the samples of displacements and velocities (2 np, nf)."""
        return shown(motion, float(self.fine[1] - self.fine[0]), self.model.points, self.instruments)[
            :, ::FINE
        ]


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
                    out[*one, j] = response(np.diag(poles), shares[:, None] * motion[*one, j], step).sum(
                        axis=0
                    )
            if late:
                out[..., j, :] = CubicSpline(time, out[..., j, :], axis=-1)(np.maximum(time - late, 0.0))
    return out


def air_records(
    known: Estimates, traces: Sequence[Trace], signals: Mapping[str, Waveform], level: float,
    instruments: Instruments | None = None,
) -> tuple[list[AirRecord], list[str]]:  # fmt: skip
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
    known: Estimates,
    repeats: Sequence[Trace],
    signal: Waveform,
    level: float,
    instruments: Instruments | None,
) -> AirRecord | None:
    model, first = known.model(), repeats[0]
    k, step = first.point(model.foot_point), first.step
    gaps = {} if first.gap is None else {f"robot.feet.{model.foot}.gap": first.gap}
    scene, directions = with_values(model.driven(signal), gaps), _directions(known)
    begin = int(np.searchsorted(first.time, -_ROUNDED * step))
    late = max(float(first.time[begin]), 0.0)
    count = min(_touches(one, k, level) for one in repeats) - begin
    events = simulate(scene, max(count, 1) * step).events
    landings = events["time"][np.isin(events["kind"], IMPACTS)]
    count = min(count, int(landings.min(initial=np.inf) / step)) if len(landings) else count
    if count < _SHORTEST:
        return None
    time = late + step * np.arange(count, dtype=np.float64)
    run = simulate(scene, count * step, gradients=directions)
    if run.ended is not ResultCode.DONE:
        raise InputError(f"the identified device cannot be simulated with this drive: {run.ended}")
    rest, output = np.array(rest_state(scene)), np.kron(np.eye(2), model.rows)

    def about(places: Floats) -> Floats:
        states = run.states(places)
        return np.concatenate([states.x - rest[:, None], states.v])

    def by_number(places: Floats) -> Floats:
        slopes = run.state_gradients(places)
        each = [
            np.concatenate([slopes[p].x - _rest(one)[:, None], slopes[p].v]) for p, one in directions.items()
        ]
        return output @ np.array(each)

    def seen_by(motion: Callable[[Floats], Floats], finer: int, *those: Instruments) -> list[Floats]:
        places = late + step / finer * np.arange(finer * (count - 1) + 1, dtype=np.float64)
        moved = motion(places)
        return [shown(moved, step / finer, model.points, one)[..., ::finer] for one in those]

    def plain(places: Floats) -> Floats:
        return output @ about(places)

    if instruments is None:
        predicted, others, slopes = plain(time), [], by_number(time)
    else:
        finer = int(
            np.ceil(_FINER * step * float(np.abs(np.linalg.eigvals(model.flow)).max()) / (2.0 * np.pi))
        )
        predicted, *others = seen_by(plain, finer, instruments, *instruments.nudged())
        (slopes,) = seen_by(by_number, FINE, instruments)
    nudges = np.array([one - predicted for one in others]).reshape(-1, *predicted.shape)
    halves = [half for half in (repeats[::2], repeats[1::2]) if half]
    seen = [
        np.mean([np.concatenate([t.x, t.v])[:, begin : begin + count] for t in half], axis=0)
        for half in halves
    ]
    white = [
        np.sqrt(np.mean([np.concatenate([t.noise_x, t.noise_v]) ** 2 for t in half], axis=0) / len(half))
        for half in halves
    ]
    fine = late + step / FINE * np.arange(FINE * (count - 1) + 1, dtype=np.float64)
    places = late + step / FINE / _WITHIN * np.arange(_WITHIN * (len(fine) - 1) + 1, dtype=np.float64)
    volts = scene.signals[model.drive].volts(places)
    force = np.asarray(model.law.force(volts, model.history))
    mean = force[:-1].reshape(-1, _WITHIN).mean(axis=1)
    jumped = mean - 0.5 * (force[:-1:_WITHIN] + force[_WITHIN::_WITHIN])
    return AirRecord(
        first.set, model, model.gap if first.gap is None else first.gap,
        time, fine, volts[::_WITHIN], force[::_WITHIN], jumped, about(fine), rest, predicted,
        np.array(seen) - predicted, np.array(white), slopes, instruments, nudges,
    )  # fmt: skip


def _directions(known: Estimates) -> dict[str, dict[str, float]]:
    """By the path of every number that moves: itself, and the state at rest, which a run starts from, along with it."""
    out: dict[str, dict[str, float]] = {}
    for k in moving(known):
        size = _NUDGE * max(abs(known.values[k]), float(np.std(known.samples[:, k])))
        ends = []
        for way in (size, -size):
            values = known.values.copy()
            values[k] += way
            ends.append(np.array(rest_state(known.model(values).scene)))
        moved = (ends[0] - ends[1]) / (2.0 * size)
        rest = {f"initial.displacement.{i}": float(one) for i, one in enumerate(moved)}
        out[known.paths[k]] = {known.paths[k]: 1.0, **rest}
    return out


def _rest(direction: Mapping[str, float]) -> Floats:
    """How the state at rest moves along a direction."""
    return np.array([one for path, one in direction.items() if path.startswith("initial.")])


def _touches(trace: Trace, k: int, level: float) -> int:
    """Number of the first sample at which the foot may be on the ground; that of samples where it never is."""
    if trace.gap is not None and trace.gap >= 0.5 * IN_AIR:
        return len(trace.time)
    near = np.flatnonzero(trace.x[k] < level + max(2.0 * STILL * trace.noise_x[k], _CLOSE * abs(level)))
    return int(near[0]) if len(near) else len(trace.time)
