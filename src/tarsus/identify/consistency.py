"""Whether the channels of a record, and the repeats of a set, belong together.

A displacement is the integral of its velocity, whatever the structure: a wrong unit, scale or sign of one of them, and
velocities that are swapped, show without any model. Repeats of the same drive show the same motion: one that does not,
while the others agree, is the odd one out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.ndimage import convolve1d
from scipy.signal import firwin

from tarsus.identify.step import LeftOut
from tarsus.identify.traces import Trace

__all__ = ["not_together", "odd_ones"]

Floats = NDArray[np.float64]

_SPANS = (8, 32, 128, 512)
"""Samples over which displacements are compared with the integral of the velocity; the span that tells most counts."""
_SLOW = np.asarray(firwin(33, 0.35), dtype=float)
"""Low-pass for both: what is too quick for the sampling has no integral to compare."""
_TOLD = 0.01
"""Standard error of the ratio above which nothing is said."""
GAIN = 0.02
"""Largest deviation of the ratio of displacement and integrated velocity from one."""
_SURE = 6.0
_QUICK, _ROUGH = 0.35, 0.8
"""Share of the velocity above the low-pass from which on the ratio is known roughly only, and how roughly."""
_ALIKE = 0.9

ODD = 0.02
"""Share of its span by which a record must differ from the others to be the odd one."""
_MORE = 4.0


def not_together(trace: Trace) -> list[LeftOut]:
    """What is wrong between displacements and velocities of a record; nothing where noise hides it."""
    out: list[LeftOut] = []
    points = range(len(trace.points))
    for k in points:
        found = _ratio(trace, k, k)
        if found is None:
            continue
        gain, error, alike = found
        name = trace.points[k]
        if alike >= _ALIKE and abs(gain - 1.0) <= max(GAIN, _SURE * error, _quick(trace, k)):
            continue
        if alike < _ALIKE:
            others = [(other, _ratio(trace, k, other)) for other in points if other != k]
            swapped = [
                o for o, one in others if one is not None and one[2] > 0.97 and abs(one[0] - 1.0) < 0.1
            ]
            if swapped:
                said = f"its motion is the integral of the velocity of point '{trace.points[swapped[0]]}': "
                said += "channels look swapped"
            elif alike < -_ALIKE:
                said = "displacement and velocity have opposite signs"
            else:
                said = f"the displacement is not the integral of the velocity (correlation {alike:.2f})"
        else:
            said = f"the displacement is {gain:.4g} times the integral of the velocity: are units and scales right?"
        out.append(LeftOut(trace.file, name, said))
    return out


def _ratio(trace: Trace, point: int, other: int) -> tuple[float, float, float] | None:
    """Displacement of one point over the integrated velocity of another, its error (relative above one), and their
    correlation; None where noise hides it."""
    best = None
    slow = convolve1d(np.stack([trace.x[point], trace.v[other]]), _SLOW, axis=1, mode="nearest")
    whole = CubicSpline(trace.time, slow[1]).antiderivative()(trace.time)
    for span in _SPANS:
        if len(trace.time) < 8 * span:
            break
        moved = slow[0, span:] - slow[0, :-span]
        integral = whole[span:] - whole[:-span]
        noise = np.hypot(
            np.sqrt(2.0) * trace.noise_x[point], np.sqrt(span) * trace.step * trace.noise_v[other]
        )
        size = float(np.sqrt(np.mean(integral**2)))
        if size <= 3.0 * np.sqrt(span) * trace.step * trace.noise_v[other]:
            continue
        gain = float(moved @ integral / (integral @ integral))
        alike = float(moved @ integral / np.sqrt((moved @ moved) * (integral @ integral)))
        error = noise / size / np.sqrt(len(moved) / span) / max(abs(gain), 1.0)
        if best is None or error < best[1]:
            best = gain, error, alike
    return None if best is None or best[1] > _TOLD else best


def _quick(trace: Trace, point: int) -> float:
    """Deviation that motion too quick for the sampling leaves open: steps of the drive in modes near half the rate."""
    v = trace.v[point]
    share = float(np.std(v - convolve1d(v, _SLOW, mode="nearest")) / max(float(np.std(v)), 1e-300))
    return _ROUGH if share > _QUICK else 0.0


def odd_ones(traces: Sequence[Trace]) -> list[LeftOut]:
    """Records of one set, three or more repeats, of which one moves otherwise while the others agree."""
    if len(traces) < 3:
        return []
    count = min(len(trace.time) for trace in traces)
    out: list[LeftOut] = []
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
        if own[worst] > max(ODD, _MORE * usual):
            middle = np.median(np.delete(motion, worst, axis=0), axis=0)
            said = _how(traces[worst], k, middle, max(ODD, _MORE * usual) * span)
            apart_by = f"{100 * own[worst]:.2g} % of its span apart, where they are {100 * usual:.2g} % from each other"
            out.append(
                LeftOut(
                    traces[worst].file, name, f"{said} than the {len(traces) - 1} other repeats: {apart_by}"
                )
            )
            break
    return out


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
