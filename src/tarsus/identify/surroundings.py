"""What the surroundings add to records: hum of the mains, and a ground that gives way.

Repeats of a record show the same motion, so that what they differ by is not the drive's: a line of the mains stands
there above its neighbours, with another phase in each. A foot that stands on a rigid ground stays where it is whatever
the drive does; on one that gives way it follows the force with which it is pressed.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import f as f_distribution

from tarsus.base.arrays import Complexes, Floats
from tarsus.identify.checks import GROUND, touched
from tarsus.identify.estimates import Estimates
from tarsus.identify.foot import FootModel
from tarsus.identify.step import Check
from tarsus.identify.traces import SHORTEST, Trace, comparable, holds
from tarsus.identify.with_error import WithError

_MAINS = (50.0, 60.0)
"""Frequencies of mains [Hz]."""
_HARMONICS = 3
"""Multiples of them that are looked for."""
_BESIDE = (-3, -2, 2, 3)
"""Lines of a record beside the one in question that tell what it would be without hum: its own and the next hold what
does not fit into a whole number of periods."""
_CHANCE = 1e-6
"""Probability of a line as strong by noise alone: a dozen are looked at in thousands of campaigns."""
_FEWEST = 3
"""Records that make a comparison."""
_SURE = 5.0
"""Standard errors by which the ground must give way."""


def hum_checks(traces: Sequence[Trace]) -> tuple[Check, ...]:
    """Whether a line of the mains stands in what the repeats of records differ by.

    It takes no number's verdict: what it adds to a record is in the noise of its rest, and in what fits leave.
    """
    apart = _differences(traces)
    sought = [k * hertz for hertz in _MAINS for k in range(1, _HARMONICS + 1)]
    found = [(hertz, *line) for hertz in sought if (line := _line(apart, hertz)) is not None]
    if not found:
        return ()
    hertz, strength, limit, size = max(found, key=lambda one: one[1] / one[2])
    cause = f"mains hum: a line at {hertz:g} Hz in the displacements, {1e6 * size:.2g} um high"
    return (Check(f"power at {hertz:g} Hz over that beside it", strength, limit, cause=cause),)


def _differences(traces: Sequence[Trace]) -> list[tuple[float, Floats, float]]:
    """Sampling steps [s], displacements (np, ns) less the mean of the repeats, and by which part of the variance this
    takes."""
    out = []
    for repeats in comparable(traces):
        mean = np.mean([one.x for one in repeats], axis=0)
        out += [(one.step, one.x - mean, 1.0 - 1.0 / len(repeats)) for one in repeats]
    return out


def _line(apart: Sequence[tuple[float, Floats, float]], hertz: float) -> tuple[float, float, float] | None:
    """Mean power at a frequency over that beside it, what this is at most by chance, and the amplitude [m]."""
    power, beside, size = [], [], []
    waves: dict[tuple[float, int], Complexes] = {}
    for step, x, part in apart:
        count = x.shape[1]
        lines = hertz + np.array((0, *_BESIDE)) / (count * step)
        if lines.min() <= 1.0 / (count * step) or lines.max() >= 0.5 / step:
            continue
        if (step, count) not in waves:
            waves[step, count] = np.exp(-2.0j * np.pi * np.outer(step * np.arange(count), lines))
        x = x[np.ptp(x, axis=1) > 0.0]  # repeats that agree to their last digit show no line
        strength = np.abs((x - x.mean(axis=1, keepdims=True)) @ waves[step, count]) ** 2
        white = np.var(np.diff(x, axis=1), axis=1)
        power += (strength[:, 0] / white / count).tolist()
        beside += (strength[:, 1:] / white[:, None] / count).ravel().tolist()
        size += (4.0 * strength[:, 0] / count**2 / part).tolist()
    if len(power) < _FEWEST:
        return None
    limit = float(f_distribution.isf(_CHANCE, 2 * len(power), 2 * len(beside)))
    return float(np.mean(power) / np.mean(beside)), limit, float(np.sqrt(np.mean(size)))


def following(model: FootModel, traces: Sequence[Trace], level: float) -> WithError | None:
    """Motion of a foot that stands on the ground [m from the rest] over that of a free one: regression of its place in
    every hold on where the drive's force would take it without a ground; None where it hardly stands."""
    top, bottom = [], []
    for trace in traces:
        k, free = trace.point(model.foot_point), None
        for hold in holds(trace, model.foot_point, level):
            part = slice(hold.first + 1, hold.last)
            if hold.last - hold.first < SHORTEST:
                continue
            if free is None:
                volts = trace.between
                force = volts.force(model.law, model.history, 0, len(trace.volts))[:: volts.substeps]
                free = model.static_load * force
            pressed = free[part] - np.mean(free[part])
            weight = float(trace.noise_x[k]) ** -2.0
            top.append(weight * float(pressed @ (model.normal * trace.x[k, part])))
            bottom.append(weight * float(pressed @ pressed))
    if len(top) < _FEWEST or not np.sum(bottom) > 0.0:
        return None
    follows = float(np.sum(top) / np.sum(bottom))
    left = np.array(top) - follows * np.array(bottom)
    scatter = max(float(np.sum(left**2) / np.sum(bottom)), 1.0)
    return WithError(follows, float(np.sqrt(scatter / np.sum(bottom))))


def unsure_level(
    model: FootModel, traces: Sequence[Trace], level: tuple[float, float]
) -> tuple[float, float]:
    """A contact level with its standard error [m], which on a ground that gives way is as much as the foot follows
    forces that bend it by its gap: what it is let go with is not what it was pressed with."""
    found = following(model, traces, level[0])
    given = 0.0 if found is None or found.value < _SURE * found.error else found.value * model.gap
    return level[0], float(np.hypot(level[1], given))


def ground_checks(known: Estimates, traces: Sequence[Trace], level: float) -> tuple[Check, ...]:
    """Whether the foot follows the drive's force on the ground."""
    model = known.model()
    found = following(model, traces, level)
    if found is None:
        return ()
    foot = 1.0 / float(model.row @ np.linalg.solve(model.stiffness, model.row))
    stiffness = foot * (1.0 / max(found.value, 1e-300) - 1.0)
    cause = (
        f"the ground gives way: it is compliant, about {stiffness:.3g} N/m where the foot's own stiffness is "
        f"{foot:.3g} N/m"
    )
    return (
        Check(
            "motion of the foot on the ground over its free motion", found.value, _SURE * found.error,
            paths=touched(known, (GROUND,)), cause=cause,
        ),
    )  # fmt: skip
