"""Stop-and-restart march over flights, impacts and held spells, for solvers driven from Python.

A peer supplies two functions; contact decisions, voltage switches and the exact jump of a held tip that can
no longer be released before the next switch are the same for all.
"""

from __future__ import annotations

from collections.abc import Callable
from math import log

import numba
import numpy as np
from numpy.typing import NDArray

from held import Held
from problems import FloatArray, Problem, first_and_tenth, half_periods, sticks, strength, with_pair

# (start, end [ms], state, half period parity) -> (time, state, landed)
Fly = Callable[[float, float, FloatArray, int], tuple[float, FloatArray, bool]]
# (start, end [ms], held state, half period parity, adhesion [uN] at start) -> (time, held state, released)
Hold = Callable[[float, float, FloatArray, int, float], tuple[float, FloatArray, bool]]

LIFT_UM = 1e-10  # a new flight starts this far above the ground, so that the event function starts positive


def march(problem: Problem, held: Held, duration: float, fly: Fly, hold: Hold) -> FloatArray:
    """Impact times [ms] of ``problem`` from rest."""
    n, tip = problem.n, problem.tip
    free = np.concatenate([held.free, n + held.free])
    row = problem.held_force_row()
    y = np.zeros(2 * n)
    z = np.zeros(2 * n - 2)
    times: list[float] = []
    stuck, t, contact = False, 0.0, 0.0
    for number, end in half_periods(duration):
        half = number & 1
        while t < end:
            if not stuck:
                t, y, landed = fly(t, end, y, half)
                if not landed:
                    break
                times.append(t)
                before = y[n + tip]
                y[tip] = problem.ground
                y[n + tip] = 0.0
                if sticks(problem, float(row @ y)):
                    stuck, contact = True, t
                    z = y[free]
                else:
                    y[tip] += LIFT_UM
                    y[n + tip] = -problem.restitution * before
                continue
            amplitude = held.to_amplitude @ z - held.offset[half]
            margin = strength(problem, t - contact) - held.level[half]
            bound = float(np.abs(amplitude).sum())
            stop = t
            if bound > margin:
                stop = min(end, t + log(bound / margin) / held.slowest) if margin > 0.0 else end
                t, z, released = hold(t, stop, z, half, strength(problem, t - contact))
                if released:
                    stuck = False
                    y = np.zeros(2 * n)
                    y[free] = z
                    y[tip] = problem.ground + LIFT_UM
                    continue
                amplitude = held.to_amplitude @ z - held.offset[half]
            if stop < end:
                later = amplitude * np.exp(held.rate * (end - stop))
                z = (held.from_amplitude @ later).real + held.rest[half]
            t = end
        t = end
    return np.array(times)


def one_by_one(
    p1: Callable[[Problem, float], FloatArray], problem: Problem, pairs: FloatArray, duration: float
) -> tuple[NDArray[np.int64], FloatArray, FloatArray]:
    """P2 as a loop over P1: counts, first and tenth impact time [ms]."""
    runs = [p1(with_pair(problem, restitution, scale), duration) for restitution, scale in pairs]
    marks = np.array([first_and_tenth(times) for times in runs])
    return np.array([len(times) for times in runs]), marks[:, 0], marks[:, 1]


def free_matrix(problem: Problem) -> tuple[FloatArray, tuple[FloatArray, FloatArray]]:
    """(A, (b0, b1)) of y' = A y + b for the flight without film, y = (x, v), b per half period parity."""
    n = problem.n
    system = np.zeros((2 * n, 2 * n))
    system[:n, n:] = np.eye(n)
    system[n:, :n] = -problem.stiffness / problem.mass[:, None]
    system[n:, n:] = -problem.damping / problem.mass[:, None]
    loads = []
    for half in (0, 1):
        load = np.zeros(2 * n)
        load[n + problem.drive] = problem.drive_force(half) / problem.mass[problem.drive]
        loads.append(load)
    return system, (loads[0], loads[1])


@numba.njit(cache=False)
def linear_rates(system: FloatArray, load: FloatArray, y: FloatArray, out: FloatArray) -> None:
    """out = system @ y + load, compiled (for small systems far cheaper than numpy calls)."""
    for i in range(y.shape[0]):
        total = load[i]
        for j in range(y.shape[0]):
            total += system[i, j] * y[j]
        out[i] = total


@numba.njit(cache=False)
def flight_rates(
    system: FloatArray, load: FloatArray, film: float, offset: float, tip: int, y: FloatArray, out: FloatArray
) -> None:
    """Flight with film; ``film`` is the film coefficient over the tip's mass."""
    linear_rates(system, load, y, out)
    n = y.shape[0] // 2
    out[n + tip] -= film * y[n + tip] / (y[tip] + offset) ** 3
