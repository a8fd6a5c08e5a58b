"""One step of a walker: body and legs consistent at its nodes (compiled).

Each leg is exact for the motion of its hip, a polynomial of degree 7 through the nodes. The body follows from momentum:
with S the feet that nothing holds in a direction, w their rates without the film's momentum and H the held ones,

    M (b' - b'(0)) = - sum_S R m (w - w(0)) + int [sum_S R load + sum_H R k (u - a) + load_b] - sum_H R c (a - a(0)),

so that whatever a leg does within a step, however fast, reaches the body exactly. Both are repeated until they agree.
"""

from __future__ import annotations

import math

import numpy as np

from tarsus.core import hooks
from tarsus.core.hooks import HAS_FORCE, HAS_LATCH, HAS_MOMENTUM
from tarsus.core.jit import fused, inner, rare
from tarsus.core.nodes import ONCE, TAIL, TAU, TWICE, N
from tarsus.core.row import highest, load, magnitude, store, total
from tarsus.core.signals import fill
from tarsus.core.walk import arrays as a
from tarsus.core.walk.film import is_stiff, stiff_film
from tarsus.core.walk.states import AIR, SLIPPING, STUCK

SWEEPS = 24
UNDEFINED = -math.inf  # error of a step in which a number is infinite or undefined
_tau = TAU
_once, _twice, _tail = ONCE, TWICE, np.ascontiguousarray(TAIL)


@fused
def once(values, q):
    """Integral of a row from the start of the step to every node, per step length."""
    out = load(_once, (0,)) * values[q, 0]
    for j in range(1, N):
        out += load(_once, (j,)) * values[q, j]
    return out


@fused
def twice(values, q):
    out = load(_twice, (0,)) * values[q, 0]
    for j in range(1, N):
        out += load(_twice, (j,)) * values[q, j]
    return out


@fused
def hip(body, i, d, rows, nb):
    """Motion of a leg's hip at the nodes."""
    out = load(rows, (0,)) * body.hip[i, d, 0]
    for q in range(1, nb):
        factor = body.hip[i, d, q]
        if factor != 0.0:
            out += load(rows, (q,)) * factor
    return out


@inner
def drives(body, signals, laws, state, work, nd, t, h):
    """Nodal drive forces and volts of a step, and what they and the weight put on every foot."""
    for d in range(nd):
        fill(
            signals.first, signals.start, signals.end, signals.coef, signals.flat, signals.sharp, signals.loop, signals.period,
            state.cursor, d, t, h, _tau, work.drive, d,
        )  # fmt: skip
    for i in range(laws.volts.shape[0]):
        if laws.volts[i] >= 0:
            fill(
                signals.first, signals.start, signals.end, signals.coef, signals.flat, signals.sharp, signals.loop, signals.period,
                state.cursor, laws.volts[i], t, h, _tau, work.volts, i,
            )  # fmt: skip
    for i in range(body.mass.shape[0]):
        up = load(work.drive, (0,)) * 0.0 - body.weight[i]
        along = load(work.drive, (0,)) * 0.0
        for n in range(body.first[i], body.first[i + 1]):
            force = load(work.drive, (body.drive[n],))
            up += force * body.gain[n, 0]
            along += force * body.gain[n, 1]
        store(work.load, (i, 0), up)
        store(work.load, (i, 1), along)


@fused
def held_margin(body, state, work, i, f, nb):
    """Of a held foot: margin = f_a - pull - smooth force = N + f_a at the nodes; work.smooth is f_a - smooth force."""
    k, c = body.stiffness[i, 0], body.damping[i, 0]
    pull = (
        (hip(body, i, 0, work.bx, nb) - state.foot[i, 0, 0]) * k
        + hip(body, i, 0, work.bv, nb) * c
        + load(work.load, (i, 0))
    )
    store(work.margin, (f,), load(work.smooth, (f,)) - pull)


@inner
def holds(laws, state, work, f, t, h):
    """What the contact of a held foot holds at the nodes: f_a into work.strength, f_a - smooth force into work.smooth."""
    latch = laws.flags[f] & HAS_LATCH != 0
    smooth = laws.flags[f] & HAS_FORCE != 0
    for j in range(N):
        now = t + _tau[j] * h
        strength = hooks.strength(laws.parameters, laws.pointer, f, now - state.since[f]) if latch else 0.0
        force = (
            hooks.force(laws.parameters, laws.pointer, f, 0.0, 0.0, work.volts[f, j], now) if smooth else 0.0
        )
        work.strength[f, j] = strength
        work.smooth[f, j] = strength - force


@inner
def bounds(laws, work, f):
    """Largest friction force on a held foot at the nodes, into work.bound."""
    for j in range(N):
        work.bound[f, j] = hooks.friction(
            laws.parameters, laws.pointer, f, work.margin[f, j], work.strength[f, j]
        )


@fused
def free_motion(body, tables, state, work, i, d, k):
    """u and w of a leg at the nodes under the forces work.q, without the film."""
    kind = body.kind[i, d]
    u0, w0 = state.foot[i, d, 0], state.foot[i, d, 1]
    u = load(tables.state, (k, kind, 0)) * u0 + load(tables.state, (k, kind, 1)) * w0
    w = load(tables.state, (k, kind, 2)) * u0 + load(tables.state, (k, kind, 3)) * w0
    for j in range(N):
        force = work.q[i, d, j]
        u += load(tables.force, (k, kind, 0, j)) * force
        w += load(tables.force, (k, kind, 1, j)) * force
    store(work.u, (i, d), u)
    store(work.w, (i, d), w)


@fused
def add_film(tables, work, i, f, kind, k):
    """What the film's momentum work.film adds to u and w of a foot in the air."""
    u, w = load(work.u, (i, 0)), load(work.w, (i, 0))
    for j in range(N):
        momentum = work.film[f, j]
        u += load(tables.film, (k, kind, 0, j)) * momentum
        w += load(tables.film, (k, kind, 1, j)) * momentum
    store(work.u, (i, 0), u)
    store(work.w, (i, 0), w)


@fused
def laws_at_nodes(body, tables, laws, state, work, i, f, k, t, h):
    """Gap, rate, film momentum and smooth force of a free foot at the nodes.

    Returns the largest change of the gap: infinite where a stiff film does not settle, NaN where a number is undefined.
    """
    before = load(work.gap, (f,))
    if work.filmed[i] != 0:
        kind = body.kind[i, 0]
        stiff = is_stiff(tables, laws, state, work, f, kind, k)
        if stiff and not stiff_film(body, tables, laws, state, work, i, f, kind, k):
            return math.inf
        add_film(tables, work, i, f, kind, k)
        store(work.gap, (f,), load(work.u, (i, 0)) + body.gap[i])
        hooks.momenta(laws.parameters, laws.pointer, f, work.gap, work.film)
        store(work.rate, (f,), load(work.w, (i, 0)) + load(work.film, (f,)) * (1.0 / body.mass[i]))
    else:
        store(work.gap, (f,), load(work.u, (i, 0)) + body.gap[i])
        store(work.rate, (f,), load(work.w, (i, 0)))
    if laws.flags[f] & HAS_FORCE:
        for j in range(N):
            work.smooth[f, j] = hooks.force(
                laws.parameters, laws.pointer, f, work.gap[f, j], work.rate[f, j], work.volts[f, j], t + _tau[j] * h
            )
        if not math.isfinite(total(load(work.smooth, (f,)))):
            return math.nan
    if not math.isfinite(total(load(work.gap, (f,)))):  # the largest number of a row passes over NaN
        return math.nan
    return highest(magnitude(load(work.gap, (f,)) - before))


@fused
def carry_free(body, state, work, i, d, q, nb, h):
    """What a foot that nothing holds in direction d does to the body: work.q holds its load without spring and damper."""
    u0, w0, m = state.foot[i, d, 0], state.foot[i, d, 1], body.mass[i]
    momentum = (load(work.w, (i, d)) - w0) * m
    place = (load(work.u, (i, d)) - u0 - load(_tau, ()) * (w0 * h)) * m
    if d == 0 and work.filmed[i] != 0:
        place = place - once(work.film, body.foot[i]) * h
    for b in range(nb):
        r = body.hip[i, d, b]
        if r != 0.0:
            store(work.push, (b,), load(work.push, (b,)) + q * r)
            store(work.momentum, (b,), load(work.momentum, (b,)) + momentum * r)
            store(work.place, (b,), load(work.place, (b,)) + place * r)


@fused
def carry_held(body, state, work, i, d, at, nb):
    """What a held foot does to the body through spring and damper; ``at``: hip at the nodes."""
    start = 0.0
    for b in range(nb):
        start += body.hip[i, d, b] * state.body[0, b]
    push = (at - state.foot[i, d, 0]) * -body.stiffness[i, d]
    drag = (at - start) * -body.damping[i, d]
    for b in range(nb):
        r = body.hip[i, d, b]
        if r != 0.0:
            store(work.push, (b,), load(work.push, (b,)) + push * r)
            store(work.drag, (b,), load(work.drag, (b,)) + drag * r)


@fused
def leg(body, tables, laws, state, work, i, k, nb, t, h):
    """One leg in both directions for the present motion of the body. Returns the largest change of its gap [m]."""
    f = body.foot[i]
    contact = AIR if f < 0 else state.contact[f]
    change = 0.0
    at = hip(body, i, 0, work.bx, nb)
    if contact == AIR:
        own = load(work.load, (i, 0))
        if f >= 0 and laws.flags[f] & HAS_FORCE:
            own += load(work.smooth, (f,))
        store(
            work.q,
            (i, 0),
            own + at * body.stiffness[i, 0] + hip(body, i, 0, work.bv, nb) * body.damping[i, 0],
        )
        free_motion(body, tables, state, work, i, 0, k)
        if f >= 0:
            change = laws_at_nodes(body, tables, laws, state, work, i, f, k, t, h)
        carry_free(body, state, work, i, 0, own, nb, h)
    else:
        held_margin(body, state, work, i, f, nb)
        if not math.isfinite(total(load(work.margin, (f,)))):
            return math.nan
        carry_held(body, state, work, i, 0, at, nb)
    at = hip(body, i, 1, work.bx, nb)
    pull = (
        at * body.stiffness[i, 1]
        + hip(body, i, 1, work.bv, nb) * body.damping[i, 1]
        + load(work.load, (i, 1))
    )
    if contact == STUCK:
        store(work.along, (f,), pull - state.foot[i, 1, 0] * body.stiffness[i, 1])
        carry_held(body, state, work, i, 1, at, nb)
        return change
    own = load(work.load, (i, 1))
    if contact == SLIPPING:
        bounds(laws, work, f)
        friction = load(work.bound, (f,)) * -state.sense[f]
        own += friction
        pull += friction
    store(work.q, (i, 1), pull)
    free_motion(body, tables, state, work, i, 1, k)
    carry_free(body, state, work, i, 1, own, nb, h)
    return change


@rare
def make_solver(solver, q, drag, push):
    """How the body answers its own held legs within a step: the last N rows of solver[q] become the columns of
    (1 + drag int + push int int)^-1."""
    for r in range(N):
        for c in range(N):
            solver[q, r, c] = drag * _once[r, c] + push * _twice[r, c]
            solver[q, N + r, c] = 0.0
        solver[q, r, r] += 1.0
        solver[q, N + r, r] = 1.0
    for p in range(N):  # diagonally dominant for the lengths in use: no pivoting
        scale = 1.0 / solver[q, p, p]
        for c in range(N):
            solver[q, p, c] *= scale
            solver[q, N + p, c] *= scale
        for r in range(N):
            factor = solver[q, r, p]
            if r == p or factor == 0.0:
                continue
            for c in range(N):
                solver[q, r, c] -= factor * solver[q, p, c]
                solver[q, N + r, c] -= factor * solver[q, N + p, c]


@inner
def solvers(body, state, work, nb, h):
    """Stiffness and damping that held feet put on every body coordinate, and the solver for them."""
    for b in range(nb):
        push = 0.0
        drag = 0.0
        for f in range(body.leg.shape[0]):
            i = body.leg[f]
            if state.contact[f] != AIR:
                push += body.hip[i, 0, b] ** 2 * body.stiffness[i, 0]
                drag += body.hip[i, 0, b] ** 2 * body.damping[i, 0]
            if state.contact[f] == STUCK:
                push += body.hip[i, 1, b] ** 2 * body.stiffness[i, 1]
                drag += body.hip[i, 1, b] ** 2 * body.damping[i, 1]
        push *= h * h / body.body_mass[b]
        drag *= h / body.body_mass[b]
        if push != work.key[b, 0] or drag != work.key[b, 1]:
            work.key[b, 0] = push
            work.key[b, 1] = drag
            make_solver(work.solver, b, drag, push)


@fused
def follow(body, state, work, nb, h):
    """The body's motion at the nodes from what the legs did. Returns the largest change of a hip [m]."""
    change = 0.0
    for b in range(nb):
        m = 1.0 / body.body_mass[b]
        drag = load(work.drag, (b,))
        v = load(work.momentum, (b,)) * -m + once(work.push, b) * (h * m) + drag * m + state.body[1, b]
        x = load(work.place, (b,)) * -m + twice(work.push, b) * (h * h * m) + once(work.drag, b) * (h * m)
        x = x + load(_tau, ()) * (h * state.body[1, b]) + state.body[0, b]
        store(work.nx, (b,), x - load(work.bx, (b,)))
        step = load(work.nx, (b,)) * 0.0
        for j in range(N):
            step += load(work.solver, (b, N + j)) * work.nx[b, j]
        store(work.nx, (b,), step)
        bx = load(work.bx, (b,)) + step
        # the velocity answers the step through the same held legs
        store(work.bv, (b,), v - step * (work.key[b, 1] / h) - once(work.nx, b) * (work.key[b, 0] / h))
        store(work.bx, (b,), bx)
        change = max(change, highest(magnitude(step)) * body.lever[b])
        if not math.isfinite(total(step)):
            return math.nan
    return change


@inner
def guess(body, laws, state, work, nb, h):
    """First motion of the body, which goes on as it went before, and first forces at the feet."""
    time = load(_tau, ()) * h
    for b in range(nb):
        v = time * 0.0
        x = time * 0.0
        for n in range(a.AHEAD - 1, -1, -1):
            v = v * time + state.ahead[b, n]
            x = x * time + state.ahead[b, n] / (n + 1)
        store(work.bv, (b,), v)
        store(work.bx, (b,), x * time + state.body[0, b])
    for f in range(body.leg.shape[0]):
        i = body.leg[f]
        work.filmed[i] = 0
        if state.contact[f] != AIR:
            holds(laws, state, work, f, state.real[a.TIME], h)
            continue
        gap = state.foot[i, 0, 0] + body.gap[i]
        store(work.gap, (f,), time * 0.0 + gap)
        rate = state.foot[i, 0, 1]
        if laws.flags[f] & HAS_MOMENTUM:
            work.filmed[i] = 1
            momentum = hooks.momentum(laws.parameters, laws.pointer, f, gap)
            rate += momentum / body.mass[i]
            store(work.film, (f,), time * 0.0 + momentum)
        if laws.flags[f] & HAS_FORCE:
            for j in range(N):
                work.smooth[f, j] = hooks.force(
                    laws.parameters, laws.pointer, f, gap, rate, work.volts[f, j], state.real[a.TIME]
                )


@inner
def clear(body, work, nb, nd):
    """Loads on the body itself; nothing carried yet."""
    for b in range(nb):
        push = load(work.push, (b,)) * 0.0 - body.body_weight[b]
        for d in range(nd):
            if body.body_load[d, b] != 0.0:
                push += load(work.drive, (d,)) * body.body_load[d, b]
        store(work.push, (b,), push)
        nothing = push * 0.0
        store(work.drag, (b,), nothing)
        store(work.momentum, (b,), nothing)
        store(work.place, (b,), nothing)


@inner
def error_of(body, tables, signals, state, work, k, nb, nd, h):
    """Truncation of a step over its tolerance: of gaps and of the way along, of the body, of the drives."""
    worst = 0.0
    for i in range(body.mass.shape[0]):
        f = body.foot[i]
        for d in range(2):
            if f >= 0 and (state.contact[f] == STUCK or (d == 0 and state.contact[f] != AIR)):
                continue
            kind = body.kind[i, d]
            error = abs(total(load(work.q, (i, d)) * load(_tail, ()))) * tables.reach[k, kind, 0]
            if d == 0 and work.filmed[i] != 0:
                reach = tables.reach[k, kind, 1]
                swing = abs(work.gap[f, N - 1] - work.gap[f, 0])
                # a stiff film holds the gap: an error of its momentum moves it no more than the film's slope lets it
                yields = reach * abs(work.film[f, N - 1] - work.film[f, 0]) / swing if swing > 0.0 else 0.0
                error += abs(total(load(work.film, (f,)) * load(_tail, ()))) * reach / (1.0 + yields)
            worst = max(worst, error)
    for b in range(nb):
        error = abs(total(load(work.push, (b,)) * load(_tail, ()))) * 0.5 * h
        error += abs(total(load(work.drag, (b,)) * load(_tail, ())))
        worst = max(worst, error * h / body.body_mass[b] * body.lever[b])
    worst /= state.real[a.TOL_GAP]
    for d in range(nd):
        if signals.span[d] > 0.0:
            error = abs(total(load(work.drive, (d,)) * load(_tail, ()))) / signals.span[d]
            worst = max(worst, error / state.real[a.TOL_DRIVE])
    return worst


@inner
def attempt(body, tables, signals, laws, state, work, k, nb, nd, t, h):
    """Make one step's nodes. Returns its error over the tolerance (-1: did not settle; UNDEFINED) and the sweeps it took."""
    drives(body, signals, laws, state, work, nd, t, h)
    guess(body, laws, state, work, nb, h)
    solvers(body, state, work, nb, h)
    tolerance = 1e-3 * state.real[a.TOL_GAP]
    before = math.inf
    for n in range(SWEEPS):
        clear(body, work, nb, nd)
        change = 0.0
        for i in range(body.mass.shape[0]):
            moved = leg(body, tables, laws, state, work, i, k, nb, t, h)
            if not math.isfinite(moved):
                return UNDEFINED if math.isnan(moved) else -1.0, n
            change = max(change, moved)
        moved = follow(body, state, work, nb, h)
        if not math.isfinite(moved):
            return UNDEFINED, n
        change = max(change if n > 0 else math.inf, moved)
        if change <= tolerance:
            return error_of(body, tables, signals, state, work, k, nb, nd, h), n + 1
        if n > 6 and change > 0.8 * before:
            return -1.0, n
        before = change
    return -1.0, SWEEPS
