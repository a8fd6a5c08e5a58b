"""Highest gap of a flight (compiled)."""

from __future__ import annotations

from tarsus.core.flow import horner, horner_slope
from tarsus.core.jit import fused, rare
from tarsus.core.nodes import N


@fused
def hides_peak(i, apex, nodes, bound, limit, tau):
    """True where the bulge between nodes could hide more than 1e-4 of a new highest gap of foot i."""
    top = 0.0
    for j in range(N):
        if tau[j] > limit:
            break
        top = max(top, nodes[i, j])
    return bound > 1e-4 * top and top + bound > apex[i, 0]


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
