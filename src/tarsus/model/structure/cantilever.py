"""Bending of a uniform cantilever with a rigid body on its end (Euler-Bernoulli).

Lengths are in beam lengths L.  With ``s = x / L`` and wave number ``beta``, the deflection solves
``w'''' = beta^4 w``, is clamped at ``s = 0``, and at ``s = 1`` carries a rigid body of mass ratio
``mu = m / (rhoA L)`` whose centre lies ``delta`` beyond the end and whose radius of gyration is ``kappa``::

    w'''(1) = -beta^4 mu (w + delta w')
    w''(1)  =  beta^4 mu (kappa^2 w' + delta (w + delta w'))

Deflections are combinations of two clamped functions built from decaying exponentials, so nothing
overflows at high modes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from tarsus.base.errors import InputError
from tarsus.model.structure.base import Array


class RigidTip(NamedTuple):
    """Rigid body on the end of the beam, in SI."""

    mass: float
    """Mass [kg]."""
    inertia: float
    """Moment of inertia about its centre [kg m^2]."""
    offset: float
    """Distance of its centre beyond the beam's end [m]."""


class CantileverModes(NamedTuple):
    """First modes of the beam, scaled so that every modal mass is the mass of beam and tip."""

    omega: Array
    """Angular frequencies (k,) [rad/s]."""
    mass: float
    """Modal mass of every mode [kg]."""
    tip: Array
    """Deflection (k,) of the tip's centre, positive."""
    center: Array
    """Deflection (k,) of the middle of the beam."""
    slope: Array
    """Slope (k,) at the beam's end [1/m]: participation of a uniform bending moment along the beam."""
    upward: Array
    """Coordinates (k,) of a unit upward translation, projected onto the modes."""


def _end_conditions(beta: float, mu: float, delta: float, kappa: float) -> tuple[float, float, float, float]:
    """Residuals of the two end conditions for the two clamped functions: (shear A, shear B, moment A, B)."""
    q, c, s = math.exp(-beta), math.cos(beta), math.sin(beta)
    load, arm, turned = beta * mu, delta * beta, kappa * kappa * beta
    slope_a, slope_b = -q + s + c, 1 + q * (s - c)
    center_a, center_b = q - c + s + arm * slope_a, 1 - q * (c + s) + arm * slope_b
    turn_a, turn_b = turned * slope_a + delta * center_a, turned * slope_b + delta * center_b
    return (
        -q - s - c + load * center_a,
        1 + q * (c - s) + load * center_b,
        q + c - s - beta * load * turn_a,
        1 + q * (c + s) - beta * load * turn_b,
    )


def _characteristic(beta: float, mu: float, delta: float, kappa: float) -> float:
    shear_a, shear_b, moment_a, moment_b = _end_conditions(beta, mu, delta, kappa)
    return shear_a * moment_b - shear_b * moment_a


def _root(
    function: Callable[[float], float], low: float, high: float, f_low: float, f_high: float, tolerance: float = 1e-15
) -> float:
    """Root in a bracket, by false position (Illinois) with a bisection every fourth time."""
    for count in range(100):
        middle = high - f_high * (high - low) / (f_high - f_low) if count % 4 < 3 else 0.5 * (low + high)
        value = function(middle)
        if (value > 0) == (f_high > 0):
            f_low *= 0.5
        else:
            low, f_low = high, f_high
        step = abs(middle - high)
        high, f_high = middle, value
        if value == 0.0 or min(step, abs(high - low)) <= tolerance * abs(middle):
            break
    return high


def _wave_numbers(count: int, mu: float, delta: float, kappa: float) -> list[float]:
    """First ``count`` roots of the characteristic equation."""
    roots: list[float] = []
    step, low = 0.1, 0.01
    f_low = _characteristic(low, mu, delta, kappa)
    while len(roots) < count:
        high = low + step
        f_high = _characteristic(high, mu, delta, kappa)
        if (f_low > 0) != (f_high > 0):
            roots.append(_root(lambda b: _characteristic(b, mu, delta, kappa), low, high, f_low, f_high))
        low, f_low = high, f_high
    return roots


@lru_cache(maxsize=1)
def _gauss() -> tuple[Array, Array]:
    """Nodes and weights of 96-point Gauss-Legendre quadrature on [0, 1]."""
    nodes, weights = np.polynomial.legendre.leggauss(96)
    return 0.5 * (nodes + 1.0), 0.5 * weights


@lru_cache(maxsize=4096)
def _frequency_ratio(mu: float, delta: float, kappa: float) -> float:
    first, second = _wave_numbers(2, mu, delta, kappa)
    return (second / first) ** 2


@lru_cache(maxsize=4096)
def section_from_frequencies(length: float, tip: RigidTip, first: float, second: float) -> tuple[float, float]:
    """Bending stiffness and mass per length that give the first two natural frequencies.

    Parameters
    ----------
    length
        Length of the beam up to the tip [m].
    tip
        Rigid body on its end.
    first, second
        Frequencies [Hz].

    Returns
    -------
    tuple[float, float]
        ``EI`` [N m^2] and ``rhoA`` [kg/m].  Just above the lowest possible ratio two beams have the same two
        frequencies; the lighter one is returned.

    Raises
    ------
    InputError
        If no uniform beam with this tip has frequencies in this ratio.
    """
    delta, kappa = tip.offset / length, math.sqrt(tip.inertia / tip.mass) / length
    target = second / first

    def excess(log_mu: float) -> float:
        return _frequency_ratio(math.exp(log_mu), delta, kappa) - target

    high, step = math.log(1e4), 0.8
    highest = f_high = excess(high)
    if highest < 0.0:
        raise InputError(
            f"with this tip the second frequency is at most {highest + target:.4g} times the first, "
            f"got a ratio of {target:.4g}"
        )
    lowest = f_high
    while high > math.log(1e-5):
        low = high - step
        f_low = excess(low)
        lowest = min(lowest, f_low)
        if f_low <= 0.0:
            break
        high, f_high = low, f_low
    else:
        raise InputError(
            f"with this tip the second frequency is at least {lowest + target:.4g} times the first, "
            f"got a ratio of {target:.4g}"
        )
    mu = math.exp(_root(excess, low, high, f_low, f_high, 1e-14))
    mass_per_length = tip.mass / (mu * length)
    beta = _wave_numbers(1, mu, delta, kappa)[0]
    omega = 2.0 * math.pi * first
    return mass_per_length * omega**2 * (length / beta) ** 4, mass_per_length


@lru_cache(maxsize=4096)
def cantilever_modes(
    length: float, tip: RigidTip, stiffness: float, mass_per_length: float, count: int
) -> CantileverModes:
    """First modes of a uniform cantilever with a rigid tip.

    Parameters
    ----------
    length, tip
        As in `section_from_frequencies`.
    stiffness, mass_per_length
        ``EI`` [N m^2] and ``rhoA`` [kg/m].
    count
        Number of modes.
    """
    beam_mass = mass_per_length * length
    mu, delta = tip.mass / beam_mass, tip.offset / length
    kappa = math.sqrt(tip.inertia / tip.mass) / length
    s, weight = _gauss()
    omega, at_tip, at_center, slopes, upward = (np.empty(count) for _ in range(5))
    for k, beta in enumerate(_wave_numbers(count, mu, delta, kappa)):
        shear_a, shear_b, moment_a, moment_b = _end_conditions(beta, mu, delta, kappa)
        a, b = (
            (shear_b, -shear_a)
            if abs(shear_a) + abs(shear_b) > abs(moment_a) + abs(moment_b)
            else (moment_b, -moment_a)
        )
        q = math.exp(-beta)

        def deflection(at: Array, a: float = a, b: float = b, beta: float = beta, q: float = q) -> Array:
            x = beta * at
            grow, decay, c, sn = np.exp(x - beta), np.exp(-x), np.cos(x), np.sin(x)
            return a * (decay - c + sn) + b * (grow - q * (c + sn))

        c, sn = math.cos(beta), math.sin(beta)
        end_slope = beta * (a * (sn + c - q) + b * (1.0 + q * (sn - c)))
        shape = deflection(s)
        end, center = deflection(np.array([1.0, 0.5]))
        tip_center = end + delta * end_slope
        rotary = mu * kappa * kappa * end_slope**2
        modal = beam_mass * (float((weight * shape**2).sum()) + mu * tip_center**2 + rotary)
        scale = math.copysign(math.sqrt((beam_mass + tip.mass) / modal), tip_center)
        omega[k] = (beta / length) ** 2 * math.sqrt(stiffness / mass_per_length)
        at_tip[k], at_center[k], slopes[k] = scale * tip_center, scale * center, scale * end_slope / length
        total = beam_mass * (float((weight * shape).sum()) + mu * tip_center)
        upward[k] = scale * total / (beam_mass + tip.mass)
    for values in (omega, at_tip, at_center, slopes, upward):
        values.flags.writeable = False
    return CantileverModes(omega, beam_mass + tip.mass, at_tip, at_center, slopes, upward)
