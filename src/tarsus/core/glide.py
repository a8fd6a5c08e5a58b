"""Spells in which nothing can happen until the drives change: all feet held, and no pull can outgrow its strength."""

from __future__ import annotations

import math

from tarsus.core import arrays as a
from tarsus.core.events import hold
from tarsus.core.flow import dot, flow_state
from tarsus.core.jit import fused, rare
from tarsus.core.nodes import TAU, N
from tarsus.core.signals import fill

_tau = TAU


@fused
def drive(signals, laws, state, work, m, nd, t, h):
    """Nodal drive forces of a step, and the volts at the feet."""
    first, start, end, coef = signals.first, signals.start, signals.end, signals.coef
    flat, sharp, loop, period = signals.flat, signals.sharp, signals.loop, signals.period
    for d in range(nd):
        i = 2 * m + d
        work.constant[i] = fill(
            first, start, end, coef, flat, sharp, loop, period, state.cursor, d, t, h, _tau, work.values, i
        )
    for i in range(m):
        c = laws.volts[i]
        if c >= 0:
            fill(first, start, end, coef, flat, sharp, loop, period, state.cursor, c, t, h, _tau, work.volts, i)


@rare
def quiet(modes, laws, state, work, q, m, nb, ni, t, left):
    """Whether feet that are all held stay so for ``left`` at least, under drives that do not change.

    Each pull sways about its value at rest by no more than its modal amplitudes; see ``level`` and ``sway``.
    """
    w, z = state.w, work.velocity
    for b in range(nb):
        z[b] = modes.blocks[q, 0, b] * w[b] + modes.blocks[q, 1, b] * w[nb + b]
        z[nb + b] = modes.blocks[q, 2, b] * w[b] + modes.blocks[q, 3, b] * w[nb + b]
    for i in range(2 * m, ni):
        for r in range(2 * nb):
            z[r] += modes.inputs[q, i, r] * work.values[i, 0]
    for i in range(m):
        most = dot(modes.outputs, q, i, 2 * nb, w) - dot(modes.level, q, i, 2 * nb, z)
        for f in range(2 * m, ni):
            most += modes.feed[q, i, f] * work.values[f, 0]
        for b in range(nb):
            most += modes.sway[q, i, b] * math.sqrt(z[b] * z[b] + z[nb + b] * z[nb + b])
        for j in range(N):
            holds = hold(i, laws.flags, laws.parameters, laws.pointer, state.since[i], t + _tau[j] * left, work.volts[i, 0])
            if not holds - most > state.real[a.EPS_FORCE]:
                return False
    return True


@rare
def glide(modes, tables, signals, laws, state, work, q, m, nb, ni, nk, t, left):
    """Where nothing can happen until the drives change: the longest step that fits, with its flow alone.

    Returns its class, or -1 where something can happen or the rest is short enough to be cut from a landing step.
    """
    k = 0
    while k < nk and tables.terms[q, k] == 0 and tables.lengths[k] > left:
        k += 1
    if k == nk or tables.terms[q, k] > 0:
        return -1
    drive(signals, laws, state, work, m, ni - 2 * m - 1, t, tables.lengths[k])
    for i in range(2 * m, ni):
        if not work.constant[i]:  # a drive without kinks changes all the same
            return -1
    if not quiet(modes, laws, state, work, q, m, nb, ni, t, left):
        return -1
    for i in range(2 * m):
        work.active[i] = False
    flow_state(
        tables.exponential, tables.state_constant, tables.state_input, q, k, nb, ni, state.w, work.values,
        work.constant, work.active, work.state,
    )  # fmt: skip
    return k
