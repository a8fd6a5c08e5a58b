"""Whether the channels of a record, and the repeats of a set, belong together.

A displacement is the integral of its velocity, whatever the structure: a wrong unit, scale or sign of one of them, and
velocities that are swapped, show without any model. Repeats of the same drive show the same motion: one that does not,
while the others agree, is the odd one out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import convolve1d
from scipy.signal import firwin

from tarsus.base.arrays import Floats
from tarsus.identify.traces import Trace
from tarsus.identify.volts import jumps_of
from tarsus.records.excluded import Excluded

_SPANS = (8, 32, 128, 512)
"""Samples over which displacements are compared with the integral of the velocity; the span at which the two are most
alike counts, for a velocity that belongs to a displacement is like it at some span, and any other at none."""
_SLOW = np.asarray(firwin(33, 0.35), dtype=float)
"""Low-pass for both: what is too quick for the sampling has no integral to compare."""
_EDGE = len(_SLOW) // 2 + 2
"""Samples on either side of a jump of the drive that are left out: the acceleration jumps with it, and the integral of
samples is off by a twelfth of that jump times the squared step, edge by edge the same way."""
_FEWEST = 6.0
"""Independent spans between jumps of the drive that make a comparison; with fewer all are taken, and compared
roughly."""
_HEARD = 3.0
"""Both must be so many times the noise: a weaker one has no size to compare. And what a displacement does not share
with an integral must be so many times the noise to count."""
GAIN = 0.02
"""Largest deviation of the ratio of displacement and integrated velocity from one."""
_SURE = 6.0
"""Standard errors that a ratio must be off to be reported."""
_ROUGH = 5.0
"""Factor that is left open where the drive jumps too often to look between: the integral has come out as 0.4 of the
way there, for a point that the drive hardly moves. A wrong sign, and a wrong unit, still show."""
_ALIKE = 0.9
"""Least correlation of a displacement and the integral of its velocity, where noise does not hide it."""

ODD = 0.02
"""Share of its span by which a record must differ from the others to be the odd one."""
_MORE = 4.0
"""And times by which it must differ more than the others do among themselves."""


@dataclass(frozen=True)
class _Ratio:
    """Displacement over integrated velocity: gain, what that may be off, correlation, and whether noise is enough to
    explain what the two leave of each other."""

    gain: float
    open: float
    alike: float
    hidden: bool


def not_together(trace: Trace) -> list[Excluded]:
    """What is wrong between displacements and velocities of a record; nothing where noise hides it."""
    out: list[Excluded] = []
    points = range(len(trace.points))
    for k in points:
        found = _ratio(trace, k, k)
        if found is None or (found.alike < _ALIKE and found.hidden):
            continue
        name = trace.points[k]
        if found.alike >= _ALIKE and abs(found.gain - 1.0) <= found.open:
            continue
        if found.alike < _ALIKE:
            others = [(other, _ratio(trace, k, other)) for other in points if other != k]
            swapped = [o for o, one in others if one is not None and one.alike > 0.97 and abs(one.gain - 1.0) < 0.1]
            if swapped:
                said = f"its motion is the integral of the velocity of point '{trace.points[swapped[0]]}': "
                said += "channels look swapped"
            elif found.alike < -_ALIKE:
                said = "displacement and velocity have opposite signs"
            else:
                said = f"the displacement is not the integral of the velocity (correlation {found.alike:.2f})"
        else:
            said = f"the displacement is {found.gain:.4g} times the integral of the velocity: "
            said += "are units and scales right?"
        out.append(Excluded(trace.file, name, said))
    return out


def _ratio(trace: Trace, point: int, other: int) -> _Ratio | None:
    """Displacement of one point over the integrated velocity of another; None where noise hides both."""
    slow = convolve1d(np.stack([trace.x[point], trace.v[other]]), _SLOW, axis=1, mode="nearest")
    whole = CubicSpline(trace.time, slow[1]).antiderivative()(trace.time)
    jumped = np.zeros(len(trace.time))
    jumped[jumps_of(trace.volts)] = 1.0
    edges = np.cumsum(jumped)
    between = _best(trace, (point, other), slow[0], whole, edges)
    if between is not None or not edges[-1]:
        return between
    rough = _best(trace, (point, other), slow[0], whole, None)
    if rough is None or not 1.0 / _ROUGH < abs(rough.gain) < _ROUGH:
        return rough
    return replace(rough, open=np.inf)


def _best(trace: Trace, channels: tuple[int, int], moved: Floats, whole: Floats, edges: Floats | None) -> _Ratio | None:
    """The comparison at the span at which displacement and integral (ns,) are most alike.

    edges: number of jumps of the drive before each sample, none of which a span may come near; None for all spans.
    """
    best: _Ratio | None = None
    for span in _SPANS:
        if len(moved) < 8 * span:
            break
        x, integral = moved[span:] - moved[:-span], whole[span:] - whole[:-span]
        if edges is not None:
            count = len(x)
            ends = np.arange(count) + span + _EDGE, np.arange(count) - _EDGE
            clear = edges[np.clip(ends[0], 0, len(edges) - 1)] == edges[np.clip(ends[1], 0, len(edges) - 1)]
            x, integral = x[clear], integral[clear]
        if len(x) < _FEWEST * span:
            continue
        noise_x = np.sqrt(2.0) * float(trace.noise_x[channels[0]])
        noise_v = np.sqrt(span) * trace.step * float(trace.noise_v[channels[1]])
        size_x, size_v = float(np.sqrt(np.mean(x**2))), float(np.sqrt(np.mean(integral**2)))
        if size_x <= _HEARD * noise_x or size_v <= _HEARD * noise_v:
            continue
        alike = float(np.mean(x * integral)) / (size_x * size_v)
        gain = alike * size_x / size_v
        left = np.sqrt(max(1.0 - alike**2, 0.0))
        error = left / max(abs(alike), 1e-9) / np.sqrt(len(x) / span)
        hidden = alike > -_ALIKE and left * size_x < _HEARD * np.hypot(noise_x, gain * noise_v)
        one = _Ratio(gain, max(GAIN, _SURE * float(error)), alike, bool(hidden))
        if best is None or abs(one.alike) > abs(best.alike):
            best = one
    return best


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
