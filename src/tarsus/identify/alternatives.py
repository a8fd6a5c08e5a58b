"""Differences from the model as hypotheses, each scored on records that it was not fitted to.

A `Difference` is one more unknown, or a few, of the motion in the air (`tarsus.identify.airborne`), linear in it. With
the identified numbers and the records' zeros free beside it, it is fitted to every second repeat of each set and judged
by what it leaves of the others, both ways round. Half of what it gains there in chi-squared is the logarithm of its
likelihood ratio, by which the alternatives, and the model as it is, are weighed. One that has nearly all of the weight
is the cause; where none has, those that share it are rivals, and all that any of them touches is in doubt.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.signal import lfilter

from tarsus.base.arrays import Floats
from tarsus.fit.verdict import LEVEL
from tarsus.identify.airborne import AirRecord, moving
from tarsus.identify.checks import GROUND, LAW, LOAD, STRUCTURE, SURE
from tarsus.identify.estimates import Estimates
from tarsus.identify.foot import BEYOND, response
from tarsus.identify.loops import AWAY, across
from tarsus.model.drive.laws import PrandtlIshlinskii
from tarsus.model.structure import Beam

Columns = Callable[[AirRecord], list[Floats]]

_WIDE = 30.0
"""Standard deviations by which identified numbers may move beside an alternative: what they are off because of it."""
_ZERO = 10.0
"""Deviations of its noise by which the zero of a displacement may be off."""
_REFINED = 3
"""Alternatives, the likeliest ones, that are formed again about the numbers that go with them: those of the model alone
are off by what the difference has done to them, and traces are products of both."""
_TOLD = 0.2
"""Part of what the prediction leaves beyond noise that the likeliest difference must take away to be named: a third
mode, whose loops and sweeps were misread as well, takes 0.4; whatever is likeliest where every record begins at another
time, 0.04."""
_CREEPS = (0.03, 0.3, 3.0)
"""Times [s] after which a late share of a force may follow: within a record, about one, and over it."""
_OWN = 4
"""Kinds of columns beside those of alternatives: identified numbers, the instruments', zeros, the film."""
_PLAYS = np.arange(0.02, 1.0, 0.02)
"""Thresholds of plays, as shares of the widest voltage: others are nearly a sum of neighbours."""
_RATIOS = (0.01, 0.1)
"""Damping ratios of a further mode, between which sums of both lie."""


@dataclass(frozen=True)
class Difference:
    """A difference from the model that the air shows.

    name; cause: in words, ``{:.3g}`` for what is estimated; columns: the traces it leaves in a record, each for as much
    of it as is believed possible; size: of that, in the unit of the cause; together: how many columns' coefficients are
    added for the estimate, 0 where none is given; touches: parts of the paths of the numbers that depend on it.
    """

    name: str
    cause: str
    columns: Columns
    size: float
    touches: tuple[str, ...]
    together: int = 1


def _late(x: float, v: float) -> Columns:
    """So many times 20 us by which displacements and velocities are late; nothing of a delay that was found of the
    instruments, whose error is free beside all differences."""

    def columns(air: AirRecord) -> list[Floats]:
        found = air.instruments is not None and (air.instruments.late if v else air.instruments.lags)
        return [] if found and x else [air.seen(-20e-6 * x * air.moved[1], -20e-6 * v * air.moved[2])]

    return columns


def _clock_off(air: AirRecord) -> list[Floats]:
    late = -1e-3 * air.time
    return [air.seen(late * air.moved[1], late * air.moved[2])]


def _spring_stiffens(air: AirRecord) -> list[Floats]:
    """A tenth more stiffness of the first mode where it moves the foot by a gap, with the square and with the size of
    its deflection from the neutral position."""
    model, n = air.model, len(air.model.mass)
    square, shapes = eigh(model.stiffness, model.mass, subset_by_index=[0, 0])
    shape = np.asarray(shapes[:, 0], dtype=np.float64)
    back = model.mass @ shape
    whole = back @ (air.states[:n] + air.rest[:, None])
    still, gap = float(back @ air.rest), model.gap / abs(float(model.row @ shape))
    force = -0.1 * float(square[0]) * np.array([(whole**3 - still**3) / gap**2, (whole**2 - still**2) / gap])
    return [air.pushed(back[:, None] * one) for one in force]


def _air_drags(air: AirRecord) -> list[Floats]:
    """A force on the foot against its speed and with the square of it, at the speed of a foot that swings by a gap a
    thousandth more of damping ratio of the first mode."""
    model, speed = air.model, air.speed
    force = -0.1 * model.like_damping * speed * np.abs(speed) / (model.gap * model.slowest)
    return [air.pushed(model.row[:, None] * force)]


def _drive_creeps(air: AirRecord) -> list[Floats]:
    """A tenth of the drive's force that follows late."""
    force, out = air.force - float(air.model.law.force(np.zeros(1), air.model.history)[0]), []
    mean = 0.5 * (force[1:] + force[:-1]) + air.jumped
    for time in _CREEPS:
        share = -np.expm1(-float(air.fine[1]) / time)
        late = np.concatenate([[0.0], np.real(lfilter([share], [1.0, share - 1.0], mean))])
        out.append(air.pushed(0.1 * np.outer(air.model.load, late)))
    return out


def _other_thresholds(air: AirRecord) -> list[Floats]:
    """Plays with thresholds between those assumed, each as heavy as the whole law is steep."""
    law = air.model.law
    if not isinstance(law, PrandtlIshlinskii) or not law.thresholds:
        return []
    steep = abs(law.linear) + float(np.abs(law.weights).sum())
    widest = max(law.thresholds) * (1.0 + 1.0 / len(law.thresholds))
    thresholds = tuple((widest * _PLAYS).tolist())
    plays = law.model_copy(update={"thresholds": thresholds, "weights": (0.0,) * len(thresholds)})
    states = plays.states(air.volts, air.model.history)
    at_rest = plays.states(np.zeros(1), air.model.history)[0]
    return [
        air.pushed(air.model.load[:, None] * (steep * one))
        for one in np.asarray(states - at_rest, dtype=np.float64).T
    ]


def _further_mode(air: AirRecord) -> list[Floats]:
    """A mode that the structure has not, at the frequency of the strongest line that is left of the velocities, that
    moves each point by a twentieth of the static motion."""
    power = np.abs(np.fft.rfft(air.left[0, air.points :] * np.hanning(len(air.time)), axis=1)) ** 2
    at = 1 + int(np.argmax(power[:, 1:].sum(axis=0)))
    omega = 2.0 * np.pi * float(np.fft.rfftfreq(len(air.time), float(air.time[1]))[at])
    force, out = air.force - air.force[0], []
    for ratio in _RATIOS:
        flow = np.array([[0.0, 1.0], [-(omega**2), -2.0 * ratio * omega]])
        push, jumped = (np.stack([0.0 * one, omega**2 * one]) for one in (force, air.jumped))
        x, v = response(flow, push, float(air.fine[1] - air.fine[0]), jumped)
        for k in range(air.points):
            only = 0.05 * float(np.abs(air.model.by_drive).max()) * (np.arange(air.points) == k)[:, None]
            out.append(air.shown(np.concatenate([only * x, only * v])))
    return out


def _volts_attract(air: AirRecord) -> list[Floats]:
    """A pull on the foot towards the ground by the square of the volts, ``V^2 / (g + g_e)^2``: in contact a tenth of
    the force that bends the foot by its gap."""
    row, ways = air.model.row[:, None], _ways(air)
    return [
        air.pushed(-10.0 * air.model.like_attraction(beyond) * row * (air.volts / way) ** 2)
        for beyond, way in ways
    ]


def _other_film(air: AirRecord) -> list[Floats]:
    """What a film is off beside the one found of other records, near the ground: in contact by as much as damps the
    first mode by a tenth."""
    if air.gap > AWAY * air.model.gap:
        return []
    damped = -10.0 * air.model.like_damping * air.speed
    return [air.pushed(air.model.row[:, None] * damped * (beyond / way) ** 3) for beyond, way in _ways(air)]


def _ways(air: AirRecord) -> list[tuple[float, Floats]]:
    """Gaps [m] in contact, and ways (nf,) [m] from the foot across these."""
    return [(part * air.model.gap, air.height + part * air.model.gap) for part in BEYOND]


def _by_shape(air: AirRecord, shape: Floats, k: int) -> Floats:
    """The k-th coordinate's motion in another shape (np,)."""
    x, v = (shape[:, None] * air.states[at] for at in (k, len(air.rest) + k))
    return air.shown(np.concatenate([x, v]))


def _other_shapes(air: AirRecord) -> list[Floats]:
    """A twentieth of each mode's motion across its shape at the points: what lies along it is the drive's share."""
    return [
        _by_shape(air, 0.05 * float(np.linalg.norm(shape)) * aside, k)
        for k, shape in enumerate(air.model.rows.T)
        for aside in across(shape)
    ]


def _tip_longer(air: AirRecord) -> list[Floats]:
    """A tip that is a twentieth longer beside its beam, of the same frequencies, by what it turns the shapes."""
    structure, path = air.model.scene.robot.structure, "robot.structure.tip_length"
    if not isinstance(structure, Beam):
        return []
    rows, longer = air.model.rows, air.model.changed({path: 1.05 * structure.tip_length}).rows
    sides = [across(shape) for shape in rows.T]
    turned = [
        side.T @ (side @ other) * (shape @ shape) / (shape @ other)
        for side, shape, other in zip(sides, rows.T, longer.T, strict=True)
    ]
    return [sum((_by_shape(air, one, k) for k, one in enumerate(turned)), start=np.zeros(()))]


def _gains_off(air: AirRecord) -> list[Floats]:
    out = []
    for k in range(2 * air.points):
        only = 0.05 * (np.arange(2 * air.points) == k)[:, None] * np.concatenate(air.moved[:2])
        out.append(air.seen(only[: air.points], only[air.points :]))
    return out


_ALL = (STRUCTURE, LOAD, LAW, GROUND)
_DRIVEN = (LOAD, LAW, GROUND)

DIFFERENCES = (
    Difference(
        "displacements late",
        "the displacements are {:.3g} us late behind the voltage: a delay of their channels",
        _late(1.0, 0.0), 20.0, _DRIVEN,
    ),
    Difference(
        "velocities late",
        "the velocities are {:.3g} us late behind the voltage: a delay of their channels",
        _late(0.0, 1.0), 20.0, _ALL,
    ),
    Difference(
        "all late",
        "all motion is {:.3g} us late behind the voltage: a delay, or a low-pass filter, between the two",
        _late(1.0, 1.0), 20.0, _ALL,
    ),
    Difference(
        "clock", "the clock of the motion is {:.3g} ppm slower than that of the voltage", _clock_off, 1e3, _ALL
    ),
    Difference(
        "spring",
        "the structure stiffens as it bends: its first mode is {:.3g} % stiffer (cubic spring) where it moves the foot "
        "by a gap",
        _spring_stiffens, 10.0, _ALL,
    ),
    Difference(
        "drag",
        "damping grows with speed, as by drag of the air: a ratio of {:.3g} % more where the foot swings by a gap",
        _air_drags, 0.1, _ALL,
    ),
    Difference("creep", "creep of the drive: {:.3g} % of its force follows late", _drive_creeps, 10.0, _DRIVEN, 3),
    Difference(
        "thresholds", "other thresholds of the plays than those of the device file", _other_thresholds, 1.0, _DRIVEN, 0
    ),
    Difference("mode", "a further mode that the structure has not", _further_mode, 1.0, _ALL, 0),
    Difference(
        "attraction",
        "the volts attract the foot, by their square: in contact at 10 V with {:.3g} % of the force that bends it by "
        "its gap",
        _volts_attract, 10.0, _DRIVEN, 3,
    ),
    Difference(
        "shapes", "the modes move the points in other shapes than those of the device file's geometry", _other_shapes,
        1.0, _DRIVEN, 0,
    ),
    Difference(
        "tip", "the tip is {:+.3g} % off its length in the device file, beside its beam", _tip_longer, 5.0, _DRIVEN
    ),
    Difference("gains", "a gain of a channel that is off", _gains_off, 1.0, _DRIVEN, 0),
)  # fmt: skip


@dataclass(frozen=True)
class Weighed:
    """An alternative as the records see it: estimate and standard error in the unit of its cause (NaN where it has
    none); gain: in chi-squared, over what is left, of the halves it was not fitted to; weight among its rivals; shift:
    by how many of its standard deviations it moves an identified number at most, with what identified the number; moves
    (m,): of the numbers that move (`tarsus.identify.airborne.moving`), in their units."""

    difference: Difference
    estimate: float
    error: float
    gain: float
    weight: float
    shift: float
    moves: Floats

    def sentence(self) -> str:
        """The cause, with what it gains."""
        return self.difference.cause.format(self.estimate)


@dataclass(frozen=True)
class AirFit:
    """What all records in the air say together.

    records: their number; values: of samples; predicted, left: root mean square over the noise that the prediction
    leaves, the zeros free and the identified numbers within their draws, and that the alternatives leave; pull: root
    mean square, in standard deviations, by which the records pull the identified numbers; found: alternatives in the
    order they were taken, each with those that share its weight; none where the likeliest explains next to nothing.
    """

    records: int
    values: int
    predicted: float
    left: float
    pull: float
    found: tuple[Weighed, ...]


@dataclass(frozen=True)
class _Sums:
    """Columns of all records, each for what is believed possible, as sums by half.

    square (2, P, P), cross (2, P), whole (2,): products of columns, of columns and what is left, and of that, over the
    noise; count: of values; believed (p, q): standard deviations of the identified numbers along principal directions
    of their draws; places: of the columns of these directions, of the instruments' numbers, of the zeros, of what a
    film is off, and of each alternative by number.
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
        of_each = (_other_film, *(one.columns for one in DIFFERENCES))
        made = [[columns(air) for columns in of_each] for air in records]
        widest = (max(len(own[k]) for own in made) for k in range(len(of_each)))
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

    @property
    def told(self) -> NDArray[np.intp]:
        """Columns of the identified numbers, the instruments' and the zeros."""
        return np.concatenate(self.places[: _OWN - 1])

    @property
    def base(self) -> NDArray[np.intp]:
        """These, and what a film is off: detachments, which tell it, know nothing of most differences."""
        return np.concatenate(self.places[:_OWN])

    def with_alternative(self, number: int) -> NDArray[np.intp]:
        """The base, and an alternative's columns."""
        return np.concatenate([self.base, self.places[_OWN + number]])

    def fitted(
        self, columns: NDArray[np.intp], wide: float, halves: Sequence[int] = (0, 1)
    ) -> tuple[Floats, Floats]:
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

    def moved(self, known: Estimates, number: int) -> Estimates:
        """What was identified, with the values that go with an alternative."""
        values = known.values.copy()
        step = self.fitted(self.with_alternative(number), _WIDE)[0][: len(self.believed)]
        values[moving(known)] += step @ self.believed
        return replace(known, values=values)

    def shift(self, number: int) -> float:
        """By how many of its standard deviations an alternative moves an identified number at most."""
        held = (self.fitted(columns, 1.0)[0] for columns in (self.with_alternative(number), self.base))
        beside, plain = (values[: len(self.believed)] @ self.believed for values in held)
        size = np.linalg.norm(self.believed, axis=0)
        return float(np.max(np.abs(beside - plain)[size > 0.0] / size[size > 0.0], initial=0.0))


def drawn_over(known: Estimates, fit: AirFit | None, seed: int) -> Estimates:
    """What was identified, with draws over the differences that share the weight, and over the model as it is.

    A draw under a difference has structure and drive moved as the difference moves them; other numbers follow by the
    regression on these that their own draws have. One that has nearly all of the weight is no scatter: it caps words.
    """
    shares = [one.weight for one in fit.found] if fit is not None else []
    if fit is None or not shares or max(shares) >= LEVEL:
        return known
    own, off = moving(known), known.samples - known.samples.mean(axis=0)
    follow = np.linalg.lstsq(off[:, own], off, rcond=None)[0]
    moves = np.vstack([np.zeros(len(known.paths)), [one.moves @ follow for one in fit.found]])
    chances = np.array([max(1.0 - sum(shares), 0.0), *shares])
    picked = np.random.default_rng([seed, 37]).choice(len(moves), len(off), p=chances / chances.sum())
    return replace(known, samples=known.samples + moves[picked])


def fit_air(records_of: Callable[[Estimates], Sequence[AirRecord]], known: Estimates) -> AirFit | None:
    """Weigh all alternatives on records in the air; None without such records, or identified numbers that move.

    Parameters
    ----------
    records_of
        The records beside the device as identified, or with other values of it.
    known
        What was identified.
    """
    records = records_of(known) if moving(known) else ()
    if not records:
        return None
    sums = _Sums.of(records, known)
    base, count = sums.base, sums.count
    values, _ = sums.fitted(sums.told, 1.0)
    predicted = np.sqrt(sums.left(sums.told, values) / count)
    pull = np.sqrt(np.mean(values[: len(sums.believed)] ** 2))
    plain = sums.unseen(base)
    tried = [k for k in range(len(DIFFERENCES)) if len(sums.places[_OWN + k])]
    about = dict.fromkeys(tried, sums)
    rest = {k: sums.unseen(sums.with_alternative(k)) for k in tried}
    likely = [k for k in sorted(tried, key=rest.__getitem__) if plain - rest[k] > SURE][:_REFINED]
    for k in likely:
        moved = sums.moved(known, k)
        others = records_of(moved)
        if [len(one.time) for one in others] != [len(one.time) for one in records]:
            continue  # with these numbers the device lands where the record does not, or is none
        again = _Sums.of(others, moved)
        if (unseen := again.unseen(again.with_alternative(k))) < rest[k]:
            about[k], rest[k] = again, unseen
    best = min(tried, key=rest.__getitem__)
    scale = max(rest[best] / count, 1.0)
    found = _weighed(about, rest, plain, scale)
    if not found or found[0].gain < SURE:
        left = sums.left(base, sums.fitted(base, _WIDE)[0])
        return AirFit(len(records), count, float(predicted), float(np.sqrt(left / count)), float(pull), ())
    columns = about[best].with_alternative(best)
    left = about[best].left(columns, about[best].fitted(columns, _WIDE)[0]) / count
    told = predicted**2 - left >= _TOLD * (predicted**2 - 1.0)
    shared = tuple(one for one in found if told and one.weight > 1.0 - LEVEL)
    return AirFit(len(records), count, float(predicted), float(np.sqrt(left)), float(pull), shared)


def _weighed(
    about: Mapping[int, _Sums], rest: Mapping[int, float], plain: float, scale: float
) -> list[Weighed]:
    """Alternatives with what they leave unseen, the likeliest first, beside the model as it is."""
    gains = {k: (plain - one) / scale for k, one in rest.items()}
    top = max(0.0, *gains.values())
    total = np.exp(-0.5 * top) + sum(np.exp(0.5 * (gain - top)) for gain in gains.values())
    out = []
    for k, gain in gains.items():
        one, sums = DIFFERENCES[k], about[k]
        columns = sums.with_alternative(k)
        values, covariance = sums.fitted(columns, _WIDE)
        own = np.isin(columns, sums.places[_OWN + k][: one.together])
        estimate = one.size * float(values[own].sum()) if one.together else np.nan
        error = (
            one.size * float(np.sqrt(covariance[np.ix_(own, own)].sum() * scale)) if one.together else np.nan
        )
        weight = float(np.exp(0.5 * (gain - top)) / total)
        moves = values[: len(sums.believed)] @ sums.believed
        out.append(Weighed(one, estimate, error, float(gain), weight, sums.shift(k), moves))
    return sorted(out, key=lambda one: -one.gain)
