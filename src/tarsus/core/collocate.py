"""One collocation step: the gaps at the nodes of a step, consistent with the smooth forces they cause."""

from __future__ import annotations

import math

from tarsus.core import hooks
from tarsus.core.flow import add_constant, add_nodal, nodal
from tarsus.core.hooks import HAS_FORCE, HAS_MOMENTUM, USES_RATE
from tarsus.core.jit import fused
from tarsus.core.nodes import TAU, N
from tarsus.core.row import highest, load, lowest, magnitude, store, total

SWEEPS = 14
STIFF = -2
DEEP = 0.9  # share of a foot's room to the ground (or the film's own singularity) that no step may use up


@fused
def evaluate_laws(q, m, mask, flags, par, pointer, t, h, tau, nodes, volts, values):
    """Nodal momentum and force of every free foot from the nodal gaps and gap rates."""
    for i in range(m):
        if mask >> i & 1:
            continue
        if flags[i] & HAS_MOMENTUM:
            hooks.momenta(par, pointer, i, nodes, values)
        if flags[i] & HAS_FORCE:
            for j in range(N):
                values[m + i, j] = hooks.force(
                    par, pointer, i, nodes[i, j], nodes[m + i, j], volts[i, j], t + tau[j] * h
                )


@fused
def sweep(q, k, m, mask, flags, node_input, linear, values, nodes):
    """nodes = linear + effect of the smooth forces, for gaps and (where a law uses them) rates of free feet.

    Returns the largest change of a nodal gap [m].
    """
    change = 0.0
    spoilt = False
    for i in range(m):
        if mask >> i & 1:
            continue
        for half in range(2):
            if half == 1 and not flags[i] & USES_RATE:
                continue
            o = i + half * m
            row = load(linear, (o,))
            for f in range(m):
                if flags[f] & HAS_MOMENTUM and not mask >> f & 1:
                    row += nodal(node_input, q, k, o, f, values)
                if flags[f] & HAS_FORCE and not mask >> f & 1:
                    row += nodal(node_input, q, k, o, m + f, values)
            if half == 0:
                moved = magnitude(row - load(nodes, (o,)))
                change = max(change, highest(moved))
                spoilt = spoilt or not math.isfinite(total(moved))  # the largest number of a row passes over NaN
            store(nodes, (o,), row)
    return math.nan if spoilt else change


@fused
def solve(
    q, k, m, mask, flags, par, pointer, t, h, tau, node_input, node_constant, linear, volts, values, nodes, tolerance,
    probe, room,
):
    """Picard sweeps for the smooth forces of the free feet; ``linear`` holds the outputs without them.

    Returns the number of sweeps, -1 where they do not settle (the step is too long), or STIFF where they cannot:
    the film changes the gap by more than a fraction of what changes the film. A step that would
    use up most of a foot's room is not tried: room[i] becomes the part of it that may be, less one (negative).
    """
    any_law = False
    for i in range(m):
        if mask >> i & 1:
            continue
        if flags[i] & (HAS_MOMENTUM | HAS_FORCE):
            any_law = True
        room[i] = 0.0
        store(nodes, (i,), load(linear, (i,)))
        store(nodes, (m + i,), load(linear, (m + i,)))
    if not any_law:
        return 0
    # Start from the forces of the first node, held constant.
    for i in range(m):
        if mask >> i & 1:
            continue
        if flags[i] & HAS_MOMENTUM:
            p = hooks.momentum(par, pointer, i, linear[i, 0])
            slope = (hooks.momentum(par, pointer, i, linear[i, 0] + probe) - p) / probe
            if abs(slope * node_constant[q, k, i, i, N - 1]) > 0.5:
                return STIFF
            room[i] = 2.0 * p / -slope if slope < 0.0 else 0.0
            for o in range(m):
                if not mask >> o & 1:
                    add_constant(node_constant, q, k, o, i, p, nodes)
        if flags[i] & HAS_FORCE:
            f = hooks.force(par, pointer, i, linear[i, 0], linear[m + i, 0], volts[i, 0], t)
            for o in range(m):
                if not mask >> o & 1:
                    add_constant(node_constant, q, k, o, m + i, f, nodes)
    for i in range(m):
        if not mask >> i & 1 and room[i] > 0.0 and runs_deep(i, nodes, room):
            return -1
    before = math.inf
    for n in range(SWEEPS):
        evaluate_laws(q, m, mask, flags, par, pointer, t, h, tau, nodes, volts, values)
        change = sweep(q, k, m, mask, flags, node_input, linear, values, nodes)
        if not math.isfinite(change):
            return -1
        if change <= tolerance or (n > 0 and change * change <= tolerance * max(before - change, 0.0)):
            # the momenta that flow on are those of the final gaps, or the ledger would drift
            evaluate_laws(q, m, mask, flags, par, pointer, t, h, tau, nodes, volts, values)
            return n + 1
        if n > 2 and change > 0.7 * before:
            return -1
        before = change
    return -1


@fused
def runs_deep(i, nodes, room):
    """Whether foot i would come close to where its film is infinite: a film P ~ 1/(g + g0)^2 is -2 P/P' away from it.

    Then room[i] = s - 1, with s the scaled time at which 0.8 of that way is used up.
    """
    if not lowest(load(nodes, (i,))) < nodes[i, 0] - DEEP * room[i]:
        return False
    level = nodes[i, 0] - 0.8 * room[i]
    j = 1
    while nodes[i, j] >= level:
        j += 1
    s = TAU[j - 1] + (TAU[j] - TAU[j - 1]) * (nodes[i, j - 1] - level) / (nodes[i, j - 1] - nodes[i, j])
    room[i] = s - 1.0
    return True


@fused
def tail(q, k, m, nd, mask, flags, tail_row, node_constant, values, nodes, constant, span):
    """Estimated error of a free foot's gap at the end of the step [m], of the drives relative to their span, and
    the growth of the smooth forces over the step (1 where they do not matter)."""
    gap_error = 0.0
    growth = 1.0
    for i in range(2 * m):
        foot = i if i < m else i - m
        wanted = HAS_MOMENTUM if i < m else HAS_FORCE
        if mask >> foot & 1 or not flags[foot] & wanted:
            continue
        a = total(load(values, (i,)) * load(tail_row, ()))
        # the farthest it moves the gap at any node: at the end of half an oscillation it is back where it began
        reach = highest(magnitude(load(node_constant, (q, k, foot, i))))
        swing = abs(nodes[foot, N - 1] - nodes[foot, 0])
        # a stiff film holds the gap: an error of its momentum moves it by no more than the film's own slope lets it
        yielding = reach * abs(values[i, N - 1] - values[i, 0]) / swing if swing > 0.0 else 0.0
        error = abs(a) * reach / (1.0 + yielding)
        if error > gap_error:
            gap_error = error
            before = abs(values[i, 0])
            after = abs(values[i, N - 1])
            growth = after / before if after > 0.0 and before > 0.0 else 1.0
    drive_error = 0.0
    for d in range(nd):
        i = 2 * m + d
        if constant[i] or span[d] == 0.0:
            continue
        a = total(load(values, (i,)) * load(tail_row, ()))
        drive_error = max(drive_error, abs(a) / span[d])
    return gap_error, drive_error, growth


@fused
def add_pull_forces(q, k, m, mask, flags, node_input, values, nodes):
    """Add to the pull of held feet the effect of the smooth forces at the free ones."""
    for o in range(m):
        if not mask >> o & 1:
            continue
        for f in range(m):
            if mask >> f & 1:
                continue
            if flags[f] & HAS_MOMENTUM:
                add_nodal(node_input, q, k, o, f, values, nodes)
            if flags[f] & HAS_FORCE:
                add_nodal(node_input, q, k, o, m + f, values, nodes)
