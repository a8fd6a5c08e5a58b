"""Whether the channels of a record, and the repeats of a set, belong together.

A displacement is the integral of the velocity of the same point, whatever the structure: their `Relation` shows a wrong
unit, scale or sign of one of them, swapped velocities and late channels without any model. Repeats of the same drive
show the same motion: one that does not, while the others agree, is the odd one out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import convolve1d

from tarsus.base.arrays import Floats
from tarsus.identify.traces import Trace
from tarsus.identify.volts import jumps_of
from tarsus.identify.with_error import WithError
from tarsus.records.excluded import Excluded
from tarsus.records.measurement import Measurement, Quantity

_WIDTH = 3.0
"""Samples (standard deviation) of the Gaussian through which both are compared: wide enough for velocities that jump at
impacts, and narrow enough for a delay to turn what is left."""
_REACH = 15
"""Samples to either side that the Gaussian reaches, and around jumps of the drive that are not compared: the
acceleration jumps with it, and a difference of samples is off."""
_FEWEST = 200
"""Samples that make a comparison."""
COARSE = 4.0
"""Steps of the finest record from which on another is not compared: modes that the one shows lie between the samples of
the other, whose differences are no velocities then. Slow loops at 1 kHz show center and tip a quarter of a sample apart
where nothing is late."""
_PLACE = np.arange(-_REACH, _REACH + 1)
_SMOOTH = np.exp(-0.5 * (_PLACE / _WIDTH) ** 2) / np.sum(np.exp(-0.5 * (_PLACE / _WIDTH) ** 2))
_SLOPE = -_PLACE / _WIDTH**2 * _SMOOTH
"""Weights of the Gaussian and of its derivative."""
_HEARD = 3.0
"""Times by which what one does not share with the other must exceed their noise to count."""
GAIN = 0.02
"""Largest deviation of the ratio of displacement and integrated velocity from one."""
_SURE = 6.0
"""Standard errors that a ratio must be off to be reported."""
_AGAINST = 0.5
"""Correlation that noise does not turn round: ringing that is half a period late has less."""
_ROUGH = 5.0
"""Factor that is left open where the drive jumps too often to look between, and correlations that are less are no
fault: a wrong sign, and a wrong unit, still show."""
ALIKE = 0.9
"""Least correlation of a displacement and the integral of its velocity, where noise does not hide it."""

ODD = 0.02
"""Share of its span by which a record must differ from the others to be the odd one."""
_MORE = 4.0
"""And times by which it must differ more than the others do among themselves."""


@dataclass(frozen=True)
class Relation:
    """Of a displacement and a velocity: gain of the one over the integral of the other; lag [s] of the one behind the
    other; alike: their correlation; left [m/s]: root mean square of what neither gain nor lag explain; between: whether
    they were compared between jumps of the drive alone."""

    gain: WithError
    lag: WithError
    alike: float
    left: float
    between: bool


def relation_of(x: Floats, v: Floats, volts: Floats, step: float) -> Relation | None:
    """The relation of a displacement [m] and a velocity [m/s] (ns,) under a drive [V]; None of too few samples."""
    used = np.ones(len(x), dtype=bool)
    for jump in jumps_of(volts).tolist():
        used[max(jump - 2 * _REACH, 0) : jump + 2 * _REACH + 1] = False
    used[:_REACH] = used[-_REACH:] = False
    between = bool(np.count_nonzero(used) >= _FEWEST)
    if not between:
        used[_REACH:-_REACH] = True
    speed = (convolve1d(x, _SLOPE) / step)[used]
    known, rising = convolve1d(v, _SMOOTH)[used], (convolve1d(v, _SLOPE) / step)[used]
    design = np.column_stack([known, -rising, np.ones(len(known))])
    size = np.linalg.norm(design, axis=0)
    if len(speed) < _FEWEST or not size.all() or not np.ptp(speed) > 0.0:
        return None
    inverse = np.linalg.pinv((design / size).T @ (design / size)) / np.outer(size, size)
    gain, lag, _ = found = inverse @ (design.T @ speed)
    left = float(np.sqrt(np.mean((speed - design @ found) ** 2)))
    # samples through a Gaussian are as many as lie its effective width apart
    error = left * np.sqrt(2.0 * np.sqrt(np.pi) * _WIDTH * np.diag(inverse))
    return Relation(
        WithError(float(gain), float(error[0])),
        WithError(float(lag / gain), float(error[1] / abs(gain))),
        float(np.corrcoef(speed, known)[0, 1]),
        left,
        between,
    )


def relations_of(record: Measurement, points: Sequence[str]) -> dict[str, Relation]:
    """Of each point with a displacement and a velocity their relation in a record, unless too few samples tell it."""
    volts = np.zeros(record.count) if record.drive is None else record[record.drive]
    rows = {(one.at, one.quantity): k for k, one in reversed(list(enumerate(record.channels)))}
    pairs = {one: (rows.get((one, Quantity.DISPLACEMENT)), rows.get((one, Quantity.VELOCITY))) for one in points}
    found = {
        one: relation_of(record.values[x], record.values[v], volts, record.step)
        for one, (x, v) in pairs.items()
        if x is not None and v is not None
    }
    return {point: one for point, one in found.items() if one is not None}


def not_together(trace: Trace, relations: Mapping[str, Relation]) -> list[Excluded]:
    """What is wrong between displacements and velocities of a record, by their relations; nothing where noise hides
    it."""
    out: list[Excluded] = []
    points = range(len(trace.points))
    for k, point in enumerate(trace.points):
        found = relations.get(point)
        if found is None:
            continue
        gain, noise = found.gain.value, (trace.noise_x[k], trace.noise_v[k])
        if found.alike >= ALIKE:
            off = abs(gain - 1.0) > max(GAIN, _SURE * found.gain.error) if found.between else False
            if not (off or not 1.0 / _ROUGH < gain < _ROUGH):
                continue
            said = f"the displacement is {gain:.4g} times the integral of the velocity: are units and scales right?"
        else:
            by_noise = np.hypot(
                noise[0] * np.linalg.norm(_SLOPE) / trace.step, gain * noise[1] * np.linalg.norm(_SMOOTH)
            )
            hidden = found.alike > -_AGAINST and found.left < _HEARD * by_noise
            if hidden or (abs(found.alike) < ALIKE and not found.between):
                continue
            others = [
                (other, relation_of(trace.x[k], trace.v[other], trace.volts, trace.step))
                for other in points
                if other != k
            ]
            swapped = [
                o for o, one in others if one is not None and one.alike > 0.97 and abs(one.gain.value - 1.0) < 0.1
            ]
            if swapped:
                said = f"its motion is the integral of the velocity of point '{trace.points[swapped[0]]}': "
                said += "channels look swapped"
            elif found.alike < -ALIKE:
                said = "displacement and velocity have opposite signs"
            else:
                said = f"the displacement is not the integral of the velocity (correlation {found.alike:.2f})"
        out.append(Excluded(trace.file, point, said))
    return out


def odd_ones(traces: Sequence[Trace]) -> list[Excluded]:
    """Records of one set, three or more repeats, of which one moves otherwise while the others agree."""
    if len(traces) < 3:
        return []
    count = min(len(trace.time) for trace in traces)
    for k, name in enumerate(traces[0].points):
        motion = np.array([trace.x[k, :count] for trace in traces])
        span = float(np.median(np.ptp(motion, axis=1)))
        if span <= 0.0:
            continue
        apart = np.sqrt(np.mean((motion[:, None] - motion[None]) ** 2, axis=2)) / span
        own = np.array([np.median(np.delete(row, i)) for i, row in enumerate(apart)])
        worst = int(np.argmax(own))
        rest = np.delete(np.delete(apart, worst, axis=0), worst, axis=1)
        usual = float(np.median(rest[np.triu_indices(len(rest), 1)]))
        limit = max(ODD, _MORE * usual)
        if own[worst] > limit:
            middle = np.median(np.delete(motion, worst, axis=0), axis=0)
            said = f"{_how(traces[worst], k, middle, limit * span)} than the {len(traces) - 1} other repeats: "
            said += f"{100 * own[worst]:.2g} % of its span apart, where they are {100 * usual:.2g} % from each other"
            return [Excluded(traces[worst].file, name, said)]
    return []


def _how(trace: Trace, point: int, usual: Floats, limit: float) -> str:
    """In which way a record differs from the usual motion (ns,) of a point: "it ..." before "than"."""
    mine = trace.x[:, : len(usual)]
    for other, name in enumerate(trace.points):
        if other != point and np.sqrt(np.mean((mine[other] - usual) ** 2)) < limit:
            return f"channels '{trace.points[point]}' and '{name}' look swapped: it moves otherwise"
    off, centred = mine[point] - mine[point].mean(), usual - usual.mean()
    gain = float(off @ centred / (centred @ centred))
    shift = float(np.median(mine[point] - usual))
    if np.sqrt(np.mean((mine[point] - usual - shift) ** 2)) < limit:
        return f"it lies {1e6 * abs(shift):.3g} um {'higher' if shift > 0.0 else 'lower'}"
    if np.sqrt(np.mean((off - gain * centred) ** 2)) < limit:
        return f"it moves {gain:.3g} times as much, rather"
    return "it moves otherwise"
