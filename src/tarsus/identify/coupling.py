"""Displacements behind a high-pass of first order, as if coupled by a capacitor: found without a model, and put back.

Behind a corner at f a displacement x shows as y with ``y' = x' - w y``, ``w = 2 pi f``: it lacks w times its own
integral, ``x = y + w int y dt`` from the rest on. The velocity of the same point tells that, roughly, for its own zero
is integrated along; and so does a drive with a period, closely: from one period to the next, what repeats itself
repeats, so that y falls by w times its integral over the period.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.integrate import cumulative_trapezoid

from tarsus.base.arrays import Floats
from tarsus.identify.instruments import middle_of
from tarsus.identify.with_error import WithError, regressed
from tarsus.records.measurement import Measurement, Quantity

SURE = 8.0
"""Standard errors by which a high-pass must be seen, or a gain drift, and deviations of what is seen elsewhere by which
a displacement must step: of 10^6 samples of a campaign one of normal noise in 10^9 campaigns."""
_FEWEST = 4
"""Estimates that a mean is taken of, to see how far they scatter."""
_JUMP = 10.0
"""Deviations of its usual change by which a velocity jumps between two samples: over an impact no sum of samples is the
integral, and the displacement may have any step."""
_SMOOTH = 100
"""Samples between two jumps that tell how a displacement goes with its velocity: the noise of one is a tenth then."""
_AGREE = 4.0
"""Standard errors within which both ways must agree: a drive that creeps does not repeat itself, but its displacements
are the integrals of their velocities."""
_WHOLE = 1e-3
"""Part of a sample by which a period may be no whole number of them: nothing moves by more than noise in it."""
_PARTS = 16
"""Parts of what one period differs from the next, that scatter for themselves: where a foot is let go a little later,
many samples differ as one."""
_SETTLED = 3
"""Periods that a record must last: the first one, which begins at rest, is not like the others."""


def weighted(values: Floats, errors: Floats) -> tuple[float, float]:
    """Mean of values (n,) with standard errors, and how many of its own it is off zero, as they scatter."""
    weight = errors**-2.0
    mean = float(weight @ values / weight.sum())
    scatter = max(float(weight @ (values - mean) ** 2) / (len(values) - 1), 1.0)
    return mean, abs(mean) * float(np.sqrt(weight.sum() / scatter))


def beside_velocity(x: Floats, v: Floats, step: float) -> list[tuple[float, float]]:
    """Rate [1/s] at which a displacement (ns,) gains its own integral beside that of the velocity, with gain and zeros
    free, and its standard error; nothing of one without stretches in which the velocity does not jump."""
    path, whole = (np.asarray(cumulative_trapezoid(one, dx=step, initial=0.0)) for one in (v, x))
    table = np.column_stack([whole, path, step * np.arange(len(x)), x])
    change = np.abs(np.diff(v))
    jumps = 1 + np.flatnonzero(change > _JUMP * 1.4826 * np.median(change))
    parts = [one - one.mean(axis=0) for one in np.split(table, jumps) if len(one) >= _SMOOTH]
    if not parts:
        return []
    design, seen = np.split(np.concatenate(parts), [3], axis=1)
    found = regressed(seen[:, 0], design)
    return [] if found is None else [(float(found[0][0]), float(found[1][0]))]


def by_period(x: Floats, step: float, period: float) -> list[tuple[float, float]]:
    """The same of a displacement (ns,) from its rest, under a drive of a period [s] that begins with it: by what one
    period differs from the one before, the first left out."""
    count = round(period / step)
    last = int(len(x) / max(count, 1))
    if last < _SETTLED or abs(period / step - count) > _WHOLE:
        return []
    whole = np.asarray(cumulative_trapezoid(x, dx=step, initial=0.0))
    fall, gained = (one[2 * count : last * count] - one[count : (last - 1) * count] for one in (x, whole))
    power = float(gained @ gained)
    if not power:
        return []
    rate = float(gained @ fall) / power
    score = gained * (fall - rate * gained)
    parts = np.array([one.sum() for one in np.array_split(score, _PARTS)])
    return [(rate, float(np.linalg.norm(parts)) / power)]


def high_pass_of(
    records: Sequence[Measurement],
    rests: Sequence[float],
    periods: Sequence[float | None],
    points: Sequence[str],
) -> WithError | None:
    """Corner [Hz] of the high-pass that displacements are behind, None where velocities and periods do not both show
    one.

    Parameters
    ----------
    records
        Of any drive, sweeps excepted.
    rests
        Time [s] that each lasts before its drive begins.
    periods
        Of each drive [s]; None of one without.
    points
        Names of points.
    """
    moves, close = list[tuple[Floats, Floats, float]](), list[tuple[float, float]]()
    for record, rest, period in zip(records, rests, periods, strict=True):
        rows = {(one.at, one.quantity): one for one in record.channels}
        for point in points:
            x, v = (rows.get((point, one)) for one in (Quantity.DISPLACEMENT, Quantity.VELOCITY))
            if x is None or v is None or period is None:
                continue
            begin = round(rest / record.step)
            moved = record[x.name] - _still(record[x.name], begin)
            moves.append((moved, record[v.name], record.step))
            close += by_period(moved[begin:], record.step, period)
    if len(close) < _FEWEST:
        return None
    found = middle_of(*np.array(close).T)
    if -found.value <= SURE * found.error:  # most records end here, at a tenth of the cost
        return None
    rough = [one for moved in moves for one in beside_velocity(*moved)]
    if len(rough) < _FEWEST:
        return None
    mean, pull = weighted(*np.array(rough).T)
    error = np.hypot(found.error, mean / max(pull, 1e-300))
    if mean >= 0.0 or pull <= SURE or abs(found.value - mean) > _AGREE * error:
        return None
    return WithError(-found.value / (2.0 * np.pi), found.error / (2.0 * np.pi))


def restored(record: Measurement, rest: float, corner: float) -> Measurement:
    """A record that rests for some time [s], its displacements as they were before a high-pass of a corner [Hz]."""
    values, begin = record.values.copy(), round(rest / record.step)
    for k, channel in enumerate(record.channels):
        if channel.quantity is Quantity.DISPLACEMENT:
            from_rest = values[k] - _still(values[k], begin)
            values[k] += 2.0 * np.pi * corner * cumulative_trapezoid(from_rest, dx=record.step, initial=0.0)
    return replace(record, values=values)


def _still(values: Floats, begin: int) -> float:
    """Mean of a channel (ns,) at rest; of one without a rest, which goes to and fro, of all."""
    return float(values[:begin].mean() if begin else values.mean())
