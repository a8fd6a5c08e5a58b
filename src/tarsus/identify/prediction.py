"""Whether the identified device predicts the motion in the air, and what each number misses there.

Loops and records in the air, repeats averaged in halves, stand beside their prediction (`tarsus.identify.airborne`).
With the identified numbers and the records' zeros free, and one of the causes that have a line of their own
(`tarsus.identify.causes`), the best fit to every second repeat is judged by what it leaves of the others, both ways
round. A cause is named where it gains there and leaves no more than noise; otherwise it is unknown, and the record that
shows it is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats
from tarsus.identify.airborne import AirRecord, moving
from tarsus.identify.causes import CAUSES, Cause
from tarsus.identify.checks import APART, OVER_NOISE, SURE
from tarsus.identify.draws import within
from tarsus.identify.estimates import Estimates, possible
from tarsus.identify.step import StepResult

_WIDE = 30.0
"""Standard deviations by which identified numbers may move: what they are off where something else is."""
ALIKE = 2.0**0.5
"""Root mean square over the noise of what the best of all such devices leaves, up to which a difference is a small one:
it is no larger than the noise. Of a larger one no record tells how far numbers are off."""
_BOTH = 2.0
"""Times their difference that both readings of a number may be off one way: of the foreign laboratory's spring that
stiffens by 0.3 % both have the first frequency off, its own data by 3.4 times the difference."""
_FREE = 1e3
"""The same where it is asked how far they are off: beyond, a number that the air does not feel would run away."""
_UNFELT = 1e-12
"""Share of the largest information below which records do not feel a direction of the numbers: rounding."""
_ZERO = 10.0
"""Deviations of its noise by which the zero of a displacement may be off."""
_MOST = 0.7
"""Part of what is left beyond noise that a cause must take away to be named: noise is known to 7 %, and what takes away
little of something else is none."""
_OWN = 3
"""Kinds of columns beside those of causes: identified numbers, the instruments', zeros."""


@dataclass(frozen=True)
class AirFit:
    """What all records in the air say together.

    records: their number; values: of samples; predicted: root mean square over the noise that the prediction leaves,
    the zeros free and the identified numbers within their draws; left: the same of every second repeat, the numbers
    free to follow the others; apart: by how many standard deviations of their difference these records and all others
    tell the numbers, along the direction in which they differ most; missed: by path, by how many of its standard
    deviations each number that moves the device in the air may be off; cause: in words, with what to record for it;
    named: the cause, if any has a line of its own and leaves noise.
    """

    records: int
    values: int
    predicted: float
    left: float
    apart: float
    missed: Mapping[str, float]
    cause: str
    record: str
    named: Cause | None = None

    @property
    def off(self) -> bool:
        """Whether the identified device is not that of these records."""
        return self.predicted > OVER_NOISE or self.apart > APART

    @property
    def beyond(self) -> float:
        """By how many of its standard deviations any number may be off: what is wrong may do to it what it does to that
        which is told most differently."""
        return max(self.apart, self.predicted)

    @property
    def widens(self) -> bool:
        """Whether intervals are widened for a difference: a small one, whose cause is unknown."""
        return self.off and self.named is None and self.left <= ALIKE

    def widened(self, step: StepResult) -> StepResult:
        """A step with its draws as far apart as numbers may be off."""
        wider = [1.0 if path in step.taken else self.missed.get(path, self.beyond) for path in step.paths]
        ends = [possible(*one) for one in zip(step.paths, step.values.tolist(), strict=True)]
        samples = step.values + np.array(wider) * (step.samples - step.values)
        _, samples, reached = within(step.values, samples, ends)
        both = {
            name: (value, value + self.beyond * (draws - value), unit)
            for name, (value, draws, unit) in step.combinations.items()
        }
        bounds = dict(step.bounds) | {
            path: one for path, one in zip(step.paths, reached, strict=True) if np.isfinite(one).any()
        }
        return replace(step, samples=samples, combinations=both, bounds=bounds)


@dataclass(frozen=True)
class _Sums:
    """Columns of all records, each for what is believed possible, as sums by half.

    square (2, P, P), cross (2, P), whole (2,): products of columns, of columns and what is left, and of that, over the
    noise; count: of values; believed (p, q): standard deviations of the identified numbers along principal directions
    of their draws; places: of the columns of these directions, of the instruments' numbers, of the zeros, and of each
    cause by number.
    """

    square: Floats
    cross: Floats
    whole: Floats
    count: int
    believed: Floats
    places: tuple[NDArray[np.intp], ...]

    @classmethod
    def of(cls, records: Sequence[AirRecord], known: Estimates) -> _Sums:
        off = (known.samples - known.samples.mean(axis=0))[:, moving(known)]
        _, size, ways = np.linalg.svd(off / np.sqrt(len(off)), full_matrices=False)
        believed = size[:, None] * ways
        made = [[one.columns(air) for one in CAUSES] for air in records]
        widest = (max(len(own[k]) for own in made) for k in range(len(CAUSES)))
        nudges, zeros = len(records[0].nudges), sum(air.points for air in records)
        ends = np.cumsum([0, len(believed), nudges, zeros, *widest])
        square, cross, whole = np.zeros((2, ends[-1], ends[-1])), np.zeros((2, ends[-1])), np.zeros(2)
        count, zero = 0, int(ends[2])
        for air, own in zip(records, made, strict=True):
            x = np.zeros((ends[-1], 2 * air.points, len(air.time)))
            x[: ends[1]] = np.tensordot(believed, air.slopes, 1)
            x[ends[1] : ends[2]] = air.nudges
            for k in range(air.points):
                x[zero, k] = _ZERO * air.white[0, k]
                zero += 1
            for start, columns in zip(ends[3:-1], own, strict=True):
                x[start : start + len(columns)] = np.array(columns).reshape(-1, *x.shape[1:])
            for h, (left, white) in enumerate(zip(air.left, air.white, strict=True)):
                part, rest = (x / white[:, None]).reshape(len(x), -1), (left / white[:, None]).ravel()
                square[h] += part @ part.T
                cross[h] += part @ rest
                whole[h] += rest @ rest
                count += len(rest)
        places = tuple(np.arange(a, b) for a, b in pairwise(ends.tolist()))
        return cls(square, cross, whole, count, believed, places)

    def beside(self, number: int | None = None) -> NDArray[np.intp]:
        """Columns of the identified numbers, the instruments' and the zeros, and those of a cause."""
        more = () if number is None else (self.places[_OWN + number],)
        return np.concatenate([*self.places[:_OWN], *more])

    def fitted(self, columns: NDArray[np.intp], wide: float, halves: Sequence[int] = (0, 1)) -> tuple[Floats, Floats]:
        """Coefficients of columns by some halves, and their covariance; identified numbers may move so many standard
        deviations."""
        at, some = np.ix_(columns, columns), list(halves)
        held = np.where(np.isin(columns, np.concatenate(self.places[:2])), wide**-2.0, 1.0)
        covariance = np.linalg.inv(self.square[some].sum(axis=0)[at] + np.diag(held))
        return covariance @ self.cross[some].sum(axis=0)[columns], covariance

    def left(self, columns: NDArray[np.intp], values: Floats, halves: Sequence[int] = (0, 1)) -> float:
        """Sum of squares that columns leave of some halves."""
        some = list(halves)
        square, cross = self.square[some].sum(axis=0)[np.ix_(columns, columns)], self.cross[some].sum(axis=0)
        return float(self.whole[some].sum() - 2.0 * values @ cross[columns] + values @ square @ values)

    def unseen(self, columns: NDArray[np.intp]) -> float:
        """Sum of squares that columns leave of both halves, each by the coefficients of the other."""
        return sum(self.left(columns, self.fitted(columns, _WIDE, (1 - h,))[0], (h,)) for h in (0, 1))

    def told(self, number: int | None) -> tuple[Floats, Floats]:
        """Information (q, q) and score (q,) of these records about the identified numbers, beside a cause."""
        columns, own = self.beside(number), len(self.believed)
        square = self.square.sum(axis=0)[np.ix_(columns, columns)]
        cross = self.cross.sum(axis=0)[columns]
        beside = np.linalg.solve(square[own:, own:] + np.eye(len(columns) - own), square[own:, :own]).T
        return square[:own, :own] - beside @ square[own:, :own], cross[:own] - beside @ cross[own:]

    def apart(self, number: int | None, scale: float) -> tuple[float, Floats, Floats]:
        """What these records and all others have in common of the identified numbers, what is left being so many times
        the noise: the largest difference along a direction, in its standard deviations; by how many of its standard
        deviations each number moves (p,), and the standard error of that."""
        information, score = self.told(number)
        size, axes = np.linalg.eigh(0.5 * (information + information.T))
        seen = size > _UNFELT * size[-1]
        along, size, axes = axes.T[seen] @ score, size[seen], axes[:, seen]
        most = float(np.sqrt(np.max(along**2 / (size * (scale + size)))))
        length = np.linalg.norm(self.believed, axis=0)
        ways = axes.T @ (self.believed / np.where(length > 0.0, length, 1.0))
        size = size + _FREE**-2.0
        return most, (along / size) @ ways, np.sqrt(np.einsum("dp,d->p", ways**2, scale / size))


def fit_air(records: Sequence[AirRecord], known: Estimates) -> AirFit | None:
    """What records in the air say of what was identified; None without such records, or numbers that move them."""
    own = moving(known)
    if not records or not own:
        return None
    sums = _Sums.of(records, known)
    base, count = sums.beside(), sums.count
    values, _ = sums.fitted(base, 1.0)
    predicted = float(np.sqrt(sums.left(base, values) / count))
    plain = sums.unseen(base)
    rest = {k: sums.unseen(sums.beside(k)) for k in range(len(CAUSES)) if len(sums.places[_OWN + k])}
    best = min(rest, key=rest.__getitem__)
    # a cause is asked for where the numbers, free to move, do not explain the motion, and told if it does
    noise = OVER_NOISE**2 * count
    most = plain - rest[best] > max(SURE, _MOST * (plain - count))
    named = best if plain > noise >= rest[best] and most else None
    scale = max((plain if named is None else rest[best]) / count, 1.0)
    left = float(np.sqrt((plain if named is None else rest[best]) / count))
    apart, off, error = sums.apart(named, scale)
    beyond = np.abs(off)
    if named is None:  # beside what is wrong anywhere, of which either reading may be off by as much as they differ
        beyond = np.hypot(_BOTH * beyond, max(apart, predicted))
    missed = {known.paths[k]: float(by) for k, by in zip(own, beyond, strict=True)}
    if named is not None:
        cause, record = _said(sums, named)
    else:
        sure = dict(zip(missed, np.abs(off) / np.hypot(1.0, error), strict=True))
        cause, record = _where(records) if plain > noise else _differently(sure)
    of = None if named is None else CAUSES[named]
    return AirFit(len(records), count, predicted, left, apart, missed, cause, record, of)


def _said(sums: _Sums, number: int) -> tuple[str, str]:
    """A cause in words, with its estimate, and what to record for it."""
    one = CAUSES[number]
    columns = sums.beside(number)
    values, _ = sums.fitted(columns, _WIDE)
    size = one.size * float(values[np.isin(columns, sums.places[_OWN + number])].sum())
    return f"the motion in the air shows that {one.said.format(size)}", one.record


def _differently(sure: Mapping[str, float]) -> tuple[str, str]:
    """That other values of the numbers explain the motion: which of them differs most, in standard deviations."""
    path = max(sure, key=sure.__getitem__)
    cause = (
        "the motion in the air is that of a device with other numbers than the rest of the records show, the cause is "
        f"unknown: most of all {path}, by {sure[path]:.2g} standard deviations"
    )
    return cause, "repeat loops and sweeps after the records in the air"


def _where(records: Sequence[AirRecord]) -> tuple[str, str]:
    """That the cause is unknown, with the set, channel and frequency that show most of it; and what to record."""
    most = max(records, key=lambda one: float(np.max(_over_noise(one))))
    row = int(np.argmax(_over_noise(most)))
    kind, point = divmod(row, most.points)
    left = most.left.mean(axis=0)[row]
    power = np.abs(np.fft.rfft((left - left.mean()) * np.hanning(len(left)))) ** 2
    hertz = float(np.fft.rfftfreq(len(left), float(most.time[1] - most.time[0]))[int(np.argmax(power))])
    what = ("displacement", "velocity")[kind]
    cause = (
        "the motion in the air is not the predicted one, the cause is unknown: most of it shows in set "
        f"'{most.set}', {what} of '{most.model.points[point]}', {np.max(_over_noise(most)):.2g} times its noise, near "
        f"{hertz:.3g} Hz"
    )
    return cause, f"repeat '{most.set}' at half and at twice its volts, and the loops after it"


def _over_noise(air: AirRecord) -> Floats:
    """What is left of each channel (2 np,) over its noise."""
    left = air.left - air.left.mean(axis=2, keepdims=True) * (np.arange(2 * air.points) < air.points)[:, None]
    return np.sqrt(np.mean(np.mean(left**2, axis=2) / air.white**2, axis=0))
