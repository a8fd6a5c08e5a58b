"""Learning a landing on an unknown ground: from one scalar, or one bit, a step.

Only the simulation knows the hidden ground; the learner is given what a cheap sensor gives: how hard the last step's
impact was (a scalar), or whether the contact was closed at one instant (a bit). It begins with a line of designs for
grounds that are met sooner or later, and searches along it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.spec import float_paths
from tarsus.design.descent import settled
from tarsus.design.grounds import Grounds, Over, drawn, over_of
from tarsus.design.pulse_train import PulseTrain
from tarsus.design.target import Target
from tarsus.design.trials import Trials
from tarsus.fit.valleys import Budget, Visited, follow_down

if TYPE_CHECKING:
    from tarsus.base.workers import Workers
    from tarsus.design.landing_design import LandingDesign
    from tarsus.design.problem import DesignProblem
    from tarsus.design.trials import Landings

Floats = NDArray[np.float64]


class Sensor(Enum):
    """What a learner measures of each step. The value is a word for it."""

    SPEED = "speed"
    """A scalar: how hard the step's impact was."""
    CONTACT = "contact"
    """One bit: whether the contact has closed by the instant at which it is planned to."""


MEMBERS = 9
"""Designs of the line; between them plateaus are interpolated."""
REACH, FIRST = 0.7, 0.02
"""A plateau is made up to twice as long or half as long, and the first step of the search for that: 3 %."""
SEARCH = Budget(generations=24, offspring=10)
"""Search of each member, which begins at its neighbour's end."""
FINEST = 1.0 / 64.0
"""Part of the line below which halving ends: a gap known to 8 um is then known to 0.1 um, less than a foot is rough."""
FIRST_PLACES = (1.0 / 2.0, 1.0 / 6.0, 5.0 / 6.0)
"""Places of the line that a search by scalars begins with: speeds along it may have more than one valley."""
LATE = 0.02
"""A contact that closes later than planned by no more than this share is in time."""
HIDDEN = 40
"""Hidden grounds that a learner is tried on."""
GROWS = 1.5
"""Factor on the step of what was softer, and its fourth root below it for what was not: steady at one success in five
(Rechenberg, Evolutionsstrategie, 1973)."""
LEAST = 1e-3
"""Least first step, parts of a plateau: half a microsecond of 0.5 ms, what a timer of 1 us can still resolve."""
SMALLEST, LARGEST = 0.05, 10.0
"""Limits of the factor on that first step: below a twentieth a timer resolves nothing, ten times it is a jump."""
HELD = 0.2
"""Least share of its length that a hold keeps where plateaus grow: a step that is hardly held is none."""
PRIOR = 64
"""Grounds that the line of designs is spread over."""
UNKNOWN = 0.06
"""Without a box the hidden grounds have gaps, restitution and film within this share of the scene's."""


@dataclass(frozen=True)
class ArrivalLine:
    """Designs (k, S) in the order of the grounds that they are for, those met soonest by one signal first; planned (k,)
    [s]: when their foot arrives there."""

    durations: Floats
    planned: Floats

    @classmethod
    def of(
        cls, trials: Trials, target: Target, start: Floats, near: Callable[[Floats, Floats], Floats], prior: Grounds
    ) -> ArrivalLine:
        """Each the design at ``start``, a signal (1, 2S), searched on for its own ground of the ``prior``.

        ``near`` makes durations (n, S) about some (1, S) from logarithms (n, m) of the lengths of the plateaus.
        """
        levels, first_spans = np.split(start, 2, axis=1)
        arrival = trials.on(start, prior).first[0]
        order = np.argsort(arrival, kind="stable")
        chosen = order[np.linspace(0, len(order) - 1, MEMBERS).round().astype(int)]
        known = np.where(np.isfinite(arrival), arrival, np.inf)[chosen]
        first = int(np.argmin(np.abs(known - np.median(known[np.isfinite(known)]))))
        made = {first: first_spans}
        for j in (first, *range(first + 1, MEMBERS), *range(first - 1, -1, -1)):
            neighbour = made[j - (j > first) + (j < first)]
            made[j] = _searched(trials, target, (levels, neighbour), near, Grounds(prior.rows(chosen[j : j + 1])))
        durations = np.concatenate([made[j] for j in range(MEMBERS)])
        signals = np.concatenate([np.repeat(levels, MEMBERS, axis=0), durations], axis=1)
        return cls(durations, trials.each(signals, prior.rows(chosen)).first)

    def at(self, place: Floats) -> tuple[Floats, Floats]:
        """Durations (n, S) and planned instants (n,) at places (n,) from 0 to 1 along the line."""
        along = np.linspace(0.0, 1.0, len(self.planned))
        spans = np.stack([np.interp(place, along, column) for column in self.durations.T], axis=1)
        known = np.isfinite(self.planned)
        return spans, np.interp(place, along[known], self.planned[known])


def _searched(
    trials: Trials,
    target: Target,
    start: tuple[Floats, Floats],
    near: Callable[[Floats, Floats], Floats],
    ground: Grounds,
) -> Floats:
    """Durations (1, S) that are best about a start on one ground."""
    unknowns = start[1].shape[1] - 2

    def placed(points: Floats) -> Floats:
        return near(start[1], (2.0 * points - 1.0) * REACH)

    def cost(_: NDArray[np.int64], points: Floats) -> Floats:
        signals = np.concatenate([np.repeat(start[0], len(points), axis=0), placed(points)], axis=1)
        return target.scores(trials.on(signals, ground))[:, 0]

    middle, number = np.full((1, unknowns), 0.5), np.zeros(1, dtype=np.int64)
    visited = Visited.empty(unknowns)
    visited.add(number, middle, cost(number, middle))
    follow_down(cost, visited, number, middle, SEARCH, np.random.default_rng(17), step=FIRST)
    best = int(np.argmin(visited.costs))
    return placed(visited.points[best : best + 1])


def by_bits(
    line: ArrivalLine, step: Callable[[Floats], Landings], hidden: int, steps: int, first: Landings
) -> list[Floats]:
    """Speeds (nh,) of every step on hidden grounds, the first one given: the line is halved by whether the contact had
    closed when it was planned to, which says that the ground is not farther than the one designed for. What is played
    in the end is the nearest design that closed in time: one for a nearer ground would miss it and fall from high
    up."""
    low, high = np.zeros(hidden), np.ones(hidden)
    speeds = [first.speed]
    while len(speeds) <= steps:
        fine = high - low <= FINEST
        place = np.where(fine, high, 0.5 * (low + high))
        durations, planned = line.at(place)
        found = step(durations)
        speeds.append(found.speed)
        closed = found.first <= (1.0 + LATE) * planned
        low, high = np.where(closed, low, place), np.where(closed, place, high)
        high = np.where(fine & ~closed, np.minimum(high + 2.0 * FINEST, 1.0), high)
    return speeds


def by_scalars(
    line: ArrivalLine, step: Callable[[Floats], Landings], hidden: int, steps: int
) -> tuple[list[Floats], Floats, Floats]:
    """Speeds (nh,) of at most so many steps on hidden grounds; the softest design (nh, S) of each, its measure (nh,).

    The softest of `FIRST_PLACES` is left by half their distance to one side, then to the other; where neither is
    softer, by half of that. A way that was softer is followed, and what lies behind it is known. Ends where no ground
    has farther to go than `FINEST`."""
    places = [np.full(hidden, one) for one in FIRST_PLACES]
    asked, place, score = places.pop(0), np.full(hidden, 0.5), np.full(hidden, np.inf)
    span, way, turned = np.full(hidden, 1.0 / 6.0), np.ones(hidden), np.zeros(hidden, dtype=bool)
    speeds, best = [], line.at(place)[0]
    while len(speeds) < steps and (span > FINEST).any():
        durations, searched = line.at(asked)[0], len(speeds) >= len(FIRST_PLACES)
        found = step(durations)
        speeds.append(found.speed)
        measured = found.speed
        softer = (measured < score) & (span > FINEST)
        place, score = np.where(softer, asked, place), np.where(softer, measured, score)
        best = np.where(softer[:, None], durations, best)
        if searched:
            failed = ~softer & turned
            span = np.where(failed, 0.5 * span, span)
            way = np.where(~softer & ~turned, -way, way)
            turned = ~failed
        ahead = np.where(span > FINEST, place + way * span, place)
        asked = places.pop(0) if places else np.clip(ahead, 0.0, 1.0)
    return speeds, best, score


@dataclass(frozen=True)
class Learning:
    """What was learned. speeds (nh, steps + 1) [m/s]: hardest touchdown of every step on every hidden ground, first
    that of the design; plain (nh,): of the plain step; regret (nh, steps): sum of what the steps so far struck harder
    than the softest of all on that ground; grounds: the hidden ones; sensor: what was measured."""

    speeds: Floats
    plain: Floats
    regret: Floats
    grounds: Grounds
    sensor: Sensor

    @property
    def halved(self) -> float:
        """Share of the hidden grounds on which some of the first ten steps struck with at most half the plain step's
        speed."""
        return float(np.mean(self.speeds[:, :11].min(axis=1) <= 0.5 * self.plain))


def learn(
    design: LandingDesign,
    steps: int = 30,
    sensor: Sensor | str | None = None,
    *,
    threads: Workers = None,
    hidden: int = HIDDEN,
) -> Learning:
    """Let a landing go on being learned on hidden grounds, all at once, from a scalar or a bit a step.

    A step lasts until the motion has settled, and its last period is measured.

    Parameters
    ----------
    design
        Of `landing`: what the learner begins with, and over which grounds.
    steps
        Of each learner.
    sensor
        What is measured of each step, ``speed`` or ``contact``; that of the design's request unless given.
    threads
        Worker threads, or an executor.
    hidden
        Number of hidden grounds.

    Raises
    ------
    InputError
        For no steps, and for another sensor.
    """
    if steps < 1:
        raise InputError(f"learn: expected one step or more, got {steps}")
    words = [one.value for one in Sensor]
    if sensor is not None and not isinstance(sensor, Sensor) and sensor not in words:
        raise InputError(f"sensor: expected {' or '.join(words)}, got '{sensor}'")
    sensed = design.sensor if sensor is None else Sensor(sensor)
    request, train, seed = settled(replace(design.request, threads=threads)), design.train, design.seed
    trials, rng = Trials(request.runs()), np.random.default_rng([seed, 13])
    over = _around(request, train.foot)
    grounds = drawn(over, hidden, rng)
    start = np.array([[*design.signal.levels, *design.signal.durations]])
    levels, spans = (np.repeat(part, hidden, axis=0) for part in np.split(start, 2, axis=1))

    def step(durations: Floats) -> Landings:
        return trials.each(np.concatenate([levels, durations], axis=1), grounds.values)

    plain = trials.each(np.repeat(train.plain(), hidden, axis=0), grounds.values).speed
    plateaus, target = _Plateaus(train, spans[0], rng), Target(design.before)
    prior = drawn(over, PRIOR, np.random.default_rng([seed, 14]))
    line = ArrivalLine.of(trials, target, start, plateaus.near, prior)
    first = step(spans)
    if sensed is Sensor.CONTACT:
        speeds = by_bits(line, step, hidden, steps, first)
    else:
        speeds = _by_speeds(plateaus, line, step, steps, first)
    table = np.stack(speeds, axis=1)[:, : steps + 1]
    regret = np.cumsum(table[:, 1:] - table.min(axis=1, keepdims=True), axis=1)
    return Learning(table, plain, regret, grounds, sensed)


def _by_speeds(
    plateaus: _Plateaus, line: ArrivalLine, step: Callable[[Floats], Landings], steps: int, first: Landings
) -> list[Floats]:
    """Along the line first. Then every step is the softest so far with all plateaus a little longer or shorter, and
    where that is softer it stays: a strategy of one parent and one child, whose step grows by what succeeds."""
    hidden = len(first.speed)
    along, best, softest = by_scalars(line, step, hidden, steps)
    speeds = [first.speed, *along]
    logs = np.log(line.durations[:, plateaus.moved])
    reach, size = np.maximum(FINEST * np.ptp(logs, axis=0), LEAST), np.ones(hidden)
    while len(speeds) <= steps:
        tried = plateaus.near(best, size[:, None] * reach * plateaus.rng.standard_normal((hidden, len(reach))))
        found = step(tried)
        speeds.append(found.speed)
        softer = found.speed < softest
        best = np.where(softer[:, None], tried, best)
        softest = np.where(softer, found.speed, softest)
        size = np.clip(size * np.where(softer, GROWS, GROWS**-0.25), SMALLEST, LARGEST)
    return speeds


class _Plateaus:
    """The plateaus of a signal that learning moves, and the hold of each edge that gives way to them."""

    def __init__(self, train: PulseTrain, durations: Floats, rng: np.random.Generator) -> None:
        ends = np.cumsum(durations)
        size, self.rng = len(ends), rng
        first = int(np.argmin(np.abs(ends - train.step.supported)))  # the support level ends there
        self.edges = [(list(range(first)), first), (list(range(first + 1, size - 1)), size - 1)]
        self.moved = [i for plateaus, _ in self.edges for i in plateaus]

    def near(self, start: Floats, logs: Floats) -> Floats:
        """Durations (n, S) about a start, (1, S) or (n, S), of logarithms (n, m) of the plateaus' shares of it."""
        found = np.repeat(start, len(logs) // len(start), axis=0)
        before = found.copy()
        found[:, self.moved] = before[:, self.moved] * np.exp(logs)
        for plateaus, hold in self.edges:
            longer = found[:, plateaus].sum(axis=1) - before[:, plateaus].sum(axis=1)
            found[:, hold] = np.maximum(before[:, hold] - longer, HELD * before[:, hold])
        return found


def _around(request: DesignProblem, foot: str) -> Over:
    """What the request is over, else a box about the scene's own gap, restitution and film."""
    if request.over is not None:
        return request.over
    known = float_paths(request.scene)
    names = (f"robot.feet.{foot}.gap", "ground.restitution.coefficient", "ground.film.coefficient")
    middle = {path: known[path].value for path in names if path in known and known[path].value > 0.0}
    ends = {path: ((1.0 - UNKNOWN) * value, (1.0 + UNKNOWN) * value) for path, value in middle.items()}
    over = over_of(request.scene, ends)
    if over is None:
        raise InputError("learn: the scene has no gap, restitution or film to be unknown: name the grounds under over")
    return over
