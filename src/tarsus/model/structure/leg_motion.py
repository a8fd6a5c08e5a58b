"""Motion of the nonlinear leg: equilibria, the answer to a step of voltage, and its energies."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve, minimize_scalar

from tarsus.base.errors import InputError
from tarsus.model.structure.base import Array
from tarsus.model.structure.leg import Leg
from tarsus.model.structure.leg_chain import Chain

GRAVITY = 9.81
"""Acceleration of gravity [m/s^2]."""

_TOLERANCE = 1e-11
"""Of a step, relative to the size of the motion: the balance of energy of a step response closes to 1e-9 by it."""
_STIFF = 1e4
"""Decays within a run above which an explicit method would be held to very short steps: an implicit one then."""

_LOWEST = 0.01
"""A run ends when the body is as near to the ground as this share of its height at rest."""


@dataclass(frozen=True)
class LegMotion:
    """Motion of a leg over time; all arrays (n,) but ``turns`` and ``rates`` (n, 2) of hip and knee joint.

    time [s]; lift of the body above its height at the start [m]; speed of the body [m/s]; turns [rad], rates [rad/s];
    kinetic, elastic, gravity (from the posture at rest), dissipated and work (of the torque, from the
    start) [J].  ``complete`` is False when the body came down to the ground before the end.
    """

    time: Array
    lift: Array
    speed: Array
    turns: Array
    rates: Array
    kinetic: Array
    elastic: Array
    gravity: Array
    dissipated: Array
    work: Array
    complete: bool

    @property
    def closure(self) -> float:
        """Largest error of the energy balance relative to the largest energy in it [1]."""
        total = self.kinetic + self.elastic + self.gravity + self.dissipated - self.work
        terms = (self.kinetic, self.elastic, self.gravity, self.dissipated, self.work)
        largest = max(float(np.abs(term).max()) for term in terms)
        return float(np.abs(total - total[0]).max()) / largest


def equilibrium(leg: Leg, volts: float = 0.0, gravity: float = GRAVITY) -> Array:
    """Turns (2,) of hip and knee joint at which the leg stays under a voltage and its load [rad].

    Raises
    ------
    InputError
        If the leg has no equilibrium: it folds under its load, or the torque winds it up.
    """
    chain = leg.chain()
    torque = leg.torque_gain * volts

    def left(scaled: Array) -> Array:
        return chain.at_rest(scaled, torque, gravity) / chain.stiffness

    turns, *_ = fsolve(left, np.array([torque, 0.0]) / chain.stiffness, full_output=True, xtol=1e-15)
    if not np.isfinite(turns).all() or float(np.abs(left(turns)).max()) > 1e-12:
        raise InputError(f"the leg folds under {leg.body_mass:.3g} kg: no equilibrium at {volts:g} V")
    if float(np.abs(turns).max()) > np.pi:
        raise InputError(f"{volts:g} V wind the leg up: its hip would turn by {turns[0]:.3g} rad")
    return turns


def standing_load(leg: Leg) -> float:
    """Greatest load [N] under which the leg stands at 0 V; a heavier body snaps through to the ground.

    Along the equilibria of growing hip turn the load first rises and then falls, as the leaning shin lowers
    the body ever faster: the greatest value counts.  The links' own weight is neglected.
    """
    chain = leg.chain()

    def less(turn: float) -> float:
        knee, load = 0.0, 0.0
        for _ in range(6):  # the knee is stiff: its turn converges by a digit or two a round
            theta = chain.posture(np.array([turn, knee]))
            if not np.isfinite(theta).all():
                return 0.0
            by_hip, by_knee = chain.heights(theta)[0]
            load = -chain.stiffness[0] * turn / by_hip if by_hip > 0.0 else 0.0
            knee = -load * by_knee / chain.stiffness[1]
        return -float(load)

    found: Any = minimize_scalar(less, bounds=(-1.0, 0.0), method="bounded", options={"xatol": 1e-7})
    return -float(found.fun)


def step_response(leg: Leg, times: ArrayLike, volts: float | None = None, gravity: float = GRAVITY) -> LegMotion:
    """Answer of the nonlinear leg to a step from 0 V at time zero, from rest under its load (Fig. 4.4).

    Parameters
    ----------
    leg
        The leg.
    times
        Times (n,), increasing from 0 [s].
    volts
        Height of the step; the leg's rated voltage when absent.
    gravity
        Acceleration of gravity [m/s^2]; 0 leaves the load's weight out, not its inertia.

    Raises
    ------
    InputError
        If the leg does not carry its load at 0 V, or the times do not increase from 0.
    """
    height = leg.rated_volts if volts is None else volts
    start = equilibrium(leg, 0.0, gravity)
    return free_motion(leg, times, start, np.zeros(2), leg.torque_gain * height, gravity)


def free_motion(
    leg: Leg, times: ArrayLike, turns: ArrayLike, rates: ArrayLike, torque: float, gravity: float
) -> LegMotion:
    """Motion of the nonlinear leg from given turns and rates (2,) under a constant torque; as `step_response`."""
    when = np.asarray(times, dtype=float)
    if when.ndim != 1 or len(when) < 2 or when[0] != 0.0 or not np.all(np.diff(when) > 0.0):
        raise InputError("times must be a list of at least two that increases from 0")
    chain = leg.chain()
    lowest = _LOWEST * chain.height(chain.rest)

    def grounded(_: float, state: Array) -> float:
        height = chain.height(chain.posture(state[:2]))
        return height - lowest if height == height else -lowest

    grounded.terminal = True  # pyright: ignore[reportFunctionMemberAccess]
    start = np.concatenate([np.asarray(turns, dtype=float), np.asarray(rates, dtype=float), [0.0]])
    scale = _scales(chain, start, torque, gravity)
    slope = chain.equations(torque, gravity)
    options: dict[str, Any] = {"method": "DOP853"}
    if _fastest_decay(leg) * when[-1] > _STIFF:
        options = {"method": "Radau", "jac": lambda _, state: _jacobian(slope, state, scale)}
    solution = solve_ivp(
        slope, (0.0, when[-1]), start, t_eval=when, events=grounded, rtol=_TOLERANCE, atol=_TOLERANCE * scale, **options
    )
    if not solution.success:
        raise InputError(f"the leg's motion cannot be followed: {solution.message}")
    return _motion(chain, solution.t, solution.y, torque, gravity, complete=solution.status == 0)


def _scales(chain: Chain, start: Array, torque: float, gravity: float) -> Array:
    """Typical sizes (5,) of turns, rates and dissipated energy, for absolute tolerances."""
    push = np.abs(chain.at_rest(start[:2], torque, gravity)) / chain.stiffness
    turn = float(max(push.max(), np.abs(start[:2]).max(), 1e-12))
    pace = float(np.sqrt(chain.stiffness[0] / chain.mass(chain.rest)[0, 0]))
    rate = max(turn * pace, float(np.abs(start[2:4]).max()))
    energy = 0.5 * float(chain.stiffness[0]) * turn**2
    return np.array([turn, turn, rate, rate, energy])


def _fastest_decay(leg: Leg) -> float:
    """Fastest decay that the dampers give the linearised leg [1/s]."""
    matrices = leg.linearised().matrices()
    return float(np.linalg.eigvals(np.linalg.solve(matrices.mass, matrices.damping)).real.max())


def _jacobian(slope: Callable[[float, Array], list[float]], state: Array, scale: Array) -> Array:
    """Derivatives (5, 5) of the equations by central differences; the dissipated energy acts on nothing."""
    derivatives = np.zeros((5, 5))
    for i in range(4):
        step = np.zeros(5)
        step[i] = 1e-5 * scale[i]
        ahead, behind = slope(0.0, state + step), slope(0.0, state - step)
        derivatives[:, i] = np.subtract(ahead, behind) / (2.0 * step[i])
    return derivatives


def _motion(chain: Chain, time: Array, y: Array, torque: float, gravity: float, *, complete: bool) -> LegMotion:
    turns, rates = y[:2].T, y[2:4].T
    postures = [chain.posture(q) for q in turns]
    height = np.array([chain.height(theta) for theta in postures])
    speed = [chain.heights(theta)[0] @ rate for theta, rate in zip(postures, rates, strict=True)]
    return LegMotion(
        time=time,
        lift=height - height[0],
        speed=np.array(speed),
        turns=turns,
        rates=rates,
        kinetic=np.array([chain.kinetic(q, rate) for q, rate in zip(turns, rates, strict=True)]),
        elastic=np.array([chain.elastic(q) for q in turns]),
        gravity=gravity * np.array([chain.raised(q) for q in turns]),
        dissipated=y[4],
        work=torque * (turns[:, 0] - turns[0, 0]),
        complete=complete,
    )
