"""The engine's loop: exact flight and stuck phases from event to event (compiled entry ``advance``)."""

from __future__ import annotations

import math

from tarsus.core import arrays as a
from tarsus.core.collocate import STIFF, add_pull_forces, solve, tail
from tarsus.core.contact import enter_mode, impact, log, release, reorder, settle
from tarsus.core.events import bulge, first_root, margins, scan
from tarsus.core.flow import (
    add_constant,
    add_nodal,
    flow_state,
    output_series,
    outputs_from_state,
    state_at,
    taylor,
)
from tarsus.core.glide import drive, glide
from tarsus.core.hooks import HAS_FORCE, HAS_MOMENTUM, USES_RATE
from tarsus.core.jit import entry, fused, rare
from tarsus.core.newton import newton
from tarsus.core.nodes import MONOMIAL, TAIL, TAU, N
from tarsus.core.pace import landing_terms, launch_class, next_class, reject, shorter
from tarsus.core.peak import hides_peak, raise_apex
from tarsus.core.reference import refer
from tarsus.core.row import highest, load, lowest, store
from tarsus.core.signals import seek

_tau, _monomial, _tail = TAU, MONOMIAL, TAIL


@fused
def next_kink(signals, cursor, nc, t):
    """Move all channels to ``t``; time to the next kink and the longest admissible reach beyond it [s]."""
    kink = math.inf
    reach = math.inf
    for c in range(nc):
        seek(signals.first, signals.start, signals.end, signals.loop, signals.period, cursor, c, t)
        p = cursor[c, 0]
        shift = cursor[c, 1] * signals.period[c]
        left = shift + signals.start[p] + signals.until[p] - t
        if left < kink:
            kink = left
        if not (signals.flat[p] and signals.sharp[p]):
            reach = min(reach, left + signals.over[p])
    return kink, reach


@fused
def prepare(modes, tables, signals, laws, state, work, q, k, m, nd, nc, size, t, h):
    """Nodal drive forces and volts of a step, and the outputs without smooth forces of free feet."""
    drive(signals, laws, state, work, m, nd, t, h)
    mask = modes.mask[q]
    values, linear = work.values, work.linear
    last = 2 * m + nd
    for i in range(m):
        for half in range(2):
            if half == 1 and (mask >> i & 1 or not laws.flags[i] & USES_RATE):
                continue
            o = i + half * m
            outputs_from_state(tables.node_state, q, k, o, size, state.w, linear)
            add_constant(tables.node_constant, q, k, o, last, 1.0, linear)
            for d in range(nd):
                if work.constant[2 * m + d]:
                    add_constant(tables.node_constant, q, k, o, 2 * m + d, values[2 * m + d, 0], linear)
                else:
                    add_nodal(tables.node_input, q, k, o, 2 * m + d, values, linear)


@fused
def attempt(modes, tables, signals, laws, state, work, q, k, m, nd, nc, size, t, h):
    """Collocate one step. Returns the largest tail over its tolerance, or -1 where it does not settle."""
    prepare(modes, tables, signals, laws, state, work, q, k, m, nd, nc, size, t, h)
    mask = modes.mask[q]
    flags = laws.flags
    sweeps = solve(
        q, k, m, mask, flags, laws.parameters, laws.pointer, t, h, _tau, tables.node_input, tables.node_constant,
        work.linear, work.volts, work.values, work.nodes, 0.05 * state.real[a.TOL_GAP], state.real[a.PROBE],
        work.other,
    )  # fmt: skip
    if sweeps == STIFF:
        sweeps = newton(
            q, k, m, mask, flags, laws.parameters, laws.pointer, t, h, _tau, tables.node_input, work.linear, work.volts,
            work.values, work.nodes, work.matrix, 0.05 * state.real[a.TOL_GAP], state.real[a.PROBE],
        )  # fmt: skip
    if sweeps < 0:
        return -1.0
    for i in range(m):
        if mask >> i & 1 or (not flags[i] & (HAS_MOMENTUM | HAS_FORCE) and sweeps == 0):
            store(work.nodes, (i,), load(work.linear, (i,)))
    if mask != 0:
        add_pull_forces(q, k, m, mask, flags, tables.node_input, work.values, work.nodes)
    gap_error, drive_error, growth = tail(
        q, k, m, nd, mask, flags, _tail, tables.node_constant, work.values, work.nodes, work.constant, signals.span
    )
    for i in range(m):
        work.active[i] = not mask >> i & 1 and flags[i] & HAS_MOMENTUM != 0
        work.active[m + i] = not mask >> i & 1 and flags[i] & HAS_FORCE != 0
    state.real[a.GROWTH] = growth
    return max(gap_error / state.real[a.TOL_GAP], drive_error / state.real[a.TOL_DRIVE])


@fused
def block_speeds(blocks, inputs, input_norm, values, constant, active, w, q, nb, ni, speed):
    """speed[b] = bound of |y'| of block b over the step: its start value and what changing inputs add.

    The rest of speed (3 nb) is scratch.
    """
    for b in range(nb):
        speed[b] = blocks[q, 0, b] * w[b] + blocks[q, 1, b] * w[nb + b]
        speed[nb + b] = blocks[q, 2, b] * w[b] + blocks[q, 3, b] * w[nb + b]
        speed[2 * nb + b] = 0.0
    for i in range(ni):
        if not active[i]:
            continue
        v = values[i, 0]
        for r in range(2 * nb):
            speed[r] += inputs[q, i, r] * v
        if constant[i]:
            continue
        row = load(values, (i,))
        span = highest(row) - lowest(row)
        for b in range(nb):
            speed[2 * nb + b] += span * input_norm[q, i, b]
    for b in range(nb):
        speed[b] = math.sqrt(speed[b] * speed[b] + speed[nb + b] * speed[nb + b]) + speed[2 * nb + b]


@rare
def record(state, output, work, q, k, ni, size, t, h, fraction):
    row = state.count[a.ROWS]
    trace = output.trace
    trace[row, a.T_TIME] = t
    trace[row, a.T_LENGTH] = h
    trace[row, a.T_FRACTION] = fraction
    trace[row, a.T_MODE] = q
    trace[row, a.T_CLASS] = k
    width = state.w.shape[0]
    for r in range(size):
        trace[row, a.TRACE_HEAD + r] = state.w[r]
    for i in range(ni):
        base = a.TRACE_HEAD + width + N * i
        for j in range(N):
            trace[row, base + j] = work.values[i, j] if work.active[i] else 0.0
    state.count[a.ROWS] = row + 1


@rare
def find_mode(mask_of, wanted):
    for q in range(mask_of.shape[0]):
        if mask_of[q] == wanted:
            return q
    return -1


@rare
def locate(modes, laws, state, work, q, m, nb, ni, size, t, h, limit, verdict, terms):
    """Taylor polynomial of the step and its first event: (foot or -1, scaled time)."""
    mask = modes.mask[q]
    taylor(
        modes.blocks, modes.inputs, _monomial, q, nb, ni, terms, h, state.w, work.values, work.constant, work.active,
        work.power, work.series,
    )  # fmt: skip
    best = 2.0
    foot = -1
    for i in range(m):
        if verdict[i, 1] == 0:
            continue
        held = mask >> i & 1 != 0
        output_series(modes.outputs, modes.feed, modes.feed_rate, q, i, size, ni, terms, h, work.series, work.power, work.line)
        if held and laws.flags[i] & HAS_FORCE:
            for c in range(N):
                s = 0.0
                for j in range(N):
                    s += _monomial[c, j] * work.volts[i, j]
                work.vpower[i, c] = s
        epsilon = state.real[a.EPS_FORCE] if held else state.real[a.EPS_GAP]
        s = first_root(
            i, held, state.order[i], verdict, work.margin, work.line, terms, limit, epsilon, _tau, laws.flags, laws.parameters, laws.pointer,
            state.since[i], t, h, work.vpower,
        )  # fmt: skip
        if s < best and s <= limit:
            best = s
            foot = i
    return foot, best


@fused
def look(modes, tables, laws, state, work, q, k, m, nb, ni, size, t, h, limit, verdict, track):
    """Scan all feet for events inside the step.

    Returns (any doubt, first doubtful node interval, too coarse to see the top of a flight).
    """
    mask = modes.mask[q]
    margins(m, mask, laws.flags, laws.parameters, laws.pointer, state.since, t, h, _tau, work.nodes, work.volts, work.margin)
    block_speeds(
        modes.blocks, modes.inputs, modes.input_norm, work.values, work.constant, work.active, state.w, q, nb, ni,
        work.velocity,
    )  # fmt: skip
    doubt = False
    coarse = False
    interval = N
    for i in range(m):
        held = mask >> i & 1
        bound = bulge(q, k, i, nb, tables.envelope, work.velocity)
        epsilon = state.real[a.EPS_FORCE] if held else state.real[a.EPS_GAP]
        if scan(i, state.order[i], work.margin, bound, limit, epsilon, _tau, verdict):
            doubt = True
            interval = min(interval, verdict[i, 0])
        if track and not held and hides_peak(i, state.apex, work.nodes, bound, limit, _tau):
            coarse = True
    return doubt, interval, coarse


@fused
def step(
    modes, tables, signals, laws, state, work, verdict, r_modes, r_tables, r_signals, r_laws, r_state, r_work, r_output, m, nd, nc, ni, nk
):
    """Advance to the end of one step or to the event inside it. Returns (code or -1, foot with an event or -1)."""
    count, real = state.count, state.real
    q, k = count[a.MODE], count[a.CLASS]
    nb = modes.nb[q]
    size = 2 * nb
    t = real[a.TIME]
    kink, reach = next_kink(signals, state.cursor, nc, t)
    goal = min(real[a.END], real[a.MARK])
    left = min(kink, goal - t)
    if reach == math.inf and modes.mask[q] == (1 << m) - 1 and count[a.LAUNCHING] == 0:
        far = glide(r_modes, r_tables, r_signals, r_laws, r_state, r_work, q, m, nb, ni, nk, t, left)
        if far >= 0:
            h = tables.lengths[far]
            if count[a.RECORD] != 0:
                record(r_state, r_output, r_work, q, far, ni, size, t, h, 1.0)
            for r in range(size):
                state.w[r] = work.state[r]
            real[a.TIME] = t + h
            return -1, -1
    wanted = k
    while True:
        if k >= nk:
            return a.STEP_TOO_SMALL, -1
        h = tables.lengths[k]
        if h > left and (tables.terms[q, k] == 0 or h > reach):
            k += 1
            continue
        error = attempt(modes, tables, signals, laws, state, work, q, k, m, nd, nc, size, t, h)
        if not 0.0 <= error <= 1.0:
            count[a.REJECTED] += 1
            k += reject(m, modes.mask[q], work.linear, work.other, error)
            wanted = max(wanted, k)
            continue
        limit = min(1.0, left / h)
        doubt, interval, coarse = look(
            modes, tables, laws, state, work, q, k, m, nb, ni, size, t, h, limit, verdict, count[a.TRACK] != 0
        )
        far = limit if h > left else 0.0
        for i in range(m):
            if verdict[i, 1] > 0:
                far = max(far, _tau[verdict[i, 1]])
        terms = 0
        if far > 0.0:
            terms = landing_terms(tables.lengths, tables.terms, q, k, nk, min(far, limit))
        if far > 0.0 and terms == 0:
            count[a.REJECTED] += 1
            k = shorter(tables, q, k, nk, max(_tau[interval - 1] if interval < N else 0.0, 0.125))
            continue
        if coarse and tables.terms[q, k] == 0:
            k += 1
            continue
        break
    foot = -1
    fraction = limit
    if doubt or h > left:
        foot, s = locate(r_modes, r_laws, r_state, r_work, q, m, nb, ni, size, t, h, limit, verdict, terms)
        if foot >= 0:
            fraction = s
    if count[a.TRACK] != 0:
        for i in range(m):
            if not modes.mask[q] >> i & 1:
                raise_apex(i, state.apex, work.nodes, work.line, fraction, _tau, _monomial, t, h)
    if count[a.RECORD] != 0:
        record(r_state, r_output, r_work, q, k, ni, size, t, h, fraction)
    if foot < 0 and h <= left:
        flow_state(
            tables.exponential, tables.state_constant, tables.state_input, q, k, nb, ni, state.w, work.values,
            work.constant, work.active, work.state,
        )  # fmt: skip
        real[a.TIME] = t + h
    else:
        state_at(work.series, terms, size, fraction, work.state)
        real[a.TIME] = t + fraction * h if foot >= 0 else t + left
        if foot < 0 and left == goal - t:
            real[a.TIME] = goal
    for r in range(size):
        if not math.isfinite(work.state[r]):
            return a.NOT_FINITE, -1
        state.w[r] = work.state[r]
    if fraction > 0.0:
        for i in range(m):
            if i != foot:
                state.order[i] = 0
    if count[a.LAUNCHING] != 0:
        count[a.LAUNCHING] = 0
        if error > 0.0:
            count[a.LAUNCH] = k - 1 if error < 1e-3 else k
    count[a.CLASS] = next_class(tables, work, real, q, k, wanted, error, m, h, foot >= 0)
    return -1, foot


@fused
def progressed(state):
    """False when too many events crowd one instant."""
    t = state.real[a.TIME]
    if t - state.real[a.PROGRESS] > state.real[a.MIN_PROGRESS]:
        state.real[a.PROGRESS] = t
        state.count[a.STALLED] = 0
        return True
    state.count[a.STALLED] += 1
    return state.count[a.STALLED] < 2000


@rare
def begin(signals, laws, batch, state):
    """Set the state to the start of run count[RUN]."""
    count, real = state.count, state.real
    run = count[a.RUN]
    for r in range(state.physical.shape[0]):
        state.physical[r] = batch.initial[run, r]
    for i in range(laws.parameters.shape[0]):
        state.since[i] = 0.0
        state.order[i] = 0
        state.apex[i, 0] = 0.0
        state.apex[i, 1] = 0.0
        state.apex[i, 2] = 0.0 if count[a.TRACK] != 0 else math.nan
        for p in range(laws.parameters.shape[1]):
            laws.parameters[i, p] = batch.parameters[run, i, p]
    for c in range(signals.loop.shape[0]):
        state.cursor[c, 0] = signals.first[c]
        state.cursor[c, 1] = 0
    for n in (a.PENDING, a.STEPS, a.STALLED, a.REJECTED, a.FRESH, a.MARKS, a.LAUNCH):
        count[n] = 0
    count[a.CHECK] = 1
    count[a.CLASS] = count[a.FIRST_CLASS]
    real[a.TIME] = 0.0
    real[a.PROGRESS] = -math.inf
    real[a.MARK] = real[a.PERIOD]


@rare
def finish(batch, state, code):
    """Note how run count[RUN] ended and go on to the next."""
    count = state.count
    run = count[a.RUN]
    batch.codes[run] = code
    batch.event_end[run] = count[a.BASE] + count[a.EVENTS]
    batch.finish[run, 0] = state.real[a.TIME]
    batch.finish[run, 1] = count[a.STEPS]
    batch.finish[run, 2] = count[a.REJECTED]
    count[a.RUN] = run + 1
    count[a.FRESH] = 1


@rare
def mark(events, state, mask, m):
    """End of a drive period, or of the run: log the highest gap since the last mark and start anew."""
    count, t = state.count, state.real[a.TIME]
    for i in range(m):
        if not mask >> i & 1:
            log(events, count, t, i, a.PERIOD_MARK, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, state.apex)
            state.apex[i, 0] = 0.0
            state.apex[i, 1] = t
    count[a.MARKS] += 1
    state.real[a.MARK] = (count[a.MARKS] + 1) * state.real[a.PERIOD]


def make_advance(sources: str):
    """The compiled engine; ``sources``, a hash of every source it was made of, keys its place in the disk cache."""

    def advance(modes, tables, signals, laws, batch, state, output, work, verdict):
        """Run all of a batch, or until the caller must act; the state is complete and the next call resumes.

        Returns DONE when every run has ended (each with its own code), or NEED_MODE, EVENTS_FULL, TRACE_FULL.
        """
        if len(sources) == 0:
            return -1
        # what is called seldom takes references
        r_modes, r_signals, r_laws, r_batch = refer(modes), refer(signals), refer(laws), refer(batch)
        r_tables, r_state, r_work, r_output = refer(tables), refer(state), refer(work), refer(output)
        count, real = state.count, state.real
        m = laws.flags.shape[0]
        nc = signals.loop.shape[0]
        ni = modes.feed.shape[2]
        nd = ni - 2 * m - 1
        nk = tables.lengths.shape[0]
        capacity = output.events.shape[0] - 2 * m - 4
        rows = output.trace.shape[0] - 2
        while count[a.RUN] < batch.codes.shape[0]:
            if count[a.FRESH] != 0:
                begin(r_signals, r_laws, r_batch, r_state)
            if count[a.PENDING] >= 0:
                q = find_mode(modes.mask, count[a.PENDING])
                if q < 0:
                    return a.NEED_MODE
                enter_mode(r_modes, r_laws, q, m, state.physical, state.w, work.state, work.other)
                count[a.MODE] = q
                count[a.CLASS] = launch_class(tables.terms, laws.flags, modes.mask[q], count[a.LAUNCH], q)
                count[a.LAUNCHING] = 1
                count[a.PENDING] = -1
                if m > 1:
                    count[a.CHECK] = 1
            q = count[a.MODE]
            size = 2 * modes.nb[q]
            if count[a.EVENTS] > capacity:
                return a.EVENTS_FULL
            if count[a.RECORD] != 0 and count[a.ROWS] > rows:
                return a.TRACE_FULL
            if real[a.TIME] >= real[a.MARK]:
                mark(output.events, r_state, modes.mask[q], m)
                continue
            if real[a.TIME] >= real[a.END]:
                mark(output.events, r_state, modes.mask[q], m)
                finish(r_batch, r_state, a.DONE)
                continue
            if count[a.CHECK] != 0:
                count[a.CHECK] = 0
                next_kink(signals, state.cursor, nc, real[a.TIME])
                if m > 1:
                    reorder(r_modes, r_laws, r_state, q, m, size, work.other)
                if m > 0 and settle(r_modes, r_laws, r_signals, r_state, output.events, q, m, nd, size, work.other):
                    count[a.CHECK] = 1
                    if not progressed(state):
                        finish(r_batch, r_state, a.STALL)
                    continue
            count[a.STEPS] += 1
            if count[a.STEPS] > count[a.MAX_STEPS]:
                finish(r_batch, r_state, a.STEP_LIMIT)
                continue
            code, foot = step(
                modes, tables, signals, laws, state, work, verdict, r_modes, r_tables, r_signals, r_laws, r_state, r_work, r_output, m, nd, nc, ni, nk
            )
            if code >= 0:
                finish(r_batch, r_state, code)
            elif foot >= 0:
                if modes.mask[q] >> foot & 1:
                    release(r_modes, r_laws, r_state, output.events, q, m, size, foot, work.other)
                else:
                    impact(r_modes, r_laws, r_signals, r_state, output.events, q, m, nd, size, foot, work.other, -1.0)
                count[a.CHECK] = 1 if m > 1 else 0
                if not progressed(state):
                    finish(r_batch, r_state, a.STALL)
        return a.DONE

    return entry(advance)
