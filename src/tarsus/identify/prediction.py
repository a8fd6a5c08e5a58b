"""Whether the identified device predicts the motion in the air, and what each number misses there.

Loops and records in the air are compared with their prediction (`tarsus.identify.free_motion`). What the best fit with
the identified numbers and the records' zeros free leaves has an unknown cause, and the record that shows it is named.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.identify.checks import APART, OVER_NOISE
from tarsus.identify.draws import within
from tarsus.identify.estimates import Estimates, possible
from tarsus.identify.free_motion import AirRecord, moving
from tarsus.identify.step import StepResult

_WIDE = 30.0
"""Standard deviations by which identified numbers may move: what they are off where something else is."""
ALIKE = 2.0**0.5
"""Root mean square over the noise of what the best of all such devices leaves, up to which a difference is a small one:
it is no larger than the noise. Of a larger one no record shows how wrong numbers are."""
_BOTH = 2.0
"""Times their difference that both readings of a number may err in one direction: of the foreign laboratory's spring
that stiffens by 0.3 % both have the first frequency wrong, its own data by 3.4 times the difference."""
_FREE = 1e3
"""The same where it is asked how far they are off: beyond, a number that the air does not feel would run away."""
_UNSEEN = 1e-12
"""Share of the largest information below which records do not feel a direction of the numbers: rounding."""
_ZERO = 10.0
"""Deviations of its noise by which the zero of a displacement may be off."""


@dataclass(frozen=True)
class AirFit:
    """What all records in the air say together.

    records: their number; values: of samples; predicted: root mean square over the noise that the prediction leaves,
    the zeros free and the identified numbers within their draws; left: the same with the numbers free;
    apart: by how many standard deviations of their difference these records and all others determine the numbers, along
    the direction in which they differ most; missed: by path, by how many of its standard deviations each number that
    moves the device in the air may be off; cause: in words, with what to record for it.
    """

    records: int
    values: int
    predicted: float
    left: float
    apart: float
    missed: Mapping[str, float]
    cause: str
    record: str

    @property
    def off(self) -> bool:
        """Whether the identified device is not that of these records."""
        return self.predicted > OVER_NOISE or self.apart > APART

    @property
    def beyond(self) -> float:
        """By how many of its standard deviations any number may be off: what is wrong may move it as far as that on
        which records differ most."""
        return max(self.apart, self.predicted)

    @property
    def widens(self) -> bool:
        """Whether intervals are widened for a difference: a small one."""
        return self.off and self.left <= ALIKE

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
    """Columns of all records, each for what is believed possible, as sums.

    square (P, P), cross (P,), whole: products of columns, of columns and what is left, and of that, over the noise;
    count: of values; believed (p, q): standard deviations of the identified numbers along principal directions of
    their draws. Columns are these directions, then delays, then zeros.
    """

    square: Floats
    cross: Floats
    whole: float
    count: int
    believed: Floats

    @classmethod
    def of(cls, records: Sequence[AirRecord], known: Estimates) -> _Sums:
        deviations = (known.samples - known.samples.mean(axis=0))[:, moving(known)]
        _, size, ways = np.linalg.svd(deviations / np.sqrt(len(deviations)), full_matrices=False)
        believed = size[:, None] * ways
        own, delays = len(believed), len(records[0].delays)
        zero, size = own + delays, own + delays + sum(air.points for air in records)
        square, cross, whole, count = np.zeros((size, size)), np.zeros(size), 0.0, 0
        for air in records:
            x = np.zeros((size, 2 * air.points, len(air.time)))
            x[:own] = np.tensordot(believed, air.slopes, 1)
            x[own : own + delays] = air.delays
            for k in range(air.points):
                x[zero, k] = _ZERO * air.white[0, k]
                zero += 1
            for left, white in zip(air.left, air.white, strict=True):
                part, rest = (x / white[:, None]).reshape(len(x), -1), (left / white[:, None]).ravel()
                square += part @ part.T
                cross += part @ rest
                whole += float(rest @ rest)
                count += len(rest)
        return cls(square, cross, whole, count, believed)

    def left(self, wide: float) -> float:
        """Root mean square that the best columns leave; identified numbers may move so many standard deviations."""
        held = np.ones(len(self.cross))
        held[: len(self.believed)] = wide**-2.0
        values = np.linalg.solve(self.square + np.diag(held), self.cross)
        return float(np.sqrt((self.whole - 2.0 * values @ self.cross + values @ self.square @ values) / self.count))

    def information(self) -> tuple[Floats, Floats]:
        """Information (q, q) and score (q,) of these records about the identified numbers."""
        own, square, cross = len(self.believed), self.square, self.cross
        eliminated = np.linalg.solve(square[own:, own:] + np.eye(len(cross) - own), square[own:, :own]).T
        return square[:own, :own] - eliminated @ square[own:, :own], cross[:own] - eliminated @ cross[own:]

    def apart(self, scale: float) -> tuple[float, Floats, Floats]:
        """What these records and all others have in common of the identified numbers, what is left being so many times
        the noise: the largest difference along a direction, in its standard deviations; by how many of its standard
        deviations each number moves (p,), and the standard error of that."""
        information, score = self.information()
        size, axes = np.linalg.eigh(0.5 * (information + information.T))
        seen = size > _UNSEEN * size[-1]
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
    predicted, left = sums.left(1.0), sums.left(_WIDE)
    apart, off, error = sums.apart(max(left**2, 1.0))
    # added to what is wrong anywhere: either reading may err by as much as they differ
    beyond = np.hypot(_BOTH * off, max(apart, predicted))
    missed = {known.paths[k]: float(by) for k, by in zip(own, beyond, strict=True)}
    sure = dict(zip(missed, np.abs(off) / np.hypot(1.0, error), strict=True))
    cause, record = _where(records) if left > OVER_NOISE else _differently(sure)
    return AirFit(len(records), sums.count, predicted, left, apart, missed, cause, record)


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
