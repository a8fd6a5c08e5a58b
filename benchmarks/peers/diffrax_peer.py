"""diffrax Tsit5 with continuous events, the whole march compiled by JAX (vmapped over pairs for P2).

One vector field for flight and held tip, switched by a flag, because the compiled loop needs one shape of
state. The event
value is kept positive at the start of a flight by a lift of 1e-10 um.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import optimistix
from numpy.typing import NDArray

from held import held_chain
from march import LIFT_UM
from problems import HALF_PERIOD_MS, P2_DURATION_MS, FloatArray, Problem, load

NAME = f"diffrax {diffrax.__version__} Tsit5"
RTOL = 1e-6  # loosest power of ten with every impact time of P1, n = 2, right
ATOL = 1e-6
P2_RTOL = 1e-8  # events are seen at step ends only: at 1e-7 (and 1e-9) member 3642 misses a short dip
SPACE = 512  # room for impact times


@lru_cache(maxsize=8)
def _compile(problem: Problem, duration: float, rtol: float, atol: float, vectorised: bool) -> Any:
    """Jitted (restitution, film) -> (impact times padded with NaN, count)."""
    jax.config.update("jax_enable_x64", True)
    n, tip = problem.n, problem.tip
    system = np.zeros((2 * n, 2 * n))
    system[:n, n:] = np.eye(n)
    system[n:, :n] = -problem.stiffness / problem.mass[:, None]
    system[n:, n:] = -problem.damping / problem.mass[:, None]
    matrix = jnp.array(system)
    drive = jnp.zeros(2 * n).at[n + problem.drive].set(problem.push / problem.mass[problem.drive])
    held_row = jnp.array(problem.held_force_row())
    chain = held_chain(problem)
    free = np.concatenate([chain.free, n + chain.free])
    decay = jnp.array(chain.rate)
    into, back = jnp.array(chain.to_amplitude), jnp.array(chain.from_amplitude)
    offsets, rests, levels = (jnp.array(part) for part in (chain.offset, chain.rest, chain.level))

    def rates(t: Any, y: Any, args: Any) -> Any:
        sign, flying, _, film = args
        out = (matrix * y).sum(axis=1) + sign * drive  # fuses; a BLAS call would not
        tip_rate = out[n + tip] - film / problem.mass[tip] * y[n + tip] / (y[tip] + problem.offset) ** 3
        return out.at[n + tip].set(jnp.where(flying, tip_rate, 0.0))

    def boundary(t: Any, y: Any, args: Any, **_: Any) -> Any:
        _, flying, contact, _ = args
        margin = problem.adhesion0 + problem.adhesion_rate * (t - contact) - (held_row * y).sum()
        return jnp.where(flying, y[tip] - problem.ground, margin)

    event = diffrax.Event(boundary, root_finder=optimistix.Newton(rtol=1e-9, atol=1e-9), direction=False)
    controller = diffrax.PIDController(rtol=rtol, atol=atol)

    def run(restitution: Any, film: Any) -> Any:
        def going(carry: Any) -> Any:
            return carry[0] < duration

        def advance(carry: Any) -> Any:
            t, half, y, flying, contact, times, count = carry
            end = jnp.minimum((half + 1) * HALF_PERIOD_MS, duration)
            odd = half % 2
            sign = 1.0 - 2.0 * odd
            # a held tip is integrated only while its amplitudes could release it, see held.py
            margin = problem.adhesion0 + problem.adhesion_rate * (t - contact) - levels[odd]
            bound = jnp.abs((into * y[free]).sum(axis=1) - offsets[odd]).sum()
            quiet = jnp.where(margin > 0.0, t + jnp.log(bound / margin) / chain.slowest, end)
            stop = jnp.where(flying, end, jnp.clip(quiet, t, end))
            solution = diffrax.diffeqsolve(
                diffrax.ODETerm(rates),
                diffrax.Tsit5(),
                t,
                stop,
                None,
                y,
                (sign, flying, contact, film),
                stepsize_controller=controller,
                event=event,
                max_steps=16**4,
                throw=False,
                adjoint=diffrax.ForwardMode(),
            )
            t, y = solution.ts[-1], solution.ys[-1]
            met = solution.event_mask
            amplitude = (into * y[free]).sum(axis=1) - offsets[odd]
            later = amplitude * jnp.exp(decay * (end - stop))
            ahead = y.at[free].set((back * later).sum(axis=1).real + rests[odd])
            y = jnp.where(flying | met, y, ahead)
            landed = met & flying
            times = jnp.where(landed, times.at[count].set(t, mode="drop"), times)
            count = count + landed
            before = y[n + tip]
            rest = y.at[tip].set(problem.ground).at[n + tip].set(0.0)
            sticks = (held_row * rest).sum() <= problem.adhesion0
            bounced = rest.at[n + tip].set(-restitution * before).at[tip].add(LIFT_UM)
            y = jnp.where(landed, jnp.where(sticks, rest, bounced), y)
            y = jnp.where(met & ~flying, y.at[tip].set(problem.ground + LIFT_UM), y)
            contact = jnp.where(landed & sticks, t, contact)
            flying = jnp.where(met, jnp.where(flying, ~sticks, True), flying)
            half = jnp.where(met, half, half + 1)
            t = jnp.where(met, t, end)
            return t, half, y, flying, contact, times, count

        start = (
            jnp.array(0.0),
            jnp.array(0),
            jnp.zeros(2 * n),
            jnp.array(True),
            jnp.array(0.0),
            jnp.full(SPACE, jnp.nan),
            jnp.array(0),
        )
        final = jax.lax.while_loop(going, advance, start)
        return final[5], final[6]

    return jax.jit(jax.vmap(run) if vectorised else run)


def p1(problem: Problem, duration: float, rtol: float = RTOL, atol: float = ATOL) -> FloatArray:
    """Impact times [ms]; the first call for a problem and duration compiles."""
    solve = _compile(problem, float(duration), rtol, atol, False)
    times, count = solve(problem.restitution, problem.film)
    return np.asarray(times)[: int(count)]


def p2(
    pairs: FloatArray, duration: float = P2_DURATION_MS, rtol: float = P2_RTOL, batch: int = 64
) -> tuple[NDArray[np.int64], FloatArray, FloatArray]:
    """Counts, first and tenth impact time [ms] of each (restitution, film scale) pair."""
    problem = load(2)
    solve = _compile(problem, float(duration), rtol, rtol, True)
    counts, marks = [], []
    for start in range(0, len(pairs), batch):
        part = pairs[start : start + batch]
        fill = np.repeat(part[-1:], batch - len(part), axis=0)
        full = np.concatenate([part, fill])
        times, count = solve(full[:, 0], problem.film * full[:, 1])
        counts.append(np.asarray(count)[: len(part)])
        marks.append(np.asarray(times)[: len(part)][:, [0, 9]])
    both = np.concatenate(marks)
    return np.concatenate(counts).astype(np.int64), both[:, 0], both[:, 1]
