"""The walking engine's loop, from event to event (compiled entry ``march``)."""

from __future__ import annotations

import math

from tarsus.core.arrays import DONE, EVENTS_FULL, NOT_FINITE, PERIOD_MARK, STALL, STEP_LIMIT, STEP_TOO_SMALL
from tarsus.core.jit import entry, inner, rare
from tarsus.core.landing import log
from tarsus.core.nodes import MONOMIAL, TAU, N
from tarsus.core.peak import raise_apex
from tarsus.core.reference import refer
from tarsus.core.signals import next_kink
from tarsus.core.walk import arrays as a
from tarsus.core.walk.account import account
from tarsus.core.walk.ground import film_momentum, happen
from tarsus.core.walk.motion import motion_at, shift
from tarsus.core.walk.scan import FIRST, HIGH, KIND, brackets, first_events
from tarsus.core.walk.states import AIR, SLIPPING, STUCK
from tarsus.core.walk.step import UNDEFINED, attempt

_tau, _monomial = TAU, MONOMIAL


@rare
def begin(body, signals, laws, batch, state, work, nb):
    """Set the state to the start of run count[RUN]."""
    count, real = state.count, state.real
    run = count[a.RUN]
    nl = body.mass.shape[0]
    n = nb + 2 * nl
    for b in range(nb):
        state.body[0, b] = batch.initial[run, b]
        state.body[1, b] = batch.initial[run, n + b]
        for power in range(a.AHEAD):
            state.ahead[b, power] = 0.0
        state.ahead[b, 0] = state.body[1, b]
        work.key[b, 0] = -1.0
    for f in range(body.leg.shape[0]):
        state.contact[f] = AIR
        state.sense[f] = 0.0
        state.since[f] = 0.0
        state.order[f] = 0
        state.apex[f, 0] = 0.0
        state.apex[f, 1] = 0.0
        state.apex[f, 2] = 0.0 if count[a.TRACK] != 0 else math.nan
        state.slipped[f] = 0.0
        for p in range(laws.parameters.shape[1]):
            laws.parameters[f, p] = batch.parameters[run, f, p]
    for i in range(nl):
        work.filmed[i] = 0
        for d in range(2):  # coordinates hold the way along before the height
            state.foot[i, d, 0] = batch.initial[run, nb + 2 * i + 1 - d]
            state.foot[i, d, 1] = batch.initial[run, n + nb + 2 * i + 1 - d]
        f = body.foot[i]
        if f >= 0:
            state.foot[i, 0, 1] -= film_momentum(laws, f, state.foot[i, 0, 0] + body.gap[i]) / body.mass[i]
    for c in range(signals.loop.shape[0]):
        state.cursor[c, 0] = signals.first[c]
        state.cursor[c, 1] = 0
    for e in range(a.ENERGIES):
        state.energy[e] = 0.0
    state.heave[0] = math.inf
    state.heave[1] = -math.inf
    for c in (a.STEPS, a.STALLED, a.REJECTED, a.FRESH, a.MARKS, a.SAMPLE, a.LAUNCH, a.LAUNCHING):
        count[c] = 0
    count[a.CLASS] = count[a.FIRST_CLASS]
    real[a.TIME] = 0.0
    real[a.PROGRESS] = -math.inf
    real[a.MARK] = 0.0


@rare
def mark(body, state, output, nb):
    """Note where the walker is at the end of a drive period, and how high feet and body went in it."""
    count, t = state.count, state.real[a.TIME]
    m = body.leg.shape[0]
    row = count[a.MARKROWS]
    marks = output.marks
    marks[row, 0] = t
    for b in range(nb):
        marks[row, 1 + b] = state.body[0, b]
    for f in range(m):
        marks[row, 1 + nb + f] = state.foot[body.leg[f], 1, 0]
        marks[row, 1 + nb + m + f] = state.slipped[f]
        if state.contact[f] == AIR and t > 0.0:
            log(output.events, count, t, f, PERIOD_MARK, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, state.apex)
            state.apex[f, 0] = 0.0
            state.apex[f, 1] = t
    low = min(state.heave[0], state.body[0, 1])
    high = max(state.heave[1], state.body[0, 1])
    marks[row, 1 + nb + 2 * m] = low
    marks[row, 2 + nb + 2 * m] = high
    state.heave[0] = state.body[0, 1]
    state.heave[1] = state.body[0, 1]
    count[a.MARKROWS] = row + 1
    if t >= state.real[a.MARK]:
        count[a.MARKS] += 1
        state.real[a.MARK] = count[a.MARKS] * state.real[a.PERIOD]


@rare
def finish(batch, state, code):
    """Note how run count[RUN] ended and go on to the next."""
    count = state.count
    run = count[a.RUN]
    batch.codes[run] = code
    batch.event_end[run] = count[a.BASE] + count[a.EVENTS]
    batch.mark_end[run] = count[a.MARK_BASE] + count[a.MARKROWS]
    batch.finish[run, 0] = state.real[a.TIME]
    batch.finish[run, 1] = count[a.STEPS]
    batch.finish[run, 2] = count[a.REJECTED]
    count[a.RUN] = run + 1
    count[a.FRESH] = 1


@inner
def coarsest(body, tables, state):
    """First step class in which the nodes see every free leg's own oscillation."""
    k = 0
    for i in range(body.mass.shape[0]):
        f = body.foot[i]
        contact = AIR if f < 0 else state.contact[f]
        if contact == AIR:
            k = max(k, tables.longest[body.kind[i, 0]])
        if contact != STUCK:
            k = max(k, tables.longest[body.kind[i, 1]])
    return k


@rare
def write_samples(body, tables, laws, state, work, output, before, nb, t, h, fraction, reached):
    """Rows of the sample times that lie in the step: motion, contacts and energies (those linear within it)."""
    count = state.count
    nl, m = body.mass.shape[0], body.leg.shape[0]
    last = output.times.shape[0]
    while count[a.SAMPLE] < last and output.times[count[a.SAMPLE]] <= reached:
        n = count[a.SAMPLE]
        s = min((output.times[n] - t) / h, fraction)
        s = max(s, 0.0)
        motion_at(body, tables, state, work, nb, h, s)
        row = 0
        for v in range(2):
            for b in range(nb):
                output.samples[n, row] = work.body[v, b]
                row += 1
        for i in range(nl):
            f = body.foot[i]
            for d in range(2):
                output.samples[n, row] = work.foot[i, d, 0]
                rate = work.foot[i, d, 1]
                if d == 0 and f >= 0 and state.contact[f] == AIR:
                    rate += film_momentum(laws, f, work.foot[i, 0, 0] + body.gap[i]) / body.mass[i]
                output.samples[n, row + 1] = rate
                row += 2
        for f in range(m):
            output.samples[n, row] = state.contact[f]
            output.samples[n, row + m] = state.sense[f]
            row += 1
        row += m
        share = s / fraction if fraction > 0.0 else 1.0
        for e in range(a.ENERGIES):
            output.samples[n, row + e] = before[e] + (state.energy[e] - before[e]) * share
        count[a.SAMPLE] = n + 1


@inner
def look_ahead(state, work, b, h, s, smooth):
    """Powers of time in which the body's velocity goes on; after an event or a kink its value alone."""
    for c in range(N):
        value = 0.0
        for j in range(N):
            value += _monomial[c, j] * work.bv[b, j]
        work.column[0, c] = value
    shift(work.column, 0, s)
    scale = 1.0
    for n in range(a.AHEAD):
        state.ahead[b, n] = work.column[0, n] * scale if smooth or n == 0 else 0.0
        scale /= h
    state.ahead[b, 0] = state.body[1, b]


@rare
def accept(body, tables, laws, state, work, output, nb, nd, t, h, fraction, reached, smooth):
    """Move the state on to scaled time ``fraction`` of the step."""
    count = state.count
    for e in range(a.ENERGIES):
        work.line[e] = state.energy[e]
    if count[a.ACCOUNT] != 0:
        account(body, tables, laws, state, work, nb, nd, h, fraction)
    if count[a.SAMPLE] < output.times.shape[0] and output.times[count[a.SAMPLE]] <= reached:
        write_samples(body, tables, laws, state, work, output, work.line, nb, t, h, fraction, reached)
    motion_at(body, tables, state, work, nb, h, fraction)
    for f in range(body.leg.shape[0]):
        i = body.leg[f]
        if state.contact[f] == AIR and count[a.TRACK] != 0:
            raise_apex(f, state.apex, work.gap, work.line, fraction, _tau, _monomial, t, h)
        elif state.contact[f] == SLIPPING:
            state.slipped[f] += abs(work.foot[i, 1, 0] - state.foot[i, 1, 0])
    for j in range(N):
        if _tau[j] <= fraction:
            state.heave[0] = min(state.heave[0], work.bx[1, j])
            state.heave[1] = max(state.heave[1], work.bx[1, j])
    ok = True
    for b in range(nb):
        state.body[0, b] = work.body[0, b]
        state.body[1, b] = work.body[1, b]
        ok = ok and math.isfinite(work.body[0, b] + work.body[1, b])
        look_ahead(state, work, b, h, fraction, smooth)
    for i in range(body.mass.shape[0]):
        for d in range(2):
            state.foot[i, d, 0] = work.foot[i, d, 0]
            state.foot[i, d, 1] = work.foot[i, d, 1]
            ok = ok and math.isfinite(work.foot[i, d, 0] + work.foot[i, d, 1])
    return ok


@inner
def step(body, tables, signals, laws, state, work, output, nb, nd, nc, nk):
    """Advance to the end of one step or to the first event inside it. Returns a code, or -1."""
    count, real = state.count, state.real
    t = real[a.TIME]
    kink, reach = next_kink(signals, state.cursor, nc, t)
    goal = min(real[a.END], real[a.MARK])
    left = min(kink, goal - t)
    k = max(count[a.CLASS], coarsest(body, tables, state))
    if count[a.LAUNCHING] != 0:  # what has just changed asks for a step as short as the last time
        k = max(k, count[a.LAUNCH])
    wanted = k
    while k + 1 < nk and tables.lengths[k + 1] >= left:
        k += 1
    error = 0.0
    while True:
        if k >= nk:
            return NOT_FINITE if error == UNDEFINED else STEP_TOO_SMALL
        h = tables.lengths[k]
        if h > left and h > reach:
            k += 1
            continue
        error, sweeps = attempt(body, tables, signals, laws, state, work, k, nb, nd, t, h)
        if 0.0 <= error <= 1.0:
            break
        count[a.REJECTED] += 1
        k += 1 if error < 0.0 else 1 + int(min(math.log2(error), 90.0) * 0.11)
        wanted = max(wanted, k)
    count[a.CLASS] = k
    limit = min(1.0, left / h)
    brackets(body, tables, laws, state, work, h, limit)
    first = first_events(body, tables, laws, state, work, h, limit)
    fraction = min(first, limit)
    reached = t + fraction * h
    if first > limit and h > left:
        reached = goal if left == goal - t else t + left
    elif first > limit:
        reached = t + h
    if fraction > 0.0:
        if not accept(
            body, tables, laws, state, work, output, nb, nd, t, h, fraction, reached, fraction == 1.0
        ):
            return NOT_FINITE
        real[a.TIME] = reached
        for f in range(body.leg.shape[0]):
            state.order[f] = 0
    if first <= limit:
        for f in range(body.leg.shape[0]):
            if work.when[f, FIRST, KIND] != 0.0 and work.when[f, FIRST, HIGH] <= first * (1.0 + 1e-13):
                happen(body, signals, laws, state, work, output.events, f, work.when[f, FIRST, KIND], nb)
    if count[a.LAUNCHING] != 0:
        count[a.LAUNCH] = k - 1 if error < 1e-3 else k
    count[a.LAUNCHING] = 1 if fraction < 1.0 or first <= limit else 0
    if error > 0.5 or sweeps > 12:
        wanted = max(wanted, k + 1)
    elif k <= wanted:
        wanted = k - (error < 1e-3) - (error < 1e-6) - (error < 1e-9) if sweeps < 9 else k
    count[a.CLASS] = max(wanted, 0)
    return -1


@inner
def progressed(state):
    """False when too many events crowd one instant."""
    t = state.real[a.TIME]
    if t - state.real[a.PROGRESS] > state.real[a.MIN_PROGRESS]:
        state.real[a.PROGRESS] = t
        state.count[a.STALLED] = 0
        return True
    state.count[a.STALLED] += 1
    return state.count[a.STALLED] < 4000


def make_march(sources: str):
    """The compiled engine; ``sources``, a hash of every source it was made of, keys its place in the disk cache."""

    def march(body, tables, signals, laws, batch, state, output, work):
        """Run all of a batch, or until the caller must empty what is full; the next call resumes.

        Returns DONE when every run has ended, each with its own code, or EVENTS_FULL.
        """
        if len(sources) == 0:
            return -1
        r_body, r_tables, r_signals, r_laws = refer(body), refer(tables), refer(signals), refer(laws)
        r_batch, r_state, r_output, r_work = refer(batch), refer(state), refer(output), refer(work)
        count, real = state.count, state.real
        nb = body.body_mass.shape[0]
        nd = body.body_load.shape[0]
        nc = signals.loop.shape[0]
        nk = tables.lengths.shape[0]
        m = body.leg.shape[0]
        capacity = output.events.shape[0] - 3 * m - 4
        while count[a.RUN] < batch.codes.shape[0]:
            if count[a.EVENTS] > capacity or count[a.MARKROWS] > output.marks.shape[0] - 4:
                return EVENTS_FULL
            if count[a.FRESH] != 0:
                begin(r_body, r_signals, r_laws, r_batch, r_state, r_work, nb)
            if real[a.TIME] >= real[a.END]:
                mark(r_body, r_state, r_output, nb)
                finish(r_batch, r_state, DONE)
                continue
            if real[a.TIME] >= real[a.MARK]:
                mark(r_body, r_state, r_output, nb)
                continue
            count[a.STEPS] += 1
            if count[a.STEPS] > count[a.MAX_STEPS]:
                finish(r_batch, r_state, STEP_LIMIT)
                continue
            code = step(r_body, r_tables, r_signals, r_laws, r_state, r_work, r_output, nb, nd, nc, nk)
            if code < 0 and not progressed(state):
                code = STALL
            if code >= 0:
                finish(r_batch, r_state, code)
        return DONE

    return entry(march)
