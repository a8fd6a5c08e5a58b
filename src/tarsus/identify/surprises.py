"""What varies with what: pulls of groups of data that are no chance.

Where a model is right, the groups' pulls on a number are as often of one sign as of the other, whatever the groups
differ by. Of every number there is the slope of its pulls over each covariate, formed again with the signs of events
exchanged at random, many times; what nearly all of the times no figure of any number exceeds is the limit of all. What
differs between files or sets along no covariate is in the intervals (`tarsus.identify.covariance`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from tarsus.base.arrays import Floats
from tarsus.base.spec import float_paths
from tarsus.identify.checks import GROUND, OFFSET, SHIFTED, touched
from tarsus.identify.estimates import Estimates
from tarsus.identify.influence import CONTACT, EVENT, FILE, ORDER, REPEAT, SPEED, TIME, VOLTS, WITHIN, Influence
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
"""Values of a covariate that are needed: two tell no slope from a difference of two sets."""
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
}
"""What tells more of it."""


@dataclass(frozen=True)
class Surprise:
    """A number that varies with something.

    path; along: what it varies with; strength: over its own standard deviation where all is chance; slope, error: of
    the number [SI] by a unit of what it varies with; half: what it moves the number by from the middle to an end of the
    data [SI].
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
        """The strongest of what a number varies with."""
        return next((one for one in self.found if one.path == path), None)


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
    limit = max(float(np.quantile(most, 1.0 - CHANCE)), float(norm.isf(0.5 * CHANCE)))
    return Surprises(limit, tuple(figures))


def _figures(one: Influence, events: NDArray[np.intp], signs: Floats) -> Iterator[tuple[Surprise, Floats]]:
    """Every slope of an influence, with what it is where the signs (nd, ne) of events are exchanged (nd,)."""
    covariates = [at for at in one.covariates.items() if _places(at[1]) >= _PLACES and np.isfinite(at[1]).all()]
    # what the estimate of all numbers takes off the scores of each part by their sum
    taken = one.information @ np.linalg.inv(one.information.sum(axis=0))
    for j in range(len(one.paths)):
        for along, at in covariates:
            if (figure := _slope(one, j, along, at, taken, events, signs)) is not None:
                yield figure


def _slope(
    one: Influence, j: int, along: str, at: Floats, taken: Floats, events: NDArray[np.intp], signs: Floats
) -> tuple[Surprise, Floats] | None:
    """Of number j over a covariate (n,); None where it would be another number of the same influence."""

    def by_event(rows: Floats) -> Floats:
        out = np.zeros((signs.shape[1], *rows.shape[1:]))
        np.add.at(out, events, rows)
        return out

    known = one.information[:, j, j]
    away = at - float(known @ at) / float(known.sum())
    whole, moved, by = float(known @ away**2), one.information[:, j] * away[:, None], taken[:, j].T @ away
    moved -= taken @ moved.sum(axis=0)  # by what the estimates of all numbers go along
    left = by_event(away * one.score[:, j]) - by_event(one.score) @ by
    told = by_event(away * moved[:, j]) - by_event(moved) @ by
    size = float(left @ left)
    if not (told.sum() > _SAME * whole and size > 0.0):
        return None
    freedom = float(told.sum() ** 2 / (told @ told)) - 1.0
    if freedom < _FREEDOM:
        return None
    unknown = np.zeros(len(signs))
    if one.shared is not None:
        drawn = one.shared[:, :, j] @ away - one.shared.sum(axis=1) @ by
        unknown = np.resize(drawn - drawn.mean(), len(signs))

    def normal(total: Floats, across: Floats) -> Floats:
        """The normal deviations that are as rare as slopes over their errors by what they leave of the events, whose
        distribution is Student's (Wallace 1959)."""
        slope = total / told.sum()
        rest = size - 2.0 * slope * across + slope**2 * float(told @ told)
        square = total**2 / (np.maximum(rest, _SAME * size) + unknown.var())
        shrunk = (8.0 * freedom + 1.0) / (8.0 * freedom + 3.0)
        return np.asarray(shrunk * np.sqrt(freedom * np.log1p(square / freedom)), dtype=np.float64)

    strength, slope = float(normal(left.sum(), left @ told)), float(left.sum() / told.sum())
    # without the slope, which is no chance if it is one; an event that tells much of it has taken it along
    rest = (left - told * slope) / (1.0 - told / told.sum())
    unit = float(one.units[j])
    error = unit * float(np.sqrt(float((left - slope * told) @ (left - slope * told)) + unknown.var()) / told.sum())
    half = 0.5 * abs(slope * unit) * float(np.ptp(at))
    size = float(rest @ rest)
    found = Surprise(one.paths[j], along, strength, slope * unit, error, half)
    return found, normal(signs @ rest + unknown, signs @ (rest * told))


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
    told = surprises([*of.values(), *(() if ground is None else (ground[0],))], seed)
    out, units = dict(steps), float_paths(known.base.scene)
    for number, (name, influence) in enumerate(of.items()):
        step = out[name]
        checks, samples = list(step.checks), step.samples.copy()
        random = np.random.default_rng([seed, 67, number])
        for one in filter(None, map(told.of, influence.paths)):
            k = step.paths.index(one.path)
            if not one.moves(float(step.std[k])):
                continue
            samples[:, k] += one.half * random.uniform(-1.0, 1.0, len(samples))
            # all numbers of a fit depend on what varies
            checks.append(_check(one, told.limit, units[one.path].unit, influence.paths))
        out[name] = replace(step, samples=samples, checks=tuple(checks))
    level = told.of(LEVEL)
    if ground is not None and level is not None and out:
        last = "hysteresis" if "hysteresis" in out else next(reversed(out))
        own = (*touched(known, (GROUND,)), *(path for path in known.paths if path.endswith(OFFSET)))
        check = _check(level, told.limit, "m", own if level.moves(ground[1]) else ())
        out[last] = replace(out[last], checks=(*out[last].checks, check))
    return out


def _check(one: Surprise, limit: float, unit: str, paths: tuple[str, ...]) -> Check:
    far = {one.path: one.half} if one.path in paths else {}
    return Check(
        f"{one.path} over {one.along}",
        one.strength,
        limit,
        paths=paths,
        cause=one.sentence(unit),
        record=one.record,
        far=far,
    )
