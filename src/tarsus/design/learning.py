"""Learning a landing on a ground that nobody knows: from one scalar, or one bit, a step.

The hidden ground is known to nobody but the simulation; the learner is given what a cheap sensor gives: how hard the
last step struck (a scalar), or whether the contact was closed at one instant (a bit).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.spec import float_paths
from tarsus.design.arrivals import FINEST, ArrivalLine, by_bits, by_scalars
from tarsus.design.grounds import Grounds, Over, drawn, over_of
from tarsus.design.landing_request import LandingRequest, Sensor
from tarsus.design.target import Target
from tarsus.design.trials import Landings, Trials

__all__ = ["Learning", "learn_on_hidden_grounds"]

Floats = NDArray[np.float64]

HIDDEN = 40
"""Hidden grounds that a learner is tried on."""
GROWS = 1.5
"""Factor on the step of what was softer, and its fourth root below it for what was not: steady at one success in five
(Rechenberg, Evolutionsstrategie, 1973)."""
LEAST = 1e-3
"""Least first step, parts of a plateau: half a microsecond of 0.5 ms, what a timer of 1 us can still tell."""
PRIOR = 64
"""Grounds that the line of designs is spread over."""
UNKNOWN = 0.06
"""Without a box the hidden grounds have gaps, restitution and film within this share of the scene's."""


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


def learn_on_hidden_grounds(
    trials: Trials,
    request: LandingRequest,
    target: Target,
    start: Floats,
    steps: int,
    hidden: int = HIDDEN,
) -> Learning:
    """Let a design, a signal (1, 2S), learn for so many steps on hidden grounds, all at once.

    A step lasts until the motion has settled, and its last period is measured.
    """
    rng = np.random.default_rng([request.options.seed, 13])
    over = _around(request)
    grounds = drawn(over, hidden, rng)
    levels, spans = (np.repeat(part, hidden, axis=0) for part in np.split(start, 2, axis=1))

    def step(durations: Floats) -> Landings:
        return trials.each(np.concatenate([levels, durations], axis=1), grounds.values)

    plain = trials.each(np.repeat(request.step.plain(), hidden, axis=0), grounds.values).speed
    plateaus = _Plateaus(request, spans[0], rng)
    prior = drawn(over, PRIOR, np.random.default_rng([request.options.seed, 14]))
    line = ArrivalLine.of(trials, target, start, plateaus.near, prior)
    first = step(spans)
    if request.options.sensor is Sensor.CONTACT:
        speeds = by_bits(line, step, hidden, steps, first)
    else:
        speeds = _by_speeds(plateaus, line, step, target, steps, first)
    table = np.stack(speeds, axis=1)[:, : steps + 1]
    regret = np.cumsum(table[:, 1:] - table.min(axis=1, keepdims=True), axis=1)
    return Learning(table, plain, regret, grounds, request.options.sensor)


def _by_speeds(
    plateaus: _Plateaus,
    line: ArrivalLine,
    step: Callable[[Floats], Landings],
    target: Target,
    steps: int,
    first: Landings,
) -> list[Floats]:
    """Along the line first. Then every step is the softest so far with all plateaus a little longer or shorter, and
    where that is softer it stays: a strategy of one parent and one child, whose step grows by what succeeds."""
    hidden = len(first.speed)
    along, best, softest = by_scalars(line, step, target, hidden, steps)
    speeds = [first.speed, *along]
    logs = np.log(line.durations[:, plateaus.moved])
    reach, size = np.maximum(FINEST * np.ptp(logs, axis=0), LEAST), np.ones(hidden)
    while len(speeds) <= steps:
        tried = plateaus.near(
            best, size[:, None] * reach * plateaus.rng.standard_normal((hidden, len(reach)))
        )
        found = step(tried)
        speeds.append(found.speed)
        softer = target.measure(found) < softest
        best = np.where(softer[:, None], tried, best)
        softest = np.where(softer, target.measure(found), softest)
        size = np.clip(size * np.where(softer, GROWS, GROWS**-0.25), 0.05, 10.0)
    return speeds


class _Plateaus:
    """The plateaus of a signal that learning moves, and the hold of each edge that gives way to them."""

    def __init__(self, request: LandingRequest, durations: Floats, rng: np.random.Generator) -> None:
        ends = np.cumsum(durations)
        size, self.rng = len(ends), rng
        first = int(np.argmin(np.abs(ends - request.step.supported)))  # the support level ends there
        self.edges = [(list(range(first)), first), (list(range(first + 1, size - 1)), size - 1)]
        self.moved = [i for plateaus, _ in self.edges for i in plateaus]

    def near(self, start: Floats, logs: Floats) -> Floats:
        """Durations (n, S) about a start, (1, S) or (n, S), of logarithms (n, m) of the plateaus' shares of it."""
        found = np.repeat(start, len(logs) // len(start), axis=0)
        before = found.copy()
        found[:, self.moved] = before[:, self.moved] * np.exp(logs)
        for plateaus, hold in self.edges:
            longer = found[:, plateaus].sum(axis=1) - before[:, plateaus].sum(axis=1)
            found[:, hold] = np.maximum(before[:, hold] - longer, 0.2 * before[:, hold])
        return found


def _around(request: LandingRequest) -> Over:
    """What the request is over, else a box about the scene's own gap, restitution and film."""
    if request.over is not None:
        return request.over
    known = float_paths(request.scene)
    names = (f"robot.feet.{request.foot}.gap", "ground.restitution.coefficient", "ground.film.coefficient")
    middle = {path: known[path].value for path in names if path in known and known[path].value > 0.0}
    ends = {path: ((1.0 - UNKNOWN) * value, (1.0 + UNKNOWN) * value) for path, value in middle.items()}
    over = over_of(request.scene, ends)
    if over is None:
        raise InputError(
            "learn: the scene has no gap, restitution or film to be unknown: name the grounds under over"
        )
    return over
