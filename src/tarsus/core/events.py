"""Finding the first event inside a step: touchdown of a free foot, break-off of a held one.

Each foot has an event function that is positive while nothing happens: the gap of a free foot, the margin
``strength - pull - smooth force`` of a held one. A foot that has just left the ground starts at zero: after a
bounce with a positive slope (``order`` 1), after a release with zero slope too (``order`` 2).
"""

from __future__ import annotations

import math

from tarsus.core import hooks
from tarsus.core.flow import horner, horner_slope, input_at
from tarsus.core.hooks import HAS_FORCE
from tarsus.core.jit import fused, inner
from tarsus.core.nodes import N

NOTHING, CROSSING, UNSURE = 0, 1, 2


@fused
def margins(m, mask, flags, par, pointer, since, t, h, tau, nodes, volts, margin):
    """margin[i, :] = event function of every foot at the nodes."""
    for i in range(m):
        if mask >> i & 1:
            for j in range(N):
                margin[i, j] = hold_margin(
                    i, flags, par, pointer, since[i], t + tau[j] * h, volts[i, j], nodes[i, j]
                )
        else:
            for j in range(N):
                margin[i, j] = nodes[i, j]


@inner
def hold_margin(i, flags, par, pointer, since, t, volts, pull):
    """What the contact still holds beyond the pull [N]: strength - pull - smooth force at zero gap."""
    left = hooks.strength(par, pointer, i, t - since) - pull
    if flags[i] & HAS_FORCE:
        left -= hooks.force(par, pointer, i, 0.0, 0.0, volts, t)
    return left


@fused
def bulge(q, k, i, nb, envelope, velocity):
    """Bound of what an output does between two nodes beyond their chord."""
    s = 0.0
    for b in range(nb):
        s += envelope[q, k, i, b] * math.sqrt(velocity[b] ** 2 + velocity[nb + b] ** 2)
    return s


@fused
def scan(i, order, margin, bound, limit, epsilon, tau):
    """First node interval in which foot i may have an event before the scaled time ``limit``.

    Returns (verdict, interval j): the event, if any, lies in (tau[j-1], tau[j]].
    """
    for j in range(1, N):
        if tau[j - 1] >= limit:
            break
        if margin[i, j] < -epsilon:
            return CROSSING, j
        width = (tau[j] - tau[j - 1]) / 0.2092
        local = bound * width * width
        if j == 1 and order > 0:
            # it starts at zero and rises: the chord must beat the steepest parabola of that bulge
            if margin[i, 1] <= (4.0 if order == 1 else 8.0) * local:
                return UNSURE, j
        elif min(margin[i, j - 1], margin[i, j]) <= local:
            return UNSURE, j
    return NOTHING, 0


@inner
def poly_margin(i, held, first, series, terms, s, flags, par, pointer, since, t, h, vpower):
    """Event function of foot i at scaled time s from its Taylor series (deflated by ``first`` for a free foot)."""
    if held:
        pull = horner(series, 0, terms, s)
        return hold_margin(i, flags, par, pointer, since, t + s * h, input_at(vpower, i, s), pull)
    return horner(series, first, terms, s)


@inner
def root(a, b, fa, fb, i, held, first, series, terms, flags, par, pointer, since, t, h, vpower):
    """Zero in [a, b] of the event function with f(a) > 0 > f(b), by the Illinois rule to machine precision."""
    side = 0
    for _ in range(80):
        if b - a <= 4e-16 * max(abs(a), abs(b)):
            break
        s = b - fb * (b - a) / (fb - fa)
        if not a < s < b:
            s = 0.5 * (a + b)
        f = poly_margin(i, held, first, series, terms, s, flags, par, pointer, since, t, h, vpower)
        if f == 0.0:
            return s
        if f < 0.0:
            b = s
            fb = f
            if side == -1:
                fa *= 0.5
            side = -1
        else:
            a = s
            fa = f
            if side == 1:
                fb *= 0.5
            side = 1
    return b


@inner
def poly_slope(i, held, series, terms, s, flags, par, pointer, since, t, h, vpower):
    """Slope of the event function in scaled time; by a central difference where a user's law is part of it."""
    if not held:
        return horner_slope(series, 0, terms, s)
    d = 1e-5
    up = poly_margin(i, held, 0, series, terms, s + d, flags, par, pointer, since, t, h, vpower)
    down = poly_margin(i, held, 0, series, terms, s - d, flags, par, pointer, since, t, h, vpower)
    return (up - down) / (2.0 * d)


@inner
def minimum(a, b, fa, fb, i, held, series, terms, flags, par, pointer, since, t, h, vpower):
    """Scaled time in [a, b] at which the slope rises through zero, from its values fa < 0 < fb at the ends."""
    for n in range(40):
        s = b - fb * (b - a) / (fb - fa)
        if n % 3 == 2 or not a < s < b:
            s = 0.5 * (a + b)
        f = poly_slope(i, held, series, terms, s, flags, par, pointer, since, t, h, vpower)
        if f == 0.0 or b - a < 1e-12:
            return s
        if f < 0.0:
            a = s
            fa = f
        else:
            b = s
            fb = f
    return 0.5 * (a + b)


@inner
def first_root(
    i, held, order, series, terms, limit, epsilon, tau, flags, par, pointer, since, t, h, vpower
):
    """First scaled time in (0, limit] at which foot i has its event, or 2.0 if there is none.

    Looks at every node interval of the Taylor series, with the interior minimum where the slope turns.
    """
    a = 0.0
    fa = poly_margin(i, held, 0, series, terms, 0.0, flags, par, pointer, since, t, h, vpower)
    slope_a = 0.0
    if order < 2:
        slope_a = poly_slope(i, held, series, terms, 0.0, flags, par, pointer, since, t, h, vpower)
    for j in range(1, N):
        if a >= limit:
            break
        b = min(tau[j], limit)
        fb = poly_margin(i, held, 0, series, terms, b, flags, par, pointer, since, t, h, vpower)
        slope_b = poly_slope(i, held, series, terms, b, flags, par, pointer, since, t, h, vpower)
        end, f_end = b, fb
        if fb >= -epsilon and slope_a < 0.0 < slope_b and (order == 0 or j > 1):
            s = minimum(a, b, slope_a, slope_b, i, held, series, terms, flags, par, pointer, since, t, h, vpower)
            f = poly_margin(i, held, 0, series, terms, s, flags, par, pointer, since, t, h, vpower)
            if f < -epsilon:
                end, f_end = s, f
        if f_end < -epsilon:
            if j == 1 and order > 0 and not held:
                return deflated_root(i, order, series, terms, end, flags, par, pointer, since, t, h, vpower)
            if fa <= 0.0:
                return a
            return root(a, end, fa, f_end, i, held, 0, series, terms, flags, par, pointer, since, t, h, vpower)
        a, fa, slope_a = b, fb, slope_b
    return 2.0


@inner
def deflated_root(i, order, series, terms, b, flags, par, pointer, since, t, h, vpower):
    """Return of a foot that left at s = 0: zero of f(s)/s^order in (0, b], or 0 if it never rises."""
    fa = horner(series, order, terms, 0.0)
    if fa <= 0.0:
        return 0.0
    fb = horner(series, order, terms, b)
    if fb >= 0.0:
        return b
    return root(0.0, b, fa, fb, i, False, order, series, terms, flags, par, pointer, since, t, h, vpower)
