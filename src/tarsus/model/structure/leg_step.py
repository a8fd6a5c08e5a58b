"""What a step of voltage does to a leg near rest: the figures (4.1), as corrected in erratum E12."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.model.structure.base import Array
from tarsus.model.structure.leg import Leg
from tarsus.model.structure.leg_motion import standing_load

SWINGS = 1e-9
"""Share of a rate that has to be imaginary for a motion to swing: rounding of an eigenvalue is 1e-15 of the largest."""


@dataclass(frozen=True)
class StepLift:
    """Answer of the linearised leg to a step to its rated voltage, from rest under its load.

    static: lift that remains [m]; peak: lift at the first peak [m]; peak_time: when [s], infinite for a leg
    that creeps up without a peak, which then has ``peak == static``; lifted: greatest load that the driven leg
    holds at or above its height without load [N]; standing: greatest load under which the nonlinear leg stands at
    0 V [N], see `standing_load`.
    """

    static: float
    peak: float
    peak_time: float
    lifted: float
    standing: float

    @property
    def capacity(self) -> float:
        """Load capacity [N]: what the leg both lifts and, undriven, stands under."""
        return min(self.lifted, self.standing)

    @property
    def mean_speed(self) -> float:
        """Lift at the first peak over the time to it [m/s]: (4.1) as corrected in E12; 0 without a peak."""
        return self.peak / self.peak_time


def step_lift(leg: Leg) -> StepLift:
    """Figures of a step to the rated voltage, exact for the linearised leg (`Leg.linearised`) but for `standing`."""
    linear = leg.linearised()
    matrices, body = linear.matrices(), linear.row("body")
    force = leg.torque_load() * leg.torque
    settled, give = np.linalg.solve(matrices.stiffness, np.column_stack([force, body])).T
    static = float(body @ settled)
    loads = (static / float(body @ give), standing_load(leg))
    rates, parts = _decays(matrices.mass, matrices.damping, matrices.stiffness, settled, body)
    swinging = np.imag(rates) > SWINGS * np.abs(rates)
    if static <= 0.0 or not swinging.any():
        return StepLift(static, static, math.inf, *loads)
    slow = np.flatnonzero(swinging)[np.argmin(np.abs(rates[swinging]))]

    def speed(time: float) -> float:
        return float(np.sum(parts * rates * np.exp(rates * time)).real)

    from scipy.optimize import brentq  # takes longer to load than all designs

    guess = math.pi / float(np.imag(rates[slow]))
    start, end = 0.5 * guess, 1.5 * guess
    if not speed(start) > 0.0 > speed(end):
        return StepLift(static, static, math.inf, *loads)
    when: Any = brentq(speed, start, end, xtol=1e-14 * guess)
    peak = static + float(np.sum(parts * np.exp(rates * when)).real)
    return StepLift(static, peak, when, *loads)


def _decays(
    mass: Array, damping: Array, stiffness: Array, settled: Array, body: Array
) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Rates (2n,) [1/s] and parts (2n,) [m] with body height = static + sum(parts exp(rates t)), from rest at 0."""
    n = len(mass)
    scale = math.sqrt(float(np.trace(stiffness) / np.trace(mass)))  # brings positions and rates to one size
    flow = np.block(
        [
            [np.zeros((n, n)), np.eye(n) * scale],
            [-np.linalg.solve(mass, stiffness) / scale, -np.linalg.solve(mass, damping)],
        ]
    )
    rates, vectors = (np.asarray(one, dtype=np.complex128) for one in np.linalg.eig(flow))
    amounts = np.linalg.solve(vectors, np.concatenate([-settled, np.zeros(n)]))
    parts = (body @ vectors[:n]) * amounts
    return rates, np.asarray(parts, dtype=np.complex128)
