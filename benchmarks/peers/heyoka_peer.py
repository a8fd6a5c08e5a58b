"""heyoka (adaptive Taylor, LLVM JIT, terminal events) on P1.

Set up to be as fast as we could make it at the accuracy demanded:

- two integrators compiled once, flight and held tip, stop and restart at every event (faster here than one
  integrator with callbacks and a switch in the equations);
- the held tip in complex modal amplitudes; once their sum cannot reach the adhesion, an exact jump to the
  next switch of the voltage instead of integration;
- flight in the masses' own coordinates for n = 2, else in the tip's coordinate and the modes of the chain
  (n operations for the linear part instead of n^2: 7 times faster at n = 32);
- velocities divided by the chain's highest natural frequency, so that the relative tolerance, which heyoka
  takes in the maximum norm, is one on displacements (30 % fewer steps);
- ``fast_math``, and the loosest tolerance at which every impact time is within 1e-6 relative.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from math import hypot, log

import heyoka as hy
import numpy as np
import scipy.linalg

from held import held_chain
from problems import FloatArray, Problem, half_periods

NAME = f"heyoka {hy.__version__}"
TOLERANCE = 1e-6  # loosest power of ten with every impact time right, for n = 2, 6 and 32


def _coordinates(problem: Problem) -> FloatArray:
    """Columns of x = shapes @ r, with r[tip] = x[tip] exactly, so that landing is an assignment."""
    n, tip = problem.n, problem.tip
    if n == 2:
        return np.eye(n)
    _, modes = scipy.linalg.eigh(problem.stiffness, np.diag(problem.mass))
    modes = modes / modes[tip]  # every mode has tip displacement 1
    others = np.eye(n)
    others[tip] = -1.0  # r of the tip's slot is x_tip; that mode's own amplitude is x_tip minus the others
    others[tip, tip] = 1.0
    return modes @ others


def _clean(matrix: FloatArray) -> FloatArray:
    """Rounding residues set to exact zeros, so that they compile to nothing."""
    return np.where(np.abs(matrix) < 1e-12 * np.abs(matrix).max(), 0.0, matrix)


def _top_frequency(problem: Problem) -> float:
    """Highest natural frequency [rad/ms]."""
    return float(np.sqrt(scipy.linalg.eigh(problem.stiffness, np.diag(problem.mass), eigvals_only=True)[-1]))


def _flight(problem: Problem, shapes: FloatArray, speed: float, tolerance: float) -> hy.taylor_adaptive_dbl:
    """Free chain, state (r, r'/speed), parameter: drive force [uN]; stops when the tip meets the ground."""
    n, tip = problem.n, problem.tip
    mass = shapes.T @ np.diag(problem.mass) @ shapes
    stiffness = _clean(np.linalg.solve(mass, shapes.T @ problem.stiffness @ shapes)) / speed
    damping = _clean(np.linalg.solve(mass, shapes.T @ problem.damping @ shapes))
    from_tip = _clean(np.linalg.solve(mass, shapes[tip]))
    from_drive = _clean(np.linalg.solve(mass, shapes[problem.drive])) / speed
    r = [hy.make_vars(f"r{i}") for i in range(n)]
    w = [hy.make_vars(f"w{i}") for i in range(n)]
    film = -problem.film * w[tip] * (r[tip] + problem.offset) ** -3
    equations = [(r[i], speed * w[i]) for i in range(n)]
    for i in range(n):
        terms = [-stiffness[i, j] * r[j] for j in range(n) if stiffness[i, j] != 0.0]
        terms += [-damping[i, j] * w[j] for j in range(n) if damping[i, j] != 0.0]
        terms += [from_drive[i] * hy.par[0]] if from_drive[i] != 0.0 else []
        terms += [from_tip[i] * film] if from_tip[i] != 0.0 else []
        equations.append((w[i], hy.sum(terms)))
    landing = hy.t_event(r[tip] - problem.ground, direction=hy.event_direction.negative)
    return hy.taylor_adaptive(equations, np.zeros(2 * n), pars=[0.0], tol=tolerance, t_events=[landing], fast_math=True)


def _held(problem: Problem, rate: np.ndarray, tolerance: float) -> hy.taylor_adaptive_dbl:
    """Held chain, state (Re c, Im c), time since contact, parameter: adhesion0 less the static held force."""
    m = len(rate)
    a = [hy.make_vars(f"a{k}") for k in range(m)]
    b = [hy.make_vars(f"b{k}") for k in range(m)]
    equations = [(a[k], rate[k].real * a[k] - rate[k].imag * b[k]) for k in range(m)]
    equations += [(b[k], rate[k].real * b[k] + rate[k].imag * a[k]) for k in range(m)]
    margin = hy.par[0] + problem.adhesion_rate * hy.time - hy.sum(a)
    release = hy.t_event(margin, direction=hy.event_direction.negative)
    return hy.taylor_adaptive(equations, np.zeros(2 * m), pars=[0.0], tol=tolerance, t_events=[release], fast_math=True)


@lru_cache(maxsize=16)
def compile_p1(problem: Problem, tolerance: float = TOLERANCE) -> Callable[[float], FloatArray]:
    """Both integrators compiled; returns duration [ms] -> impact times [ms]."""
    n, tip = problem.n, problem.tip
    tip_speed = n + tip
    shapes = _coordinates(problem)
    direct = n == 2
    speed = _top_frequency(problem)
    flight = _flight(problem, shapes, speed, tolerance)
    chain = held_chain(problem)
    m = n - 1
    rate = chain.rate
    held = _held(problem, rate, tolerance)
    y, c = flight.state, held.state  # views
    # maps between flight state and (x, v), and between flight state and held amplitudes
    to_physical = scipy.linalg.block_diag(shapes, shapes * speed)
    from_physical = np.linalg.inv(to_physical)
    held_force = problem.held_force_row() @ to_physical
    free = np.concatenate([chain.free, n + chain.free])
    into = chain.to_amplitude @ to_physical[free]
    into = np.vstack([into.real, into.imag])
    back = from_physical[:, free] @ chain.from_amplitude
    back = np.hstack([back.real, -back.imag])
    shift_in = [np.concatenate([offset.real, offset.imag]) for offset in chain.offset]
    at_ground = from_physical[:, tip] * problem.ground
    shift_out = [from_physical[:, free] @ rest + at_ground for rest in chain.rest]
    kick = from_physical[:, tip_speed] / from_physical[tip_speed, tip_speed]  # unit change of the tip's speed
    forces = [problem.drive_force(0), problem.drive_force(1)]
    ground, restitution = problem.ground, problem.restitution
    adhesion0, adhesion_rate = problem.adhesion0, problem.adhesion_rate
    slowest = chain.slowest
    at_end = hy.taylor_outcome.time_limit

    def solve(duration: float) -> FloatArray:
        times: list[float] = []
        y[:] = 0.0
        flight.time = 0.0
        flight.reset_cooldowns()
        stuck, t, contact = False, 0.0, 0.0
        for number, end in half_periods(duration):
            half = number & 1
            flight.pars[0] = forces[half]
            level = chain.level[half]
            while True:
                if not stuck:
                    if flight.propagate_until(end)[0] == at_end:
                        t = end
                        break
                    t = flight.time
                    times.append(t)
                    before = y[tip_speed]
                    if not direct:
                        y[:] -= kick * before
                    y[tip] = ground
                    y[tip_speed] = 0.0
                    if held_force.dot(y) > adhesion0:
                        after = -restitution * before
                        if not direct:
                            y[:] += kick * after
                        y[tip_speed] = after
                        continue
                    stuck, contact = True, t
                np.dot(into, y, out=c)
                c[:] -= shift_in[half]
                margin = adhesion0 + adhesion_rate * (t - contact) - level
                bound = hypot(c[0], c[1]) if m == 1 else float(np.hypot(c[:m], c[m:]).sum())
                if bound > margin:
                    stop = min(end, t + log(bound / margin) / slowest) if margin > 0.0 else end
                    held.time = t - contact
                    held.pars[0] = adhesion0 - level
                    held.reset_cooldowns()
                    if held.propagate_until(stop - contact)[0] != at_end:
                        stuck = False
                        t = held.time + contact
                        np.dot(back, c, out=y)
                        y[:] += shift_out[half]
                        y[tip] = ground
                        y[tip_speed] = 0.0
                        flight.time = t
                        flight.reset_cooldowns()
                        continue
                    t = stop
                if t < end:
                    later = (c[:m] + 1j * c[m:]) * np.exp(rate * (end - t))
                    c[:m] = later.real
                    c[m:] = later.imag
                t = end
                flight.time = t
                np.dot(back, c, out=y)
                y[:] += shift_out[half]
                break
        return np.array(times)

    return solve


def p1(problem: Problem, duration: float, tolerance: float = TOLERANCE) -> FloatArray:
    """Impact times [ms]; the first call for a problem compiles."""
    return compile_p1(problem, tolerance)(duration)
