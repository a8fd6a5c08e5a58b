"""A film too stiff for repetition: the gaps of one foot at the nodes by Newton's method (compiled)."""

from __future__ import annotations

import math

from tarsus.core import hooks
from tarsus.core.jit import fused, rare
from tarsus.core.nodes import N
from tarsus.core.row import load, lowest
from tarsus.core.walk import arrays as a

_ROUNDS = 40


@fused
def is_stiff(tables, laws, state, work, f, kind, k):
    """Whether the film changes the gap by more than a fraction of what changes the film, where it is thinnest."""
    probe = state.real[a.PROBE]
    least = lowest(load(work.gap, (f,)))
    slope = hooks.momentum(laws.parameters, laws.pointer, f, least + probe)
    slope -= hooks.momentum(laws.parameters, laws.pointer, f, least)
    return not abs(slope) * tables.reach[k, kind, 1] < 0.1 * probe


@rare
def stiff_film(body, tables, laws, state, work, i, f, kind, k):
    """Solve gap = gap without film + film matrix P(gap) at the nodes; work.film becomes P there.

    work.u holds the motion without film, work.gap where to start. A step of Newton's method uses up half of the way
    to where a film P ~ 1/(g + g0)^2 is infinite, -2 P/P', at most. False where it does not settle.
    """
    matrix, values = work.newton, work.line
    probe = state.real[a.PROBE]
    tolerance = 1e-3 * state.real[a.TOL_GAP]
    gaps, film = work.gap, work.film
    gaps[f, 0] = work.u[i, 0, 0] + body.gap[i]
    for _ in range(_ROUNDS):
        room = math.inf
        for j in range(N):
            film[f, j] = hooks.momentum(laws.parameters, laws.pointer, f, gaps[f, j])
            slope = hooks.momentum(laws.parameters, laws.pointer, f, gaps[f, j] + probe)
            slope -= hooks.momentum(laws.parameters, laws.pointer, f, gaps[f, j] - probe)
            slope /= 2.0 * probe
            values[j] = slope
            if slope < 0.0:
                room = min(room, -2.0 * film[f, j] / slope)
        for r in range(N):
            rest = work.u[i, 0, r] + body.gap[i] - gaps[f, r]
            for j in range(N):
                factor = tables.film[k, kind, 0, j, r]
                rest += factor * film[f, j]
                matrix[r, j] = -factor * values[j]
            matrix[r, r] += 1.0
            matrix[r, N] = rest
        if not eliminate(matrix, N):
            return False
        deepest = 0.0
        largest = 0.0
        for r in range(N):
            deepest = max(deepest, -matrix[r, N])
            largest = max(largest, abs(matrix[r, N]))
        if not math.isfinite(largest):
            return False
        share = 0.5 * room / deepest if deepest > 0.5 * room else 1.0
        for r in range(N):
            gaps[f, r] += share * matrix[r, N]
        if largest <= tolerance:
            for j in range(N):
                film[f, j] = hooks.momentum(laws.parameters, laws.pointer, f, gaps[f, j])
            return True
    return False


@rare
def eliminate(matrix, size):
    """Solve matrix[:, :size] x = matrix[:, size] in place by Gauss elimination with row pivots; x in the last column."""
    for c in range(size):
        best = c
        for r in range(c + 1, size):
            if abs(matrix[r, c]) > abs(matrix[best, c]):
                best = r
        if matrix[best, c] == 0.0:
            return False
        for j in range(c, size + 1):
            keep = matrix[c, j]
            matrix[c, j] = matrix[best, j]
            matrix[best, j] = keep
        for r in range(c + 1, size):
            factor = matrix[r, c] / matrix[c, c]
            if factor != 0.0:
                for j in range(c, size + 1):
                    matrix[r, j] -= factor * matrix[c, j]
    for r in range(size - 1, -1, -1):
        s = matrix[r, size]
        for j in range(r + 1, size):
            s -= matrix[r, j] * matrix[j, size]
        matrix[r, size] = s / matrix[r, r]
    return True
