"""Highest gap of a flight (compiled)."""

from __future__ import annotations

from tarsus.core.jit import inner, rare
from tarsus.core.nodes import N


@inner
def horner(series, first, terms, s):
    """sum_c series[first + c] s^c."""
    value = series[terms - 1]
    for c in range(terms - 2, first - 1, -1):
        value = value * s + series[c]
    return value


@inner
def horner_slope(series, first, terms, s):
    value = (terms - 1.0 - first) * series[terms - 1]
    for c in range(terms - 2, first, -1):
        value = value * s + (c - first) * series[c]
    return value


@rare
def raise_apex(i, apex, nodes, line, limit, tau, monomial, t, h):
    """Keep the highest gap [m] of the flight of foot i, its time and the gap's integral [m s] in apex[i] = (gap, time,
    integral), up to ``limit``.

    Between the nodes the gap is the polynomial through them; its slope is searched on the two intervals beside the
    highest node. ``line`` is scratch.
    """
    best = 0
    for j in range(N):
        if tau[j] > limit:
            break
        if nodes[i, j] > nodes[i, best]:
            best = j
    low = tau[best - 1] if best > 0 else 0.0
    high = tau[best + 1] if best < N - 1 else 1.0
    high = min(high, limit)
    top = nodes[i, best]
    s = tau[best]
    total = 0.0
    power = limit * h
    for c in range(N):
        p = 0.0
        for j in range(N):
            p += monomial[c, j] * nodes[i, j]
        line[c] = p
        total += p * power / (c + 1.0)
        power *= limit
    apex[i, 2] += total
    if top > 0.5 * apex[i, 0] and high > low:
        if horner_slope(line, 0, N, low) > 0.0 > horner_slope(line, 0, N, high):
            for _ in range(30):
                s = 0.5 * (low + high)
                if horner_slope(line, 0, N, s) > 0.0:
                    low = s
                else:
                    high = s
        elif horner_slope(line, 0, N, high) >= 0.0:
            s = high
        top = max(top, horner(line, 0, N, s))
    if top > apex[i, 0]:
        apex[i, 0] = top
        apex[i, 1] = t + s * h
