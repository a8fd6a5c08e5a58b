"""scipy.integrate.solve_ivp (DOP853 with terminal events); right-hand sides compiled by numba."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from held import Held, held_chain
from march import flight_rates, free_matrix, linear_rates, march, one_by_one
from problems import P2_DURATION_MS, FloatArray, Problem, load

NAME = f"scipy {scipy.__version__} DOP853"
RTOL = 2e-7  # loosest, to half a decade, with every impact time of P1, n = 2, right
ATOL = 1e-6


@lru_cache(maxsize=16)
def _held(problem: Problem) -> Held:
    return held_chain(problem)


def p1(problem: Problem, duration: float, rtol: float = RTOL, atol: float = ATOL) -> FloatArray:
    """Impact times [ms]."""
    held = _held(problem)
    n, tip, ground = problem.n, problem.tip, problem.ground
    system, loads = free_matrix(problem)
    film = problem.film / problem.mass[tip]
    held_row = problem.held_force_row()[np.concatenate([held.free, n + held.free])]
    held_constant = problem.held_force_row()[tip] * ground

    def landing(t: float, y: FloatArray) -> float:
        return y[tip] - ground

    landing.terminal = True  # type: ignore[attr-defined]
    landing.direction = -1.0  # type: ignore[attr-defined]

    def fly(start: float, end: float, y: FloatArray, half: int) -> tuple[float, FloatArray, bool]:
        load_now, offset = loads[half], problem.offset

        def rates(t: float, y: FloatArray) -> FloatArray:
            out = np.empty_like(y)
            flight_rates(system, load_now, film, offset, tip, y, out)
            return out

        result = solve_ivp(rates, (start, end), y, method="DOP853", events=landing, rtol=rtol, atol=atol)
        return float(result.t[-1]), result.y[:, -1].copy(), result.status == 1

    def hold(
        start: float, end: float, z: FloatArray, half: int, adhesion: float
    ) -> tuple[float, FloatArray, bool]:
        load_now = held.load[half]

        def rates(t: float, z: FloatArray) -> FloatArray:
            out = np.empty_like(z)
            linear_rates(held.system, load_now, z, out)
            return out

        def release(t: float, z: FloatArray) -> float:
            return held_constant + held_row @ z - adhesion - problem.adhesion_rate * (t - start)

        release.terminal = True  # type: ignore[attr-defined]
        release.direction = 1.0  # type: ignore[attr-defined]
        result = solve_ivp(rates, (start, end), z, method="DOP853", events=release, rtol=rtol, atol=atol)
        return float(result.t[-1]), result.y[:, -1].copy(), result.status == 1

    return march(problem, held, duration, fly, hold)


def p2(
    pairs: FloatArray, duration: float = P2_DURATION_MS
) -> tuple[NDArray[np.int64], FloatArray, FloatArray]:
    """Counts, first and tenth impact time [ms] of each (restitution, film scale) pair."""
    return one_by_one(p1, load(2), pairs, duration)
