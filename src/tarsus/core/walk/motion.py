"""Motion of a walker at any moment within a step whose nodes are known (compiled).

From the last node before, each leg moves on by the tables of shorter steps, halving, until its own equation can be
expanded in a Taylor series in time; the polynomials that act on it are moved along. The body follows from momentum as
at the nodes.
"""

from __future__ import annotations

import math

import numpy as np

from tarsus.core.jit import inner, rare
from tarsus.core.nodes import MONOMIAL, TAU, N
from tarsus.core.row import load, store
from tarsus.core.walk import arrays as a
from tarsus.core.walk.states import AIR, STUCK

TERMS = 40
_REACH = 2.0
_tau = TAU
_monomial = MONOMIAL
_binomial = np.array([[math.comb(n, k) for k in range(N)] for n in range(N)], dtype=float)
# about node j: coefficients in (s - tau_j) from nodal values
_about = (
    np.array(
        [
            [[_binomial[c, k] * t ** (c - k) if c >= k else 0.0 for c in range(N)] for k in range(N)]
            for t in TAU
        ]
    )
    @ MONOMIAL
)


@inner
def shift(coefficients, row, by):
    """Coefficients of p(x + by) from those of p(x), in place."""
    for n in range(N - 1):
        for c in range(N - 2, n - 1, -1):
            coefficients[row, c] += by * coefficients[row, c + 1]


@inner
def expand(mass, stiffness, damping, h, span, u0, w0, push, momentum, coefficients, series):
    """Taylor series of u and w over ``span`` (of a step h): series[0, n], series[1, n] times x^n, x in [0, 1].

    coefficients[push], coefficients[momentum]: force and momentum in powers of the scaled time. Returns the terms.
    """
    series[0, 0] = u0
    series[1, 0] = w0
    step = h * span
    m = 1.0 / mass
    power = 1.0
    n = 0
    while n < TERMS - 1:
        force = 0.0
        film = 0.0
        if n < N:
            force = coefficients[push, n] * power
            film = coefficients[momentum, n] * power
            power *= span
        factor = step / (n + 1)
        du = factor * (series[1, n] + film * m)
        dw = factor * (
            (force - stiffness * series[0, n] - damping * series[1, n]) * m - damping * film * m * m
        )
        n += 1
        series[0, n] = du
        series[1, n] = dw
        # velocities over the span are displacements: both are small in the same unit
        if n > N and abs(du) + step * abs(dw) < 1e-18 * (abs(u0) + step * abs(w0)) + 1e-40:
            break
    return n + 1


@inner
def horner(series, row, terms, x):
    value = series[row, terms - 1]
    for n in range(terms - 2, -1, -1):
        value = value * x + series[row, n]
    return value


@inner
def polynomials(work, i, d, f, node):
    """Force and film momentum on a leg about a node, as polynomials of the scaled time, into work.column."""
    for c in range(N):
        force = 0.0
        film = 0.0
        for j in range(N):
            force += _about[node, c, j] * work.q[i, d, j]
        if d == 0 and work.filmed[i] != 0:
            for j in range(N):
                film += _about[node, c, j] * work.film[f, j]
        work.column[0, c] = force
        work.column[1, c] = film


@inner
def by_tables(tables, work, kind, k, width, u0, w0, filmed):
    """u and w at the end of a stretch of the step of class k, ``width`` of the step that work.column belongs to."""
    x = load(_tau, ()) * width
    push = x * 0.0
    momentum = x * 0.0
    for c in range(N - 1, -1, -1):
        push = push * x + work.column[0, c]
        if filmed:
            momentum = momentum * x + work.column[1, c]
    store(work.row, (2,), push)
    store(work.row, (3,), momentum)
    u = tables.state[k, kind, 0, N - 1] * u0 + tables.state[k, kind, 1, N - 1] * w0
    w = tables.state[k, kind, 2, N - 1] * u0 + tables.state[k, kind, 3, N - 1] * w0
    for j in range(N):
        u += tables.force[k, kind, 0, j, N - 1] * work.row[2, j]
        w += tables.force[k, kind, 1, j, N - 1] * work.row[2, j]
        if filmed:
            u += tables.film[k, kind, 0, j, N - 1] * work.row[3, j]
            w += tables.film[k, kind, 1, j, N - 1] * work.row[3, j]
    return u, w


@inner
def leg_at(body, tables, state, work, i, d, h, s):
    """u and w of a free leg at scaled time s of the step."""
    node = 0
    while node < N - 2 and _tau[node + 1] <= s:
        node += 1
    if node == 0:
        u, w = state.foot[i, d, 0], state.foot[i, d, 1]
    else:
        u, w = work.u[i, d, node], work.w[i, d, node]
    left = s - _tau[node]
    if left <= 0.0:
        return u, w
    polynomials(work, i, d, body.foot[i], node)
    kind = body.kind[i, d]
    rate = tables.rate[kind] * h
    # far from the node for the block's own rate: by the tables of shorter steps first
    k = state.count[a.CLASS] + 1
    width = 0.5
    while rate * left > _REACH and k < tables.lengths.shape[0]:
        if width <= left:
            u, w = by_tables(tables, work, kind, k, width, u, w, d == 0 and work.filmed[i] != 0)
            left -= width
            shift(work.column, 0, width)
            shift(work.column, 1, width)
        width *= 0.5
        k += 1
    terms = expand(
        body.mass[i], body.stiffness[i, d], body.damping[i, d], h, left, u, w, 0, 1, work.column, work.series
    )
    return horner(work.series, 0, terms, 1.0), horner(work.series, 1, terms, 1.0)


@inner
def polynomial_at(values, row, s):
    """The polynomial through the nodal values of a row, at s."""
    out = 0.0
    for c in range(N - 1, -1, -1):
        coefficient = 0.0
        for j in range(N):
            coefficient += _monomial[c, j] * values[row, j]
        out = out * s + coefficient
    return out


@inner
def integral_at(values, row, s, again):
    """Its integral from 0 to s, once or (again) twice."""
    out = 0.0
    for c in range(N - 1, -1, -1):
        coefficient = 0.0
        for j in range(N):
            coefficient += _monomial[c, j] * values[row, j]
        coefficient /= (c + 1) * (c + 2) if again else c + 1
        out = out * s + coefficient
    return out * s * s if again else out * s


@inner
def end_of_step(body, state, work, nb):
    """The state at the last node."""
    for b in range(nb):
        work.body[0, b] = work.bx[b, N - 1]
        work.body[1, b] = work.bv[b, N - 1]
    for i in range(body.mass.shape[0]):
        f = body.foot[i]
        for d in range(2):
            held = f >= 0 and (state.contact[f] == STUCK or (d == 0 and state.contact[f] != AIR))
            work.foot[i, d, 0] = state.foot[i, d, 0] if held else work.u[i, d, N - 1]
            work.foot[i, d, 1] = 0.0 if held else work.w[i, d, N - 1]


@rare
def motion_at(body, tables, state, work, nb, h, s):
    """State at scaled time s of the step into work.foot (nl, 2, 2) and work.body (2, nb)."""
    if s >= 1.0:
        end_of_step(body, state, work, nb)
        return
    for b in range(nb):
        work.body[0, b] = integral_at(work.push, b, s, True) * h * h + integral_at(work.drag, b, s, False) * h
        work.body[1, b] = integral_at(work.push, b, s, False) * h + polynomial_at(work.drag, b, s)
    for i in range(body.mass.shape[0]):
        f = body.foot[i]
        for d in range(2):
            u0, w0, m = state.foot[i, d, 0], state.foot[i, d, 1], body.mass[i]
            held = f >= 0 and (state.contact[f] == STUCK or (d == 0 and state.contact[f] != AIR))
            work.foot[i, d, 0] = u0
            work.foot[i, d, 1] = 0.0
            if held:
                continue
            u, w = leg_at(body, tables, state, work, i, d, h, s)
            work.foot[i, d, 0] = u
            work.foot[i, d, 1] = w
            momentum = m * (w - w0)
            place = m * (u - u0 - w0 * s * h)
            if d == 0 and work.filmed[i] != 0:
                place -= integral_at(work.film, f, s, False) * h
            for b in range(nb):
                work.body[0, b] -= body.hip[i, d, b] * place
                work.body[1, b] -= body.hip[i, d, b] * momentum
    for b in range(nb):
        m = body.body_mass[b]
        work.body[0, b] = work.body[0, b] / m + state.body[0, b] + state.body[1, b] * s * h
        work.body[1, b] = work.body[1, b] / m + state.body[1, b]
