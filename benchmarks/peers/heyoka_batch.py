"""heyoka in batch mode (8 trajectories in one SIMD integrator) on P2.

One integrator for flight and held tip, switched per lane by parameters in the event callbacks, because a
stop would stop all lanes. A lane whose held force can no longer reach the adhesion is frozen (its time
derivatives are multiplied by 0) and put where the exact held flow ends at the next switch of the voltage.
"""

from __future__ import annotations

import cmath
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import heyoka as hy
import numpy as np
from numpy.typing import NDArray

from held import held_chain
from problems import P2_DURATION_MS, FloatArray, Problem, first_and_tenth, half_periods, load

NAME = f"heyoka {hy.__version__} batch"
TOLERANCE = 1e-6
BATCH = 8
SPEED = 40.0  # rad/ms, about the second natural frequency; see heyoka_peer


@dataclass
class _Lanes:
    """What the event callback shares with the loop."""

    times: list[list[float]] = field(default_factory=list)
    restitution: list[float] = field(default_factory=list)
    frozen: dict[int, tuple[complex, float]] = field(default_factory=dict)
    offset: complex = 0j
    level: float = 0.0


@lru_cache(maxsize=4)
def compile_p2(
    problem: Problem, tolerance: float = TOLERANCE, batch: int = BATCH
) -> Callable[[FloatArray, float], list[list[float]]]:
    """The batch integrator compiled; returns (pairs (batch, 2), duration [ms]) -> impact times per lane."""
    if problem.n != 2:
        raise ValueError("P2 is defined for n = 2")
    n, tip, other = 2, problem.tip, problem.drive
    x = [hy.make_vars(f"x{i}") for i in range(n)]
    w = [hy.make_vars(f"w{i}") for i in range(n)]
    force, film, flying, contact, moving = (hy.par[i] for i in range(5))
    accelerations = []
    for i in range(n):
        terms = [-problem.stiffness[i, j] / (problem.mass[i] * SPEED) * x[j] for j in range(n)]
        terms += [-problem.damping[i, j] / problem.mass[i] * w[j] for j in range(n)]
        if i == tip:
            terms.append(-film / problem.mass[i] * w[i] * (x[i] + problem.offset) ** -3)
            accelerations.append(flying * hy.sum(terms))
        else:
            terms.append(force / (problem.mass[i] * SPEED))
            accelerations.append(moving * hy.sum(terms))
    held_row = problem.held_force_row()
    held_row[n:] *= SPEED
    held_force = hy.sum([held_row[k] * (x + w)[k] for k in range(2 * n) if held_row[k] != 0.0])
    strength = problem.adhesion0 + problem.adhesion_rate * (hy.time - contact)
    boundary = flying * (x[tip] - problem.ground) + (1.0 - flying) * (strength - held_force)

    chain = held_chain(problem)
    rate = complex(chain.rate[0])
    into_x = complex(chain.to_amplitude[0, 0])
    into_w = complex(chain.to_amplitude[0, 1]) * SPEED
    lanes = _Lanes()

    def on_event(ta: Any, direction: int, lane: int) -> bool:
        if pars[2, lane] == 0.0:
            pars[2, lane] = 1.0  # release
            return True
        t = float(clock[lane])
        lanes.times[lane].append(t)
        y = state[:, lane]
        before = y[n + tip]
        y[tip] = problem.ground
        y[n + tip] = 0.0
        if held_row.dot(y) > problem.adhesion0:
            y[n + tip] = -lanes.restitution[lane] * before
            return True
        pars[2, lane] = 0.0
        pars[3, lane] = t
        amplitude = into_x * y[other] + into_w * y[n + other] - lanes.offset
        if abs(amplitude) <= problem.adhesion0 - lanes.level:
            pars[4, lane] = 0.0
            lanes.frozen[lane] = (amplitude, t)
        return True

    ta = hy.taylor_adaptive_batch(
        [(x[i], moving * SPEED * w[i]) for i in range(n)] + [(w[i], accelerations[i]) for i in range(n)],
        np.zeros((2 * n, batch)),
        pars=np.zeros((5, batch)),
        tol=tolerance,
        t_events=[hy.t_event_batch(boundary, callback=on_event, direction=hy.event_direction.negative)],
        fast_math=True,
    )
    state, pars, clock = ta.state, ta.pars, ta.time  # views

    def solve(pairs: FloatArray, duration: float) -> list[list[float]]:
        lanes.times = [[] for _ in range(batch)]
        lanes.restitution = pairs[:, 0].tolist()
        ta.set_time(0.0)
        ta.reset_cooldowns()
        state[:] = 0.0
        pars[:] = np.array([0.0, 0.0, 1.0, 0.0, 1.0])[:, None]
        pars[1] = problem.film * pairs[:, 1]
        for number, end in half_periods(duration):
            half = number & 1
            pars[0] = problem.drive_force(half)
            lanes.offset = complex(chain.offset[half][0])
            lanes.level = chain.level[half]
            lanes.frozen = {}
            ta.propagate_until(end)
            for lane, (amplitude, t) in lanes.frozen.items():
                later = amplitude * cmath.exp(rate * (end - t))
                z = (chain.from_amplitude[:, 0] * later).real + chain.rest[half]
                state[other, lane] = z[0]
                state[n + other, lane] = z[1] / SPEED
                pars[4, lane] = 1.0
        return lanes.times

    return solve


def p2(
    pairs: FloatArray, tolerance: float = TOLERANCE, duration: float = P2_DURATION_MS
) -> tuple[NDArray[np.int64], FloatArray, FloatArray]:
    """Counts, first and tenth impact time [ms] of each (restitution, film scale) pair."""
    solve = compile_p2(load(2), tolerance)
    times: list[list[float]] = []
    for start in range(0, len(pairs), BATCH):
        part = pairs[start : start + BATCH]
        fill = np.repeat(part[-1:], BATCH - len(part), axis=0)
        times += solve(np.concatenate([part, fill]), duration)[: len(part)]
    marks = np.array([first_and_tenth(np.array(each)) for each in times])
    return np.array([len(each) for each in times]), marks[:, 0], marks[:, 1]
