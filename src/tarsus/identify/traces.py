"""Records as the steps use them: motion of the measured points from their rest, with its noise, and the volts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError, InputProblem
from tarsus.identify.volts import Volts, moved
from tarsus.impacts.detection import STILL, runs_of
from tarsus.records.clipping import digit_of
from tarsus.records.measurement import Measurement, Quantity

_FEWEST_AT_REST = 8
"""Samples at rest from which noise is estimated: to a quarter of itself then."""
_SAME = 8.0
"""Deviations within which two places are the same ground, the means of many samples being compared."""
_FOLLOWS = 0.15
"""Part of the usual motion per volt that a foot on the ground may still show."""
_SURE = 3.0
"""Deviations by which motion per volt must be known to tell standing from hovering."""

SHORTEST = 6
"""Samples a hold must last."""


@dataclass(frozen=True)
class Trace:
    """One record: displacements x (np, ns) [m] from the rest before the drive, velocities v (np, ns) [m/s], volts
    (ns,).

    file; set: name of the set of records it belongs to; points (np); time (ns,) [s], 0 where the drive begins;
    noise_x, noise_v (np,): standard deviations of a sample; zero (np,) [m]: standard deviation of the zero of x;
    gap [m]: of the foot at the neutral position in this record, None where it is the device's own; order: of its file
    among those of the campaign, in which they were recorded unless stated otherwise."""

    file: str
    set: str
    points: tuple[str, ...]
    time: Floats
    x: Floats
    v: Floats
    volts: Floats
    noise_x: Floats
    noise_v: Floats
    zero: Floats
    gap: float | None = None
    order: int = 0

    @property
    def step(self) -> float:
        """Sampling step [s]."""
        return float((self.time[-1] - self.time[0]) / (len(self.time) - 1))

    @cached_property
    def between(self) -> Volts:
        """The volts between the samples as well."""
        return Volts.of(self.volts)

    def point(self, name: str) -> int:
        """Row of a point."""
        return self.points.index(name)


def repeats_of(traces: Sequence[Trace]) -> dict[str, list[Trace]]:
    """Records by the name of their set."""
    out: dict[str, list[Trace]] = {}
    for one in traces:
        out.setdefault(one.set, []).append(one)
    return out


def comparable(traces: Sequence[Trace], fewest: int = 2) -> list[list[Trace]]:
    """Repeats of each set that has so many, all as long as each other."""
    return [
        repeats
        for repeats in repeats_of(traces).values()
        if len(repeats) >= fewest and len({(one.x.shape, round(one.step, 12)) for one in repeats}) == 1
    ]


def trace_of(
    record: Measurement,
    points: Sequence[str],
    name: str,
    drive: str,
    rest: float,
    gap: float | None = None,
    late: float = 0.0,
    pace: float = 0.0,
) -> Trace:
    """A record with its zeros and its noise taken from the rest before the drive.

    Parameters
    ----------
    record
        Displacement and velocity of every point, and the drive; its clock starts with the record.
    points
        Names of points (np).
    name
        Of the set it belongs to.
    drive
        Name of the drive's channel.
    rest
        Time [s] the record lasts before the drive begins.
    gap
        Of the foot at the neutral position [m].
    late
        Time [s] by which the motion was recorded behind the drive: times and volts are those of the motion.
    pace
        Share by which its clock runs slow compared with the drive's, so that its samples lie farther apart: they agree
        where the drive begins.

    Raises
    ------
    InputError
        For points without a channel, a missing drive, or a rest too short to tell the zero.
    """
    problems: list[InputProblem] = []
    found: dict[tuple[str, Quantity], int] = {}
    for k, channel in enumerate(record.channels):
        found.setdefault((channel.at, channel.quantity), k)
    for point in points:
        for quantity, word in ((Quantity.DISPLACEMENT, "displacement"), (Quantity.VELOCITY, "velocity")):
            if (point, quantity) not in found:
                problems.append(InputProblem.at(record.source, f"no channel is the {word} of point '{point}'"))
    if drive not in record.names:
        problems.append(InputProblem.at(record.source, f"the drive is missing: there is no channel '{drive}'"))
    count = int(np.floor(rest / record.step * (1.0 + 1e-9)))
    still = count + min(int(np.floor(late / record.step)), 0)
    if still < _FEWEST_AT_REST:
        problems.append(
            InputProblem.at(
                record.source,
                f"{still} samples at rest before the drive begins, {_FEWEST_AT_REST} or more are needed to know the "
                "zero and the noise",
            )
        )
    if problems:
        raise InputError(problems)
    x = record.values[[found[point, Quantity.DISPLACEMENT] for point in points]]
    v = record.values[[found[point, Quantity.VELOCITY] for point in points]]
    quiet_x, quiet_v = x[:, :still], v[:, :still]
    if still_channels := [
        channel.name
        for channel, row in zip(record.channels, record.values, strict=True)
        if channel.at in points and not np.ptp(row) > 0.0
    ]:
        raise InputError(
            [
                InputProblem.of_channel(record.source, name, "has one value throughout: its noise is not known")
                for name in still_channels
            ]
        )
    noise_x, noise_v = (
        np.array([_noise(*one) for one in zip(*both, strict=True)]) for both in ((quiet_x, x), (quiet_v, v))
    )
    return Trace(
        record.source,
        name,
        tuple(points),
        record.step * (1.0 + pace) * (np.arange(record.count, dtype=np.float64) - count) - late,
        x - quiet_x.mean(axis=1, keepdims=True),
        v - quiet_v.mean(axis=1, keepdims=True),
        moved(record[drive], late / record.step, pace, float(count)),
        noise_x,
        noise_v,
        noise_x / np.sqrt(still),
        gap,
    )


def _noise(quiet: Floats, whole: Floats) -> float:
    """Standard deviation of a sample, by those at rest. Within one step of the converter they show no noise, but are as
    uncertain as that, which is no larger than any between them."""
    std = float(quiet.std(ddof=1))
    return std if std > digit_of(quiet) / np.sqrt(12.0) > 0.0 else max(std, digit_of(whole) / np.sqrt(12.0))


@dataclass(frozen=True)
class Hold:
    """A stretch in which the foot stands still on the ground: first and last sample of it, and the samples between
    which the foot was last seen moving before."""

    first: int
    last: int


def contact_level(traces: Sequence[Trace], foot: str, driven: bool = False) -> tuple[float, float] | None:
    """Displacement of the foot in contact, from the rest [m], and its standard error; None where no record touches.

    In every record the lowest of the places where the foot stands still for a while; over records their weighted
    mean, without those that disagree with most. A foot may hover above the ground as well; in records whose drive moves
    slowly (``driven``) it stands only where the drive moves it no more, which it still does where it turns in the
    air."""
    found = stands_of(traces if driven else (), () if driven else traces, foot)
    if found is None:
        return None
    same = np.abs(found.levels - np.median(found.levels)) < STILL * found.errors
    levels, weight = found.levels[same], found.errors[same] ** -2.0
    value = float(np.sum(weight * levels) / weight.sum())
    scatter = float(np.sum(weight * (levels - value) ** 2) / max(len(levels) - 1, 1))
    return value, float(np.sqrt(max(scatter, 1.0) / weight.sum()))


LEVEL = "the level of the ground"
"""Where records show the ground, from the rest [m]."""
_PIECES = 8
"""Pieces of a stretch on the ground at most: volts that rise and fall within one still differ between them."""


@dataclass(frozen=True)
class Stands:
    """Where n records show the ground, in m pieces of the stretches in which their foot stands.

    traces (n); levels, errors (n,) [m]: from the rest; of (m,): number of the record of a piece; share (m,): of what
    the record says; off (m,) [m]: the level in the piece beyond that of its record; volts (m,) [V]: the same of the
    voltage.
    """

    traces: tuple[Trace, ...]
    levels: Floats
    errors: Floats
    of: NDArray[np.intp]
    share: Floats
    off: Floats
    volts: Floats


def stands_of(slow: Sequence[Trace], fast: Sequence[Trace], foot: str) -> Stands | None:
    """Stands of records with a slow drive, and of others; None where no foot stands. The error of a level is its own,
    and as far as most records are from the middle one."""
    each = [(one, _pieces(one, foot, k < len(slow))) for k, one in enumerate((*slow, *fast))]
    seen = [(one, pieces) for one, pieces in each if len(pieces)]
    if not seen:
        return None
    levels, own, rows = np.zeros(len(seen)), np.zeros(len(seen)), []
    for k, (trace, pieces) in enumerate(seen):
        place, error, volts = pieces.T
        share = error**-2.0 / np.sum(error**-2.0)
        levels[k], own[k] = (share @ place, np.hypot(np.sum(error**-2.0) ** -0.5, trace.zero[trace.point(foot)]))
        rows.append(np.column_stack([np.full(len(place), k), share, place - levels[k], volts - share @ volts]))
    spread = 1.4826 * float(np.median(np.abs(levels - np.median(levels))))
    of, share, off, volts = np.concatenate(rows).T
    return Stands(tuple(one for one, _ in seen), levels, np.hypot(own, spread), of.astype(np.intp), share, off, volts)


def _pieces(trace: Trace, foot: str, driven: bool) -> Floats:
    """Of the stretches in which the foot of one record stands still lowest, pieces (m, 3): the place in each [m], its
    standard error [m] and the volts."""
    k = trace.point(foot)
    x, v, noise = trace.x[k], trace.v[k], float(trace.noise_x[k])
    if np.ptp(x) < 6.0 * STILL * noise:
        return np.zeros((0, 3))
    still = (np.abs(v) < STILL * trace.noise_v[k]) & (x < x.min() + 2.0 * STILL * noise)
    usual = float(np.ptp(x) / max(float(np.ptp(trace.volts)), 1e-300))
    found = [
        (first + 1, last)
        for first, last in runs_of(still)
        if last - first >= 2 * SHORTEST and not (driven and _moved(trace, k, first, last, usual))
    ]
    if not found:
        return np.zeros((0, 3))
    runs = np.array(found)
    mean, error = _means(x, runs), noise / np.sqrt(np.diff(runs, axis=1)[:, 0])
    low = mean - _SAME * error < (mean + 2.0 * error).min()
    parts = np.concatenate([_split(first, last) for first, last in runs[low].tolist()])
    error = noise / np.sqrt(np.diff(parts, axis=1)[:, 0])
    return np.column_stack([_means(x, parts), error, _means(trace.volts, parts)])


def _split(first: int, last: int) -> NDArray[np.intp]:
    """Parts (m, 2) of a stretch, the longer ones first."""
    count = last - first
    number = np.arange(min(_PIECES, count // SHORTEST) + 1)
    size, longer = divmod(count, number[-1])
    ends = first + size * number + np.minimum(number, longer)
    return np.column_stack([ends[:-1], ends[1:]])


def _means(values: Floats, parts: NDArray[np.intp]) -> Floats:
    """Means (n,) of values over parts (n, 2): first place of each, and the one after its last."""
    return np.add.reduceat(np.append(values, 0.0), parts.ravel())[::2] / np.diff(parts, axis=1)[:, 0]


def _moved(trace: Trace, point: int, first: int, last: int, usual: float) -> bool:
    """Whether a foot that looks still follows the drive, or the drive moves too little to tell.

    Its motion per volt, on each way of the voltage, against the ``usual`` one over the whole record [m/V]."""
    part = slice(first + 1, last)
    volts, x = trace.volts[part], trace.x[point, part]
    up = np.diff(trace.volts[first + 1 : last + 1]) > 0.0
    top, bottom = 0.0, 0.0
    for way in (up, ~up):
        if np.count_nonzero(way) > 1:
            off = volts[way] - volts[way].mean()
            top += float(off @ x[way])
            bottom += float(off @ off)
    if bottom <= 0.0 or trace.noise_x[point] / np.sqrt(bottom) > _FOLLOWS / _SURE * usual:
        return True
    return abs(top / bottom) > _FOLLOWS * usual


def misplaced(trace: Trace, foot: str, level: float) -> str | None:
    """A sentence if a record's foot goes below the ground, or another point stands still where the foot should.

    This is what swapped channels look like, or a displacement with a wrong zero, sign or unit.
    """
    k = trace.point(foot)
    limit = _SAME * trace.noise_x[k] + 0.05 * abs(level)
    depth = level - float(np.quantile(trace.x[k], 0.001))
    if depth <= limit:
        return None
    for other, name in enumerate(trace.points):
        if other == k:
            continue
        low = float(np.quantile(trace.x[other], 0.001))
        if abs(low - level) < _SAME * trace.noise_x[other] + 0.05 * abs(level):
            return (
                f"channels '{foot}' and '{name}' look swapped: it is '{name}' that stops where the other "
                "records show the ground"
            )
    return (
        f"channel '{foot}' goes {1e6 * depth:.3g} um below the ground that the other records show: are its "
        "zero, sign and "
        "unit right?"
    )


def holds(trace: Trace, foot: str, level: float) -> list[Hold]:
    """Stretches in which the foot stands still at the contact level [m]."""
    k = trace.point(foot)
    near = np.abs(trace.x[k] - level) < STILL * trace.noise_x[k] + 3.0 * trace.zero[k]
    still = near & (np.abs(trace.v[k]) < STILL * trace.noise_v[k])
    joined: list[Hold] = []
    for first, last in runs_of(still):
        if joined and first - joined[-1].last <= 2 and bool(np.all(near[joined[-1].last : first])):
            joined[-1] = replace(joined[-1], last=last)
        else:
            joined.append(Hold(first, last))
    return [one for one in joined if one.last - one.first + 1 >= SHORTEST and _on_ground(trace, k, one, level)]


def _on_ground(trace: Trace, k: int, hold: Hold, level: float) -> bool:
    """Whether a hold is at the contact level on the mean of its samples, rather than just above it."""
    inside = trace.x[k, hold.first : hold.last + 1]
    error = trace.noise_x[k] / np.sqrt(len(inside))
    return bool(abs(float(inside.mean()) - level) < STILL * np.hypot(error, trace.zero[k]))
