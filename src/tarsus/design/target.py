"""What a landing is wanted to be: its measure, what it may not give up for it, and exact slopes of every touchdown
along the unknowns, on every ground."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.fit.minimax import CostPieces

if TYPE_CHECKING:
    from tarsus.design.grounds import Grounds
    from tarsus.design.pulses import Family, Step
    from tarsus.design.trials import Landings, Trials
    from tarsus.solve import GradientRun

Floats = NDArray[np.float64]

TIE = 1e-4
"""Of designs that differ by less than this share of the plain step's measure for each touchdown, that with fewer
touchdowns is taken: it lies far below what any instrument tells."""
TINY = 1e-30
"""What a measure of the plain step is at least, that others are compared with: beyond any motion, so that none is 0."""
LOST = 100.0
"""Score, in the plain step's measure, of a run that did not reach its end: worse than any that did."""
BESIDE = 1e-5
"""Step of the difference of switching times and levels by the unknowns: they are squares and lines, of which a central
difference leaves rounding alone."""
EDGE = 1e-5
"""Slopes are taken so far inside the unit cube: a level that is the next one's has none, for their edge comes and
goes."""
NEGLECTED = 0.3
"""Touchdowns softer than this share of the hardest are left out, and so are grounds without a harder one: within a
region of trust they do not come to be the hardest."""


class LandingObjective(Enum):
    """What is minimised. The value is a word for it."""

    SPEED = "speed"
    """Speed of the hardest touchdown of the period [m/s]."""
    IMPULSE = "impulse"
    """Largest impulse of a touchdown [N s]."""
    TOUCHDOWNS = "touchdowns"
    """Number of touchdowns a step, and among equal numbers the speed."""


@dataclass(frozen=True)
class Target:
    """objective; plain: what the plain step does on the nominal ground; contact: least share of its contact; lift:
    least share of its mean height in the air; ringing: greatest overshoot of the highest gap over the mean gap in the
    air, as a share of it (1: twice as high), or None for any."""

    objective: LandingObjective
    plain: Landings
    contact: float = 0.8
    lift: float = 0.8
    ringing: float | None = None

    @property
    def unit(self) -> float:
        """The plain step's measure, that scores are compared with."""
        return max(float(self.measure(self.plain).flat[0]), TINY)

    def measure(self, found: Landings) -> Floats:
        """What is minimised, of any shape."""
        if self.objective is LandingObjective.IMPULSE:
            return found.impulse
        if self.objective is LandingObjective.TOUCHDOWNS:
            fastest = max(float(self.plain.speed.flat[0]), TINY)
            return found.touchdowns + 0.5 * np.minimum(found.speed / fastest, 1.0)
        return found.speed

    def scores(self, found: Landings) -> Floats:
        """Scores of the measure's unit and shape, always finite: the measure, and once the plain step's measure and its
        excess for each thing given up."""
        excess = self.excess(found)
        score = self.measure(found) + TIE * self.unit * found.touchdowns
        score = score + np.where(excess > 0.0, self.unit * (1.0 + excess), 0.0)
        return np.where(np.isfinite(score), score, LOST * self.unit)

    def excess(self, found: Landings) -> Floats:
        """By how much the step is given up: missing shares of contact and lift, and overshoot beyond its limit."""
        contact = self.contact - found.contact / max(float(self.plain.contact.flat[0]), TINY)
        lift = self.lift - found.lifted / max(float(self.plain.lifted.flat[0]), TINY)
        total = np.maximum(contact, 0.0) + np.maximum(lift, 0.0)
        if self.ringing is not None:
            over = found.peak / np.maximum(found.lifted, TINY) - 1.0 - self.ringing
            total = total + np.maximum(over, 0.0)
        return total


def touchdown_pieces(
    trials: Trials,
    step: Step,
    target: Target,
    choices: Sequence[Family],
    at: tuple[int, Floats],
    grounds: Grounds,
) -> CostPieces:
    """Pieces of a design's score at a point (nu,) in the family of a number: every touchdown of its last periods."""
    number, point = at
    point = np.clip(point, EDGE, 1.0 - EDGE)
    signals = step.place(choices, np.array([number]), point[None])
    slopes = _of_signal(step, choices, number, point)
    scores = target.scores(trials.on(signals, grounds))[0]
    active = np.flatnonzero(scores >= NEGLECTED * scores.max())
    moving = np.flatnonzero(np.abs(slopes).max(axis=1) > 0.0)
    try:
        runs = trials.sloped(signals[0], grounds.rows(active), moving.tolist())
    except InputError:  # two levels beside each other are one
        return CostPieces(np.zeros(0), np.zeros((0, len(point))), np.zeros(0, dtype=np.int64), False)
    found = [_of_run(run, trials, target) for run in runs]
    counts = [len(one) for one, _ in found]
    height = np.concatenate([one for one, _ in found])
    along = np.concatenate([by_path for _, by_path in found]) @ slopes[moving]
    known = np.isfinite(along).all(axis=1)
    kept = known & (height >= NEGLECTED * height.max(initial=0.0))
    return CostPieces(height[kept], along[kept], np.repeat(active, counts)[kept], bool(known.all()))


def _of_signal(step: Step, choices: Sequence[Family], number: int, point: Floats) -> Floats:
    """Slopes (2S, nu) of a signal's numbers by the unknowns."""
    nu = len(point)
    low, high = (np.clip(point + side * BESIDE * np.eye(nu), 0.0, 1.0) for side in (-1.0, 1.0))
    below, above = (step.place(choices, np.full(nu, number), one) for one in (low, high))
    return ((above - below) / np.diagonal(high - low)[:, None]).T


def _of_run(run: GradientRun, trials: Trials, target: Target) -> tuple[Floats, Floats]:
    """Measures (k,) of the touchdowns of a run's last periods, and their slopes (k, P) by its paths."""
    hits = trials.numbers_of(run.events)
    slopes = [run.event_gradients[path][hits] for path in run.paths]
    here = run.events[hits]

    def by_path(name: str) -> Floats:
        return np.stack([one[name] for one in slopes], axis=1)

    before = by_path("speed_before") * np.sign(here["speed_before"])[:, None]
    if target.objective is LandingObjective.IMPULSE:
        lost = np.abs(here["speed_before"]) - np.abs(here["speed_after"])
        with np.errstate(divide="ignore", invalid="ignore"):
            impulse = 2.0 * here["energy"] / lost
            of_lost = before - by_path("speed_after") * np.sign(here["speed_after"])[:, None]
            return np.nan_to_num(impulse), (2.0 * by_path("energy") - impulse[:, None] * of_lost) / lost[
                :, None
            ]
    speed = np.abs(here["speed_before"])
    if target.objective is LandingObjective.TOUCHDOWNS:
        share = 0.5 / max(float(target.plain.speed.flat[0]), TINY)
        return len(hits) + share * speed, share * before
    return speed, before
