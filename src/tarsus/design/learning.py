"""Learning a landing without a model: stochastic approximation from one scalar, or one bit, a step.

The hidden ground is known to nobody but the simulation; the learner is given what a cheap sensor gives: how hard the
last step struck (a scalar), or whether the contact was closed at one instant (a bit).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.design.arrivals import ArrivalLine, by_bits
from tarsus.design.over import Box, Ensemble, Grounds
from tarsus.design.request import Request, Sensor
from tarsus.design.target import Target
from tarsus.design.trials import Landings, Trials

__all__ = ["Learning", "learn_on_hidden_grounds"]

Floats = NDArray[np.float64]

HIDDEN = 40
"""Hidden grounds that a learner is tried on."""
GAIN, PROBE = 1.0, 0.02
"""First step of the iterate and of its probes, parts of a plateau: simultaneous perturbations (Spall, IEEE Trans.
Automat. Contr. 37, 1992) with the decays 0.602 and 0.101 that he recommends. A probe of 2 % moves a plateau of 0.5 ms
by 10 us: with 6 % the probes themselves strike harder than the ground's being unknown does."""
PRIOR = 64
"""Grounds that the line of designs for a learner by bits is spread over."""
UNKNOWN = 0.06
"""Without a box the hidden grounds have gaps, restitution and film within this share of the scene's."""


@dataclass(frozen=True)
class Learning:
    """What was learned. speeds (nh, steps + 1) [m/s]: hardest touchdown of every step on every hidden ground, first
    that of the design; plain (nh,): of the plain step; regret (nh, steps): sum of what the steps so far struck harder
    than the softest of all on that ground; grounds: the hidden ones; sensor: what was told."""

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
    request: Request,
    target: Target,
    start: tuple[Floats, Floats],
    steps: int,
    hidden: int = HIDDEN,
) -> Learning:
    """Let a design (1, S) learn for so many steps on hidden grounds, all at once.

    A step lasts until the motion has settled, and its last period is felt.
    """
    rng = np.random.default_rng([request.options.seed, 13])
    grounds = _grounds(request, hidden, rng)
    levels = np.repeat(start[0], hidden, axis=0)

    def step(durations: Floats) -> Landings:
        return trials(levels, durations, grounds, every=True)

    held = [np.repeat(one, hidden, axis=0) for one in request.step.plain()]
    plain = trials(held[0], held[1], grounds, every=True).speed
    learner = _Learner(request, np.repeat(start[1], hidden, axis=0), rng)
    if request.options.sensor is Sensor.CONTACT:
        prior = _grounds(request, PRIOR, np.random.default_rng([request.options.seed, 14]))
        line = ArrivalLine.of(trials, target, start, learner.near, prior)
        speeds = by_bits(line, step, hidden, steps, step(learner.durations()))
    else:
        speeds = _by_speeds(learner, step, target, steps)
    table = np.stack(speeds, axis=1)[:, : steps + 1]
    regret = np.cumsum(table[:, 1:] - table.min(axis=1, keepdims=True), axis=1)
    return Learning(table, plain, regret, grounds, request.options.sensor)


def _by_speeds(
    learner: _Learner, step: Callable[[Floats], Landings], target: Target, steps: int
) -> list[Floats]:
    """Two steps probe to either side of the iterate, the third is the iterate itself."""
    first = step(learner.durations())
    best, softest = learner.durations(), target.measure(first)
    speeds = [first.speed]
    while len(speeds) <= steps:
        plus, minus = learner.probes()
        felt = [step(plus), step(minus)]
        up, down = (target.measure(one) for one in felt)
        learner.update((up - down) / np.maximum(up + down, 1e-30))
        now = learner.durations()
        felt.append(step(now))
        for durations, one in zip((plus, minus, now), felt, strict=True):
            better = target.measure(one) <= softest
            best = np.where(better[:, None], durations, best)
            softest = np.where(better, target.measure(one), softest)
            speeds.append(one.speed)
        learner.back_to(best, softest, target.measure(felt[2]))
    return speeds


class _Learner:
    """Iterates (nh, m) of the plateaus' lengths, as logarithms of their share of the start."""

    def __init__(self, request: Request, durations: Floats, rng: np.random.Generator) -> None:
        self.start, self.rng, self.round = durations, rng, 0
        landing, size = _plateaus(request, durations)
        self.moved = landing
        self.hold = size
        self.iterate = np.zeros((len(durations), len(landing)))
        self.sign = np.zeros_like(self.iterate)

    def durations(self, given: Floats | None = None) -> Floats:
        """Durations (nh, S) of iterates."""
        return self.near(self.start, self.iterate if given is None else given)

    def near(self, start: Floats, logs: Floats) -> Floats:
        """Durations (n, S) about a start, (1, S) or (n, S), of logarithms (n, m)."""
        found = np.repeat(start, len(logs) // len(start), axis=0)
        before = found.copy()
        found[:, self.moved] = before[:, self.moved] * np.exp(logs)
        for plateaus, hold in self.hold:
            longer = found[:, plateaus].sum(axis=1) - before[:, plateaus].sum(axis=1)
            found[:, hold] = np.maximum(before[:, hold] - longer, 0.2 * before[:, hold])
        return found

    def probes(self) -> tuple[Floats, Floats]:
        self.round += 1
        self.reach = PROBE / self.round**0.101
        self.sign = self.rng.choice([-1.0, 1.0], size=self.iterate.shape)
        up, down = (self.iterate + side * self.reach * self.sign for side in (1.0, -1.0))
        return self.durations(up), self.durations(down)

    def update(self, difference: Floats) -> None:
        """Move against the slope, by the difference (nh,) of the two probes as a share of their sum."""
        step = -2.0 * GAIN * PROBE / self.round**0.602 * difference[:, None] * self.sign
        self.iterate = np.clip(self.iterate + step, -1.0, 1.0)

    def back_to(self, durations: Floats, score: Floats, mine: Floats) -> None:
        """Return to the best step so far where the last one struck harder."""
        lost = mine > score
        logs = np.log(durations[:, self.moved] / self.start[:, self.moved])
        self.iterate = np.where(lost[:, None], logs, self.iterate)


def _plateaus(request: Request, durations: Floats) -> tuple[list[int], list[tuple[list[int], int]]]:
    """Numbers of the plateaus, and those of each edge with the hold that gives way to them."""
    ends = np.cumsum(durations[0])
    size = len(ends)
    first = int(np.argmin(np.abs(ends - request.step.supported)))  # the support level ends there
    edges = [(list(range(first)), first), (list(range(first + 1, size - 1)), size - 1)]
    return [i for plateaus, _ in edges for i in plateaus], edges


def _grounds(request: Request, hidden: int, rng: np.random.Generator) -> Grounds:
    """So many grounds, drawn from what the request is over."""
    over, scene = request.over, request.scene
    if isinstance(over, Ensemble):
        members = over.grounds(scene)
        rows = rng.choice(len(members), hidden, p=members.weights)
        return Grounds({p: own[rows] for p, own in members.values.items()}, np.full(hidden, 1.0 / hidden))
    if not isinstance(over, Box):
        from tarsus.base.spec import float_paths

        known = float_paths(scene)
        names = (
            f"robot.feet.{request.foot}.gap",
            "ground.restitution.coefficient",
            "ground.film.coefficient",
        )
        paths = tuple(path for path in names if path in known and known[path].value > 0.0)
        middle = np.array([known[path].value for path in paths])
        over = Box(paths, (1.0 - UNKNOWN) * middle, (1.0 + UNKNOWN) * middle)
    points = over.at(rng.random((hidden, len(over.paths))))
    return Grounds({p: points[:, i] for i, p in enumerate(over.paths)}, np.full(hidden, 1.0 / hidden))
