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
from tarsus.core.row import load, lowest, store


@fused
def margins(m, mask, flags, par, pointer, since, t, h, tau, nodes, volts, margin):
    """margin[i, :] = event function of every foot at the nodes."""
    for i in range(m):
        if mask >> i & 1:
            for j in range(N):
                margin[i, j] = hold(i, flags, par, pointer, since[i], t + tau[j] * h, volts[i, j]) - nodes[i, j]
        else:
            store(margin, (i,), load(nodes, (i,)))


@inner
def hold(i, flags, par, pointer, since, t, volts):
    """Pull that breaks the contact of foot i off [N]: strength - smooth force at zero gap."""
    holds = hooks.strength(par, pointer, i, t - since)
    if flags[i] & HAS_FORCE:
        holds -= hooks.force(par, pointer, i, 0.0, 0.0, volts, t)
    return holds


@fused
def bulge(q, k, i, nb, envelope, speed):
    """Bound of what an output does between two nodes beyond their chord."""
    s = 0.0
    for b in range(nb):
        s += envelope[q, k, i, b] * speed[b]
    return s


@fused
def scan(i, order, margin, bound, limit, epsilon, tau, doubt):
    """doubt[i] = (first, last) node interval in which foot i may have an event before the scaled time ``limit``.

    Interval j is (tau[j-1], tau[j]]. Returns whether there is any.
    """
    doubt[i, 0] = N
    doubt[i, 1] = 0
    row = load(margin, (i,))
    if order == 0 and lowest(row) > bound:
        return False
    for j in range(1, N):
        if tau[j - 1] >= limit:
            break
        width = (tau[j] - tau[j - 1]) / 0.2092
        local = bound * width * width
        crossing = margin[i, j] < -epsilon
        rise = abs(margin[i, j] - margin[i, j - 1])
        if j == 1 and order > 0:
            # it starts at zero and rises: the chord must beat the steepest parabola of that bulge
            unsure = margin[i, 1] <= (4.0 if order == 1 else 8.0) * local
        else:
            # a parabola of that bulge b below a chord that rises by r dips (4 b - r)^2 / 16 b below its lower end
            short = 4.0 * local - rise
            unsure = short > 0.0 and min(margin[i, j - 1], margin[i, j]) * 16.0 * local <= short * short
        if crossing or unsure:
            if doubt[i, 1] == 0:
                doubt[i, 0] = j
            doubt[i, 1] = j
        if crossing:
            break
    return doubt[i, 1] > 0


@inner
def root(i, held, first, a, b, fa, fb, series, terms, flags, par, pointer, since, t, h, vpower):
    """Zero in [a, b] of the event function with f(a) > 0 > f(b): Newton's method kept inside the bracket.

    series: Taylor coefficients of a free foot's gap, divided by s^first, or of the pull on a held one. What holds
    against the pull hardly bends within the bracket: its slope is that of its chord.
    """
    slope_hold = 0.0
    if held:
        later = hold(i, flags, par, pointer, since, t + b * h, input_at(vpower, i, b))
        slope_hold = (later - hold(i, flags, par, pointer, since, t + a * h, input_at(vpower, i, a))) / (b - a)
    s = b - fb * (b - a) / (fb - fa)
    last = 1.0
    for _ in range(80):
        f = series[terms - 1]
        slope = 0.0
        for c in range(terms - 2, first - 1, -1):
            slope = slope * s + f
            f = f * s + series[c]
        if held:
            f = hold(i, flags, par, pointer, since, t + s * h, input_at(vpower, i, s)) - f
            slope = slope_hold - slope
        if f > 0.0:
            a = s
        else:
            b = s
        after = s - f / slope
        if not a <= after <= b:
            after = 0.5 * (a + b)
        change = abs(after - s)
        if change <= 1e-15 * b or (change < 1e-10 and change > 0.25 * last):
            return after
        last = change
        s = after
    return b


@inner
def poly_slope(i, held, first, series, terms, s, flags, par, pointer, since, t, h, vpower):
    """Slope of the event function over s^first in scaled time; by a central difference what holds a held foot."""
    slope = horner_slope(series, first, terms, s)
    if not held:
        return slope
    d = 1e-5
    up = hold(i, flags, par, pointer, since, t + (s + d) * h, input_at(vpower, i, s + d))
    down = hold(i, flags, par, pointer, since, t + (s - d) * h, input_at(vpower, i, s - d))
    return (up - down) / (2.0 * d) - slope


@inner
def dip(i, held, first, a, b, series, terms, flags, par, pointer, since, t, h, vpower):
    """Scaled time and value of the minimum inside [a, b] of the event function over s^first, or (b, inf)."""
    fa = poly_slope(i, held, first, series, terms, a, flags, par, pointer, since, t, h, vpower)
    fb = poly_slope(i, held, first, series, terms, b, flags, par, pointer, since, t, h, vpower)
    if not fa < 0.0 < fb:
        return b, math.inf
    s = b
    for n in range(40):
        s = b - fb * (b - a) / (fb - fa)
        if n % 3 == 2 or not a < s < b:
            s = 0.5 * (a + b)
        f = poly_slope(i, held, first, series, terms, s, flags, par, pointer, since, t, h, vpower)
        if f == 0.0 or b - a < 1e-12:
            break
        if f < 0.0:
            a = s
            fa = f
        else:
            b = s
            fb = f
    return s, poly_margin(i, held, first, series, terms, s, flags, par, pointer, since, t, h, vpower)


@inner
def poly_margin(i, held, first, series, terms, s, flags, par, pointer, since, t, h, vpower):
    """Event function of foot i over s^first at scaled time s from its Taylor series."""
    f = horner(series, first, terms, s)
    if held:
        return hold(i, flags, par, pointer, since, t + s * h, input_at(vpower, i, s)) - f
    return f


@inner
def lowest_power(series, first, terms, b):
    """Power that leads the rise of a foot let go at s = 0: a coefficient at rounding level of the others is none.

    A pull that only just outgrows its hold leaves no acceleration to start with: the foot rises with s^3.
    """
    size = 0.0
    power = 1.0
    for c in range(first, min(first + 6, terms)):
        size = max(size, abs(series[c]) * power)
        power *= b
    power = 1e-6 * size
    while first < 4 and abs(series[first]) <= power:
        first += 1
        power /= b
    return first


@inner
def first_root(
    i, held, order, doubt, margin, series, terms, limit, epsilon, tau, flags, par, pointer, since, t, h, vpower
):
    """First scaled time in (0, limit] at which foot i has its event, or 2.0 if there is none.

    Looks at the doubtful node intervals of the Taylor series, with the interior minimum where the slope turns.
    """
    for j in range(doubt[i, 0], doubt[i, 1] + 1):
        a = tau[j - 1]
        if a >= limit:
            break
        fa = margin[i, j - 1]
        b = tau[j]
        fb = margin[i, j]
        if b > limit:
            b = limit
            fb = poly_margin(i, held, 0, series, terms, b, flags, par, pointer, since, t, h, vpower)
        # a foot that left the ground at s = 0 comes back at the first zero of f(s) / s^first
        first = order if j == 1 and not held else 0
        if first == 2:
            first = lowest_power(series, first, terms, b)
        if fb >= -epsilon:
            b, fb = dip(i, held, first, a, b, series, terms, flags, par, pointer, since, t, h, vpower)
            fb *= b**first
        if fb < -epsilon:
            if first > 0:
                fa = series[first]  # it never rises where that is negative
                fb = horner(series, first, terms, b)
                if fb >= 0.0:
                    return b
            if fa <= 0.0:
                return a
            return root(i, held, first, a, b, fa, fb, series, terms, flags, par, pointer, since, t, h, vpower)
    return 2.0
