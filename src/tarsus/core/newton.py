"""Newton's method for the nodal gaps of a step, where a film is too stiff for fixed-point sweeps (compiled)."""

from __future__ import annotations

import math

from tarsus.core import hooks
from tarsus.core.collocate import evaluate_laws, sweep
from tarsus.core.hooks import HAS_FORCE, HAS_MOMENTUM
from tarsus.core.jit import rare
from tarsus.core.nodes import N

ITERATIONS = 40


@rare
def assemble(q, k, m, mask, flags, par, pointer, t, h, tau, node_input, volts, nodes, matrix, probe):
    """matrix[:, :-1] = I - d(effect of the smooth forces)/d(nodal gaps), rows and columns foot * N + node."""
    size = m * N
    for r in range(size):
        for c in range(size):
            matrix[r, c] = 1.0 if r == c else 0.0
    for f in range(m):
        if mask >> f & 1:
            continue
        for b in range(N):
            g = nodes[f, b]
            p = 0.0
            s = 0.0
            if flags[f] & HAS_MOMENTUM:
                p = hooks.momentum(par, pointer, f, g + probe) - hooks.momentum(par, pointer, f, g - probe)
            if flags[f] & HAS_FORCE:
                time = t + tau[b] * h
                s = hooks.force(par, pointer, f, g + probe, nodes[m + f, b], volts[f, b], time)
                s -= hooks.force(par, pointer, f, g - probe, nodes[m + f, b], volts[f, b], time)
            p /= 2.0 * probe
            s /= 2.0 * probe
            for o in range(m):
                if mask >> o & 1:
                    continue
                for j in range(N):
                    matrix[o * N + j, f * N + b] -= (
                        node_input[q, k, o, f, b, j] * p + node_input[q, k, o, m + f, b, j] * s
                    )


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


@rare
def newton(
    q, k, m, mask, flags, par, pointer, t, h, tau, node_input, linear, volts, values, nodes, matrix, tolerance, probe
):
    """Nodal gaps consistent with the smooth forces, by damped Newton steps from the gaps of the first node.

    Returns the number of iterations, or -1 where it does not converge. ``matrix`` (m N, m N + 2) is scratch; its last
    column keeps the gaps a step starts from.
    """
    size = m * N
    for i in range(m):
        if not mask >> i & 1:
            for j in range(N):
                nodes[i, j] = linear[i, 0]
    for n in range(ITERATIONS):
        evaluate_laws(q, m, mask, flags, par, pointer, t, h, tau, nodes, volts, values)
        assemble(q, k, m, mask, flags, par, pointer, t, h, tau, node_input, volts, nodes, matrix, probe)
        for i in range(m):
            for j in range(N):
                matrix[i * N + j, size + 1] = nodes[i, j]
        misfit = sweep(q, k, m, mask, flags, node_input, linear, values, nodes)
        if not math.isfinite(misfit):
            return -1
        for i in range(m):
            for j in range(N):
                r = i * N + j
                matrix[r, size] = 0.0 if mask >> i & 1 else nodes[i, j] - matrix[r, size + 1]
        if not eliminate(matrix, size):
            return -1
        change = 0.0
        for r in range(size):
            change = max(change, abs(matrix[r, size]))
        if not math.isfinite(change):
            return -1
        damp = 1.0
        for _ in range(12):
            for i in range(m):
                if not mask >> i & 1:
                    for j in range(N):
                        nodes[i, j] = matrix[i * N + j, size + 1] + damp * matrix[i * N + j, size]
            evaluate_laws(q, m, mask, flags, par, pointer, t, h, tau, nodes, volts, values)
            if change * damp <= tolerance or sweep_misfit(q, k, m, mask, flags, node_input, linear, values, nodes) < misfit:
                break
            damp *= 0.5
        if change * damp <= tolerance:
            return n + 1
    return -1


@rare
def sweep_misfit(q, k, m, mask, flags, node_input, linear, values, nodes):
    """Largest misfit [m] of the nodal gaps, which stay as they are."""
    misfit = 0.0
    for i in range(m):
        if mask >> i & 1:
            continue
        for j in range(N):
            s = linear[i, j] - nodes[i, j]
            for f in range(m):
                if mask >> f & 1:
                    continue
                for b in range(N):
                    if flags[f] & HAS_MOMENTUM:
                        s += node_input[q, k, i, f, b, j] * values[f, b]
                    if flags[f] & HAS_FORCE:
                        s += node_input[q, k, i, m + f, b, j] * values[m + f, b]
            misfit = max(misfit, abs(s))
    return misfit
