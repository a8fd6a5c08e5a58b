"""scikit-sundae: CVODE with root finding, driven from Python; right-hand sides compiled by numba."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import sksundae
from numpy.typing import NDArray
from sksundae.cvode import CVODE

from held import Held, held_chain
from march import flight_rates, free_matrix, linear_rates, march, one_by_one
from problems import P2_DURATION_MS, FloatArray, Problem, load

NAME = f"scikit-sundae {sksundae.__version__} CVODE"
RTOL = 3e-8  # loosest, to half a decade, with every impact time of P1, n = 2, right
ATOL = 1e-7
METHOD = "Adams"
EVENT_FOUND = 2  # CV_ROOT_RETURN


@lru_cache(maxsize=16)
def _held(problem: Problem) -> Held:
    return held_chain(problem)


def _run(solver: Any, start: float, end: float, y: FloatArray) -> tuple[float, FloatArray, bool]:
    solver.init_step(start, y)
    result = solver.step(end, tstop=end)  # no internal step is stored, unlike with solve()
    if not result.success:
        raise RuntimeError(result.message)
    return float(result.t), np.array(result.y), result.status == EVENT_FOUND


def p1(
    problem: Problem, duration: float, rtol: float = RTOL, atol: float = ATOL, method: str = METHOD
) -> FloatArray:
    """Impact times [ms]."""
    held = _held(problem)
    n, tip, ground, offset = problem.n, problem.tip, problem.ground, problem.offset
    system, loads = free_matrix(problem)
    film = problem.film / problem.mass[tip]
    held_row = problem.held_force_row()[np.concatenate([held.free, n + held.free])]
    held_constant = problem.held_force_row()[tip] * ground
    now: dict[str, Any] = {}

    def flight(t: float, y: FloatArray, out: FloatArray) -> None:
        flight_rates(system, now["load"], film, offset, tip, y, out)

    def landing(t: float, y: FloatArray, out: FloatArray) -> None:
        out[0] = y[tip] - ground

    landing.direction = [-1]  # type: ignore[attr-defined]

    def held_rates(t: float, z: FloatArray, out: FloatArray) -> None:
        linear_rates(held.system, now["load"], z, out)

    def release(t: float, z: FloatArray, out: FloatArray) -> None:
        out[0] = held_constant + held_row @ z - now["adhesion"] - problem.adhesion_rate * (t - now["start"])

    release.direction = [1]  # type: ignore[attr-defined]
    options = {"method": method, "rtol": rtol, "atol": atol, "num_events": 1, "max_num_steps": 1_000_000}
    flying = CVODE(flight, eventsfn=landing, **options)
    holding = CVODE(held_rates, eventsfn=release, **options)

    def fly(start: float, end: float, y: FloatArray, half: int) -> tuple[float, FloatArray, bool]:
        now["load"] = loads[half]
        return _run(flying, start, end, y)

    def hold(
        start: float, end: float, z: FloatArray, half: int, adhesion: float
    ) -> tuple[float, FloatArray, bool]:
        now.update(load=held.load[half], start=start, adhesion=adhesion)
        return _run(holding, start, end, z)

    return march(problem, held, duration, fly, hold)


def p2(
    pairs: FloatArray, duration: float = P2_DURATION_MS
) -> tuple[NDArray[np.int64], FloatArray, FloatArray]:
    """Counts, first and tenth impact time [ms] of each (restitution, film scale) pair."""
    return one_by_one(p1, load(2), pairs, duration)
