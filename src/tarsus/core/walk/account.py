"""Energy that every force passes on within a step, each integrated for itself (compiled; only where it is asked for)."""

from __future__ import annotations

import math

import numpy as np

from tarsus.core import hooks
from tarsus.core.hooks import HAS_FORCE
from tarsus.core.jit import inner, rare
from tarsus.core.nodes import DERIVATIVE, MONOMIAL, TAIL, TAU, N
from tarsus.core.row import highest, load, magnitude, store, total
from tarsus.core.walk import arrays as a
from tarsus.core.walk.motion import leg_at
from tarsus.core.walk.states import AIR, SLIPPING, STUCK
from tarsus.core.walk.step import hip

_tau = TAU
_monomial = MONOMIAL
_weights = np.ascontiguousarray(
    np.linalg.solve(np.vander(TAU, N, increasing=True).T, 1.0 / np.arange(1, N + 1))
)
_tail = np.ascontiguousarray(TAIL)
_slope = np.ascontiguousarray(DERIVATIVE.T)


@inner
def resample(matrix, start, width):
    """matrix[in, out]: values at the nodes of [start, start + width] of the polynomial through nodal values."""
    for n in range(N):
        s = start + _tau[n] * width
        for j in range(N):
            out = 0.0
            for c in range(N - 1, -1, -1):
                out = out * s + _monomial[c, j]
            matrix[j, n] = out


@inner
def seen(row, work, part):
    """A row on the part of the step that work.matrix stands for (not ``part``: the step itself)."""
    if not part:
        return row
    store(work.row, (0,), row)
    out = row * 0.0
    for j in range(N):
        out += load(work.matrix, (j,)) * work.row[0, j]
    return out


@inner
def slope(work, q):
    """Derivative of work.row[q] with respect to the scaled time."""
    out = load(work.row, (q,)) * 0.0
    for j in range(N):
        out += load(_slope, (j,)) * work.row[q, j]
    return out


@inner
def integral(row):
    return total(row * load(_weights, ()))


@inner
def by_film(work, rate, mass, low, high):
    """Integral of rate dP, with w in work.row[1] and the film's momentum P in work.row[2], ``low`` and ``high`` at the ends.

    A film much thinner than the way of the foot changes P where the nodes do not see it. Then by parts, with p = P - high:
    p^2/2m - rate p at the start, and - int p dw, for w hardly changes in so short a time.
    """
    film = load(work.row, (2,))
    missed = abs(total(film * load(_tail, ()))) + abs(work.row[2, 0] - low) + abs(work.row[2, N - 1] - high)
    if missed <= 1e-9 * highest(magnitude(film - high)):
        return integral(slope(work, 2) * rate)
    first = low - high
    return first * (0.5 * first / mass - work.row[1, 0] - low / mass) - integral((film - high) * slope(work, 1))


@inner
def of_free(body, tables, laws, state, work, i, d, nb, h, start, width, energy):
    """Add what a foot that nothing holds in direction d passes on over [start, start + width]."""
    f = body.foot[i]
    part = start > 0.0 or width < 1.0
    w = load(work.w, (i, d))
    low, high = work.u[i, d, 0], work.u[i, d, N - 1]
    if part:
        for n in range(N):
            high, speed = leg_at(body, tables, state, work, i, d, h, start + _tau[n] * width)
            work.row[1, n] = speed
            if n == 0:
                low = high
        w = load(work.row, (1,))
    rate = w
    span = h * width
    if d == 0 and work.filmed[i] != 0:
        store(work.row, (1,), w)
        store(work.row, (2,), seen(load(work.film, (f,)), work, part))
        rate = w + load(work.row, (2,)) * (1.0 / body.mass[i])
        low = hooks.momentum(laws.parameters, laws.pointer, f, low + body.gap[i])
        high = hooks.momentum(laws.parameters, laws.pointer, f, high + body.gap[i])
        energy[a.FILM] -= by_film(work, rate, body.mass[i], low, high)
    across = rate - seen(hip(body, i, d, work.bv, nb), work, part)
    energy[a.DAMPING] += body.damping[i, d] * integral(across * across) * span
    energy[a.WORK] += integral(seen(load(work.load, (i, d)), work, part) * rate) * span
    if f < 0:
        return
    if d == 0 and laws.flags[f] & HAS_FORCE:
        energy[a.SMOOTH] += integral(seen(load(work.smooth, (f,)), work, part) * rate) * span
    if d == 1 and state.contact[f] == SLIPPING:
        energy[a.FRICTION] += (
            integral(seen(load(work.bound, (f,)), work, part) * rate) * state.sense[f] * span
        )


@rare
def account(body, tables, laws, state, work, nb, nd, h, s):
    """Add the energies of the step up to scaled time ``s`` to state.energy."""
    energy = state.energy
    part = s < 1.0
    resample(work.matrix, 0.0, s)
    for b in range(nb):
        push = load(work.push, (b,)) * 0.0 - body.body_weight[b]
        for d in range(nd):
            if body.body_load[d, b] != 0.0:
                push += load(work.drive, (d,)) * body.body_load[d, b]
        push = seen(push, work, part)
        energy[a.WORK] += integral(push * seen(load(work.bv, (b,)), work, part)) * h * s
    for i in range(body.mass.shape[0]):
        f = body.foot[i]
        for d in range(2):
            if f >= 0 and (state.contact[f] == STUCK or (d == 0 and state.contact[f] != AIR)):
                rate = seen(hip(body, i, d, work.bv, nb), work, part)
                energy[a.DAMPING] += body.damping[i, d] * integral(rate * rate) * h * s
                continue
            # a fast decay at the start that the nodes do not see is taken on stretches that halve towards it
            w = load(work.w, (i, d))
            fast = tables.rate[body.kind[i, d]] * h * s
            unseen = abs(total(w * load(_tail, ()))) > 1e-9 * highest(magnitude(w))
            if fast < 1.0 or not unseen:
                of_free(body, tables, laws, state, work, i, d, nb, h, 0.0, s, energy)
                continue
            halvings = 1 + int(math.log2(fast))
            start = 0.0
            for n in range(halvings, -1, -1):
                end = s * 2.0**-n
                resample(work.matrix, start, end - start)
                of_free(body, tables, laws, state, work, i, d, nb, h, start, end - start, energy)
                start = end
            resample(work.matrix, 0.0, s)
