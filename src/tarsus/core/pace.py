"""How long the next step is: what a rejected or an accepted step, the film and the next event ask for (compiled)."""

from __future__ import annotations

import math

from tarsus.core import arrays as a
from tarsus.core.hooks import HAS_FORCE, HAS_MOMENTUM
from tarsus.core.jit import fused
from tarsus.core.nodes import TAU, N


@fused
def landing_class(terms, q):
    """Longest step in which an event can be landed on."""
    k = 0
    while terms[q, k] == 0:
        k += 1
    return k


@fused
def reject(m, mask, linear, room, error):
    """Classes to go down after a step with that error (negative: the smooth forces did not settle).

    A step that was not tried for where it leads (negative room) is cut down to what may be used of it. One that runs
    into the ground fails for what lies below it: one class down often ends above.
    """
    for i in range(m):
        if not mask >> i & 1 and room[i] < 0.0:
            return 1 + int(-math.log2(1.0 + room[i]))
    for i in range(m):
        if not mask >> i & 1 and linear[i, N - 1] < 0.0:
            return 1
    if not error > 1.0:
        return 2
    return 1 + int(min(math.log2(error), 90.0) * 0.11)


@fused
def launch_class(terms, flags, mask, remembered, q):
    """First step class in a contact mode: one to land in, or what the film let pass at the last start."""
    k = landing_class(terms, q)
    for i in range(flags.shape[0]):
        if not mask >> i & 1 and flags[i] & (HAS_MOMENTUM | HAS_FORCE):
            return max(k, remembered)
    return k


@fused
def shorter(tables, q, k, nk, fraction):
    """Largest shorter step class that ends within ``fraction`` of class k (at least one class down)."""
    n = k + 1
    while n < nk - 1 and tables.lengths[n] > fraction * tables.lengths[k]:
        n += 1
    return n


@fused
def landing_terms(lengths, terms, q, k, nk, fraction):
    """Taylor terms that carry the flow over ``fraction`` of a step of class k, 0 if that is too far."""
    n = k
    while n < nk - 1 and lengths[n + 1] >= fraction * lengths[k]:
        n += 1
    return terms[q, n]


@fused
def next_class(tables, work, real, q, k, wanted, error, m, h, event):
    """Step class to try next: the tail goes with h^9, and with the growth of the forces that caused it."""
    expected = error * real[a.GROWTH] ** 2
    if event:
        expected = error
    if expected > 0.5:
        wanted = max(wanted, k + 1)
    elif k <= wanted:
        # a class longer for every ten powers of two that are left
        wanted = max(k - (expected < 1e-3) - (expected < 1e-6) - (expected < 1e-9), 0)
    # An event that linear motion puts inside the next step needs a step to land in.
    ahead = math.inf
    for i in range(m):
        drop = work.margin[i, N - 2] - work.margin[i, N - 1]
        if drop > 0.0:
            ahead = min(ahead, work.margin[i, N - 1] * (TAU[N - 1] - TAU[N - 2]) * h / drop)
            film = work.values[i, N - 1] - work.values[i, N - 2]
            if work.active[i] and film > 0.0:
                room = 1.8 * work.values[i, N - 1] * (TAU[N - 1] - TAU[N - 2]) * h / film
                while tables.lengths[wanted] > room and wanted < tables.lengths.shape[0] - 1:
                    wanted += 1
    if event:
        ahead = 0.0
    while tables.terms[q, wanted] == 0 and tables.lengths[wanted] > ahead:
        wanted += 1
    return wanted
