"""What varies with what: pulls of groups of data that are no chance.

Where a model is right, the groups' pulls on a number are as often of one sign as of the other, whatever the groups
differ by. Of every number there is the slope of its pulls over each covariate, and how far files and sets pull it
apart. All of these are formed again with the signs of events exchanged at random, many times; what nearly all of the
times no figure of any number exceeds is the limit of all.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from tarsus.base.arrays import Floats
from tarsus.base.spec import float_paths
from tarsus.identify.checks import GROUND, OFFSET, SHIFTED, touched
from tarsus.identify.estimates import Estimates
from tarsus.identify.influence import CONTACT, EVENT, FILE, ORDER, REPEAT, SET, SPEED, TIME, VOLTS, WITHIN, Influence
from tarsus.identify.step import Check, StepResult
from tarsus.identify.traces import LEVEL
from tarsus.tables.numbers import amount

CHANCE = 0.01
"""Share of sound campaigns of which something is said here."""
_EXCHANGED = 4000
"""Times that signs are exchanged: forty of them are beyond the limit, which is known to a sixth of their number."""
_FEWEST = 8
"""Events that are needed: the signs of eight can be exchanged in 256 ways, of which one in a hundred is no rarity."""
_PLACES = 3
"""Values of a covariate, and groups of a level, that are needed: two tell no slope from a difference of two sets."""
_FREEDOM = 3.0
"""Degrees of freedom that a slope must have, by what its events say of it: what one or two events say is no rule."""
_SAME = 1e-9
"""Relative scatter below which a figure does not change with the signs, and share of the information on a slope below
which the slope is another number: rounding."""
_PER = {
    ORDER: "a file",
    REPEAT: "a repeat",
    VOLTS: "a volt",
    WITHIN: "a volt",
    SPEED: "for e times the speed",
    CONTACT: "a second",
    TIME: "a second",
}
_RECORD = {
    ORDER: "repeat the first sets of each purpose at the end of the session",
    REPEAT: "repeat a set after a longer pause",
    VOLTS: "record further sets between the lowest and the highest volts",
    WITHIN: "press the foot to the ground by a slow drive of the highest volts",
    SPEED: "record bounces at further speeds of impact",
    CONTACT: "record contacts that last as long as those the number is used for",
    TIME: "record walks that last longer",
    FILE: "repeat each set",
    SET: "record four sets of each purpose, and the first again at the end",
}
"""What shows more of it."""


@dataclass(frozen=True)
class Surprise:
    """A number that varies with something.

    path; along: what it varies with, or the groups that differ by no covariate that is known; strength: over its own
    standard deviation where all is chance; slope, error: of the number [SI] by a unit of what it varies with, NaN of
    groups; half: what it moves the number by from the middle to an end of the data [SI].
    """

    path: str
    along: str
    strength: float
    slope: float
    error: float
    half: float

    @property
    def record(self) -> str:
        """What to record for it."""
        return _RECORD[self.along]

    def sentence(self, unit: str = "1") -> str:
        """In words, with a unit [SI] of the number."""
        if np.isnan(self.slope):
            return f"{self.path} differs from {self.along} to {self.along} by {amount(self.half, unit, 2)}"
        way = "rises" if self.slope > 0.0 else "falls"
        size, error = (amount(one, unit, 2) for one in (abs(self.slope), self.error))
        return f"{self.path} {way} with {self.along}: {size} (+- {error}) {_PER[self.along]}"

    def moves(self, std: float) -> bool:
        """Whether it moves a number with this standard deviation farther than its interval reaches."""
        return self.half > SHIFTED * std


@dataclass(frozen=True)
class Surprises:
    """limit: strength that chance reaches once in a hundred campaigns; figures: of all numbers, strongest first."""

    limit: float
    figures: tuple[Surprise, ...]

    @property
    def found(self) -> tuple[Surprise, ...]:
        """Those beyond the limit."""
        return tuple(one for one in self.figures if one.strength > self.limit)

    def of(self, path: str) -> Surprise | None:
        """What is said of a number: the strongest of what it varies with, else of the groups it differs between."""
        own = [one for one in self.found if one.path == path]
        return min(own, key=lambda one: (bool(np.isnan(one.slope)), -one.strength), default=None)


def surprises(influences: Sequence[Influence], seed: int) -> Surprises:
    """Figures of all numbers under one limit."""
    figures, most = list[Surprise](), np.zeros(_EXCHANGED)
    for number, one in enumerate(influences):
        events = np.unique(one.levels[EVENT if EVENT in one.levels else FILE], return_inverse=True)[1]
        if events.max() + 1 < _FEWEST:
            continue
        random = np.random.default_rng([seed, 61, number])
        signs = random.choice([-1.0, 1.0], size=(_EXCHANGED, int(events.max()) + 1))
        for figure, by_chance in _figures(one, events, signs):
            figures.append(figure)
            most = np.maximum(most, by_chance)
    figures.sort(key=lambda one: -one.strength)
    # no figure is less of a surprise than one alone would be, whose signs may be few
    limit = max(float(np.quantile(most, 1.0 - CHANCE)), -float(ndtri(0.5 * CHANCE)))
    return Surprises(limit, tuple(figures))


@dataclass(frozen=True)
class _Number:
    """What the data say of number j of an influence being another one in some of their parts: score (n,) and
    information (n,) of it in each part; what the estimate of all numbers takes off the scores by their sum: taken (p,
    n, p), of this number by (n, p); sums (ne, p) of the scores of events; events (n,)."""

    one: Influence
    j: int
    score: Floats
    information: Floats
    taken: Floats
    by: Floats
    sums: Floats
    events: NDArray[np.intp]

    @classmethod
    def of(cls, one: Influence, j: int, events: NDArray[np.intp]) -> _Number:
        taken = one.information @ np.linalg.inv(one.information.sum(axis=0))
        sums = np.zeros((int(events.max()) + 1, len(one.paths)))
        np.add.at(sums, events, one.score)
        return cls(
            one, j, one.score[:, j], one.information[:, j, j], taken.transpose(2, 0, 1), taken[:, j], sums, events
        )

    def by_event(self, rows: Floats) -> Floats:
        """Sums (ne, ...) of rows (n, ...) over the events."""
        out = np.zeros((len(self.sums), *rows.shape[1:]))
        np.add.at(out, self.events, rows)
        return out

    def summed(self, weights: Floats, score: Floats, sums: Floats) -> Floats:
        """Weighted sums (ne, k) of scores (n,) over each event, less what the estimate takes off them by the sums (ne,
        p) of all numbers' scores; weights (n, k)."""
        return self.by_event(weights * score[:, None]) - sums @ (self.by.T @ weights)

    def pushed(self, weights: Floats) -> Floats:
        """Weighted sums (nd, k) of what earlier steps do not know, as often as signs are exchanged; weights (n, k)."""
        if self.one.shared is None:
            return np.zeros((_EXCHANGED, weights.shape[1]))
        out = self.one.shared[:, :, self.j] @ weights - self.one.shared.sum(axis=1) @ (self.by.T @ weights)
        return np.resize(out - out.mean(axis=0), (_EXCHANGED, weights.shape[1]))

    def slope(self, along: str, signs: Floats) -> tuple[Surprise, Floats] | None:
        """Over a covariate; None where it would be another number of the same influence."""
        at = self.one.covariates[along]
        away = (at - float(self.information @ at) / float(self.information.sum()))[:, None]
        whole, moved = float(self.information @ away[:, 0] ** 2), self.one.information[:, self.j] * away
        moved -= np.tensordot(moved.sum(axis=0), self.taken, 1)  # by what the estimates of all numbers go along
        left, known = (
            self.summed(away, self.score, self.sums),
            self.summed(away, moved[:, self.j], self.by_event(moved)),
        )
        left, known = left[:, 0], known[:, 0]
        size = float(np.sum(left**2))
        if not (known.sum() > _SAME * whole and size > 0.0):
            return None
        freedom = float(known.sum() ** 2 / np.sum(known**2)) - 1.0
        if freedom < _FREEDOM:
            return None

        unknown = self.pushed(away)[:, 0]

        def student(total: Floats, across: Floats) -> Floats:
            """Squares of slopes over their errors, by what they leave of the events."""
            slope = total / known.sum()
            rest = size - 2.0 * slope * across + slope**2 * float(np.sum(known**2))
            return np.asarray(total**2 / (np.maximum(rest, _SAME * size) + unknown.var()), dtype=np.float64)

        def normal(square: Floats) -> Floats:
            """The normal deviation that is as rare as Student's (Wallace 1959)."""
            shrunk = (8.0 * freedom + 1.0) / (8.0 * freedom + 3.0)
            return np.asarray(shrunk * np.sqrt(freedom * np.log1p(square / freedom)), dtype=np.float64)

        square = student(left.sum(), left @ known)
        slope = float(left.sum()) * float(self.one.units[self.j]) / float(known.sum())
        error = abs(slope) / float(np.sqrt(square)) if square > 0.0 else np.inf
        half = 0.5 * abs(slope) * float(np.ptp(at))
        found = Surprise(self.one.paths[self.j], along, float(normal(square)), slope, error, half)
        # without the slope, which is no chance if it is one; an event that says much of it has taken it along
        left = (left - known * float(left.sum()) / float(known.sum())) / (1.0 - known / known.sum())
        size = float(np.sum(left**2))
        return found, normal(student(signs @ left + unknown, signs @ (left * known)))

    def apart(self, level: str, signs: Floats) -> tuple[Surprise, Floats] | None:
        """From group to group of a level; None where no exchange of signs moves them."""
        weights = np.equal.outer(self.one.levels[level], np.unique(self.one.levels[level])).astype(np.float64)
        weights = weights[:, self.information @ weights > 0.0]  # groups that say something of the number
        if weights.shape[1] < 2:
            return None
        own, left = self.by_event(weights * self.information[:, None]), self.summed(weights, self.score, self.sums)
        known, seen = own.sum(axis=0), own > 0.0
        whole = float(np.sum(left[seen] ** 2 / own[seen]))  # of events, in groups and between them
        freedom = len(known) - 1.0, float(np.count_nonzero(seen)) - len(known)
        if not freedom[1] >= _FREEDOM:
            return None

        def normal(between: Floats) -> Floats:
            """The normal deviation that is as rare as a variance ratio (Paulson 1942)."""
            ratio = between / freedom[0] / np.maximum(whole - between, _SAME * whole) * freedom[1]
            shrunk = [2.0 / (9.0 * one) for one in freedom]
            top = (1.0 - shrunk[1]) * np.cbrt(ratio) - (1.0 - shrunk[0])
            return np.asarray(top / np.sqrt(shrunk[0] + shrunk[1] * np.cbrt(ratio) ** 2), dtype=np.float64)

        between = np.sum(left.sum(axis=0) ** 2 / known)
        strength = normal(between)
        by_chance = np.sum((signs @ left + self.pushed(weights)) ** 2 / known, axis=1)
        chance = normal(by_chance)
        if not chance.std() > _SAME:
            return None
        beyond = max(float(between - by_chance.mean()), 0.0) / float(known.sum() - np.sum(known**2) / known.sum())
        half = float(np.sqrt(beyond) * self.one.units[self.j])
        found = Surprise(
            self.one.paths[self.j], level, float((strength - chance.mean()) / chance.std()), np.nan, np.nan, half
        )
        return found, (chance - chance.mean()) / chance.std()


def _figures(one: Influence, events: NDArray[np.intp], signs: Floats) -> Iterator[tuple[Surprise, Floats]]:
    """Every figure of an influence, with what it is where the signs (nd, ne) of events are exchanged (nd,)."""
    for j in range(len(one.paths)):
        number = _Number.of(one, j, events)
        along = (name for name, at in one.covariates.items() if _places(at) >= _PLACES and np.isfinite(at).all())
        levels = (name for name in (FILE, SET) if name in one.levels and _places(one.levels[name]) >= _PLACES)
        tried = (*(number.slope(name, signs) for name in along), *(number.apart(name, signs) for name in levels))
        yield from (figure for figure in tried if figure is not None)


def _places(values: NDArray[np.generic]) -> int:
    return len(np.unique(values))


def with_surprises(
    steps: Mapping[str, StepResult], known: Estimates, ground: tuple[Influence, float] | None, seed: int
) -> dict[str, StepResult]:
    """Steps with what their numbers vary with as checks, and their draws over the range that a number has in the data.

    Parameters
    ----------
    steps
        By name.
    known
        All numbers, for their units.
    ground
        Where files show the ground, with the standard error of the level [m].
    seed
        Of the signs that are exchanged.
    """
    of = {name: one.influence for name, one in steps.items() if one.influence is not None}
    varying = surprises([*of.values(), *(() if ground is None else (ground[0],))], seed)
    out, units = dict(steps), float_paths(known.base.scene)
    for number, (name, influence) in enumerate(of.items()):
        step = out[name]
        checks, samples = list(step.checks), step.samples.copy()
        random = np.random.default_rng([seed, 67, number])
        for one in filter(None, map(varying.of, influence.paths)):
            k = step.paths.index(one.path)
            if not one.moves(float(step.std[k])):
                continue
            if not np.isnan(one.slope):
                samples[:, k] += one.half * random.uniform(-1.0, 1.0, len(samples))
            # what differs from file to file is in the interval, and all numbers of a fit depend on what varies
            paths = () if one.along == FILE else influence.paths
            checks.append(_check(one, varying.limit, units[one.path].unit, paths))
        out[name] = replace(step, samples=samples, checks=tuple(checks))
    level = varying.of(LEVEL)
    if ground is not None and level is not None and out:
        last = "hysteresis" if "hysteresis" in out else next(reversed(out))
        own = (*touched(known, (GROUND,)), *(path for path in known.paths if path.endswith(OFFSET)))
        check = _check(level, varying.limit, "m", own if level.moves(ground[1]) else ())
        out[last] = replace(out[last], checks=(*out[last].checks, check))
    return out


def _check(one: Surprise, limit: float, unit: str, paths: tuple[str, ...]) -> Check:
    name = f"{one.path} over {one.along}" if one.along in _PER else f"{one.path} from {one.along} to {one.along}"
    far = {one.path: one.half} if one.path in paths else {}
    return Check(name, one.strength, limit, paths=paths, cause=one.sentence(unit), record=one.record, far=far)
