"""What records show of their own instruments: gains that drift, drop-outs, a high-pass, noise that is not white.

Repeats of a record show the same motion. What grows from one to the next in all channels alike is a gain, or a drive
that warms up; a step in a displacement that no repeat has is a fringe that the decoder has lost, or has found. A
displacement is the integral of its velocity: one behind a high-pass of first order at ``f`` lacks ``2 pi f`` times its
own integral. At rest there is nothing but noise, whose means over some samples scatter as few of them allow if it is
white. None of these figures hangs on the device.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.identify.checks import GROUND, LAW, LOAD, touched
from tarsus.identify.coupling import SURE, beside_velocity, weighted
from tarsus.identify.estimates import Estimates
from tarsus.identify.step import Check
from tarsus.identify.traces import Trace, comparable

_MEAN = 32
"""Samples on either side of a step whose means are compared: half a wavelength of red light stands out of noise of
0.1 um then."""
_DROPPED = 3
"""Steps from which on they are drop-outs, and not a knock."""
_FEWEST = 4
"""Estimates that a mean is taken of, to see how far they scatter."""
_BLOCK = 10
"""Samples at rest of which means are taken: a few blocks fit into 10 ms at 20 kHz."""
_COLOURED = 2.0
"""Variance of these means over that of white noise: the noise of what is slow is 1.4 times as large as it looks."""


def instrument_checks(
    known: Estimates,
    repeated: Sequence[Trace],
    air: Sequence[Trace],
    slow: Sequence[Trace],
    *,
    alike: bool,
    hum: bool,
) -> tuple[Check, ...]:
    """All of them.

    Parameters
    ----------
    known
        What was identified.
    repeated
        Records whose repeats show the same motion.
    air
        Those of them that touch nothing.
    slow
        Records that last long beside the time between two impacts.
    alike
        Whether repeats begin at the same time.
    hum
        Whether a line of the mains stands in the displacements.
    """
    own = touched(known, (LAW, LOAD, GROUND))
    checks = [*_warming(repeated, own), *_coupled(slow, own), *_coloured(repeated, hum)]
    return (*checks, *(_dropped(air) if alike else ()))


def _warming(traces: Sequence[Trace], own: tuple[str, ...]) -> tuple[Check, ...]:
    """Whether all channels grow, or shrink, from one repeat to the next."""
    slopes, errors = list[float](), list[float]()
    for repeats in comparable(traces):
        order = np.arange(len(repeats)) - 0.5 * (len(repeats) - 1)
        moved = np.array([np.concatenate([one.x, one.v]) for one in repeats])
        noise = np.mean([np.concatenate([one.noise_x, one.noise_v]) for one in repeats], axis=0)
        moved -= moved.mean(axis=2, keepdims=True)
        mean = moved.mean(axis=0)
        power = np.sum(mean**2, axis=1)
        slopes += (order @ np.sum(moved * mean, axis=2) / (power * (order @ order))).tolist()
        errors += (noise / np.sqrt(power * (order @ order))).tolist()
    if len(slopes) < _FEWEST or not np.isfinite(errors).all():
        return ()
    slope, pull = weighted(np.array(slopes), np.array(errors))
    way = "grows" if slope > 0.0 else "shrinks"
    cause = (
        f"all motion {way} by {100.0 * abs(slope):.2g} % from one repeat to the next: gains of all channels, or of the "
        "drive, that warm up"
    )
    return (Check("growth from repeat to repeat, in standard errors", pull, SURE, paths=own, cause=cause),)


def _dropped(traces: Sequence[Trace]) -> tuple[Check, ...]:
    """How often a displacement steps, or a velocity is far off, where the repeats do not. It takes no number's verdict:
    what it does to one is in what fits leave."""
    count, seconds, sizes = 0, 0.0, list[float]()
    for repeats in comparable(traces):
        x, v = (np.array([getattr(one, kind) for one in repeats]) for kind in ("x", "v"))
        seconds += x.shape[2] * repeats[0].step * len(x) * x.shape[1]
        noise_x, noise_v = (
            np.concatenate([getattr(one, kind) for one in repeats]) for kind in ("noise_x", "noise_v")
        )
        for row, noise in zip(np.concatenate(x - np.median(x, axis=0)), noise_x.tolist(), strict=True):
            sums = np.concatenate([[0.0], np.cumsum(row)])
            steps = (sums[2 * _MEAN :] - 2.0 * sums[_MEAN:-_MEAN] + sums[: -2 * _MEAN]) / _MEAN
            sizes += (found := _beyond(steps, noise * np.sqrt(2.0 / _MEAN)))
            count += len(found)
        rows = zip(np.concatenate(v - np.median(v, axis=0)), noise_v.tolist(), strict=True)
        count += sum(len(_beyond(row, noise)) for row, noise in rows)
    if not seconds:
        return ()
    size = f" (by some {1e6 * np.median(sizes):.2g} um)" if sizes else ""
    cause = (
        f"drop-outs, {count / seconds:.2g} a second and channel: displacements step{size}, or velocities leap, where "
        "repeats do not, as by lost fringes"
    )
    return (Check("drop-outs that no repeat shows", float(count), float(_DROPPED), cause=cause),)


def _beyond(values: Floats, noise: float) -> list[float]:
    """Sizes of the stretches of values (n,) that are farther off zero than nearly all, and than their noise: of a
    coarse converter nearly all are off by what its zeros are."""
    size = np.abs(values)
    usual = (
        np.median(size[size > 0.0]) if size.any() else 0.0
    )  # the middle one of three repeats is not off at all
    beyond = np.flatnonzero(size > SURE * max(1.4826 * usual, noise))
    return [
        float(size[one].max())
        for one in np.split(beyond, np.flatnonzero(np.diff(beyond) > 1) + 1)
        if len(one)
    ]


def _coupled(traces: Sequence[Trace], own: tuple[str, ...]) -> tuple[Check, ...]:
    """Whether displacements lack a part of their own integral beside that of the velocity, or velocities of theirs."""
    found: list[tuple[float, float]] = []
    for repeats in comparable(traces, fewest=1):
        one = repeats[0]
        for k in range(len(one.points)):
            x, v = (np.mean([getattr(t, kind)[k] for t in repeats], axis=0) for kind in ("x", "v"))
            found += beside_velocity(x, v, one.step)
    if len(found) < _FEWEST:
        return ()
    rate, pull = weighted(*np.array(found).T)
    what, hertz = "displacements" if rate < 0.0 else "velocities", abs(rate) / (2.0 * np.pi)
    cause = (
        f"the {what} are behind a high-pass of {hertz:.3g} +- {2.0 * hertz / max(pull, 1e-300):.1g} Hz, as if coupled "
        "by a capacitor"
    )
    name = "high-pass between displacements and velocities, in standard errors"
    return (Check(name, pull, SURE, paths=own, cause=cause),)


def _coloured(traces: Sequence[Trace], hum: bool) -> tuple[Check, ...]:
    """How far means of the noise at rest scatter beside those of white noise; of velocities alone where displacements
    have hum. It takes no number's verdict."""
    found: list[tuple[float, str]] = []
    for kind, what in (("v", "velocities"), *(() if hum else (("x", "displacements"),))):
        ratios = [one for trace in traces for one in _by_blocks(trace, kind)]
        if len(ratios) >= _FEWEST:
            found.append((float(np.median(ratios)), what))
    if not found:
        return ()
    ratio, what = max(found)
    cause = (
        f"the noise of the {what} is coloured: means over {_BLOCK} samples at rest scatter {np.sqrt(ratio):.2g} "
        "times as far as those of white noise"
    )
    return (Check("variance of means at rest over white noise", ratio, _COLOURED, cause=cause),)


def _by_blocks(trace: Trace, kind: str) -> list[float]:
    """Variance of means of samples at rest over that of white noise, of each point that shows noise."""
    still = int(np.count_nonzero(trace.time < -0.5 * trace.step)) // _BLOCK * _BLOCK
    if still < 3 * _BLOCK:
        return []
    rows = getattr(trace, kind)[:, :still]
    means = rows.reshape(len(rows), -1, _BLOCK).mean(axis=2)
    whole, own = rows.var(axis=1, ddof=1), means.var(axis=1, ddof=1)
    return (_BLOCK * own[whole > 0.0] / whole[whole > 0.0]).tolist()
