"""The first events inside a step whose nodes are known (compiled)."""

from __future__ import annotations

import numpy as np

from tarsus.core.jit import inner, rare
from tarsus.core.nodes import TAU, N, interpolation
from tarsus.core.row import highest, load, lowest, store
from tarsus.core.walk import arrays as a
from tarsus.core.walk.motion import leg_at, polynomial_at
from tarsus.core.walk.states import AIR, SLIPPING, STUCK
from tarsus.core.walk.step import bounds

TOUCH, PULL_OFF, SLIP_UP, SLIP_DOWN, STOP = 1, 2, 3, 4, 5
# rows of Work.when: a foot's candidates for its first event, in the end that event itself
CANDIDATES = 3
FIRST, SECOND, THIRD = range(CANDIDATES)
# its columns: bracket of an event (low, high), its kind (0: none)
LOW, HIGH, KIND = range(3)
_tau = TAU
# rows: values of the polynomial through nodal values at three places between neighbouring nodes, padded to rows of N
_between = [TAU[j] + (TAU[j + 1] - TAU[j]) * f for j in range(N - 1) for f in (0.2, 0.5, 0.8)]
_places = [*_between, *([1.0] * (-len(_between) % N))]
_dense = interpolation(np.array(_places)).T.reshape(N, len(_places) // N, N).copy()
_where = np.array(_places)
LINES = len(_places) // N


@inner
def note(work, f, candidate, low, high, kind, limit):
    """Keep a bracket as one of a foot's candidates."""
    if low < limit:
        work.when[f, candidate, LOW] = low
        work.when[f, candidate, HIGH] = high
        work.when[f, candidate, KIND] = kind


@inner
def falls_below(values, f, level, limit, candidate, kind, work):
    """Note where the polynomial through values[f] first falls below ``level``."""
    if values[f, 0] < level:
        note(work, f, candidate, 0.0, 0.0, kind, 1.0)
        return
    row = load(values, (f,))
    least, most = lowest(row), highest(row)
    if least - 0.5 * (most - least) > level:
        return
    end = 2.0
    begin = 0.0
    for j in range(1, N):
        if values[f, j] < level:
            begin, end = _tau[j - 1], _tau[j]
            break
    for line in range(LINES):
        points = load(_dense, (0, line)) * values[f, 0]
        for j in range(1, N):
            points += load(_dense, (j, line)) * values[f, j]
        if lowest(points) >= level:
            continue
        store(work.row, (0,), points)
        for n in range(N):
            s = _where[line * N + n]
            if work.row[0, n] < level and s < end:
                end = s
                begin = _where[line * N + n - 1] if line * N + n > 0 else 0.0
                for j in range(N):
                    if begin < _tau[j] < s:
                        begin = _tau[j]
    if end < 2.0:
        note(work, f, candidate, begin, end, kind, limit)


@inner
def gap_at(body, tables, laws, state, work, i, f, h, s):
    """Gap [m] and its rate [m/s] of a free foot at scaled time s."""
    u, w = leg_at(body, tables, state, work, i, 0, h, s)
    if work.filmed[i] != 0:
        w += polynomial_at(work.film, f, s) / body.mass[i]
    return u + body.gap[i], w


@rare
def lowest_between(body, tables, laws, state, work, i, f, j, h):
    """Gap and scaled time of the lowest point of a flight between nodes j - 1 and j, where its rate changes sign."""
    low, high = _tau[j - 1], _tau[j]
    s = 0.5 * (low + high)
    gap = 0.0
    for _ in range(60):
        gap, rate = gap_at(body, tables, laws, state, work, i, f, h, s)
        if rate < 0.0:
            low = s
        else:
            high = s
        if high - low < 1e-6 * (_tau[j] - _tau[j - 1]):
            break
        s = 0.5 * (low + high)
    return gap, s


@inner
def touches(body, tables, laws, state, work, i, f, h, limit):
    """Note where a free foot first reaches the ground."""
    real = state.real
    gaps, rates = work.gap, work.rate
    fresh = state.order[f] != 0
    if not fresh and gaps[f, 0] <= real[a.EPS_GAP] and rates[f, 0] <= real[a.EPS_SPEED]:
        note(work, f, FIRST, 0.0, 0.0, TOUCH, 1.0)
        return
    for j in range(1, N):
        if _tau[j - 1] >= limit:
            return
        if gaps[f, j] < -real[a.EPS_GAP]:
            note(work, f, FIRST, _tau[j - 1], _tau[j], TOUCH, limit)
            return
        if rates[f, j - 1] < 0.0 < rates[f, j]:
            # the parabola of the two rates tells how far below its ends the flight may dip
            width = (_tau[j] - _tau[j - 1]) * h
            drop = 0.5 * width * rates[f, j - 1] ** 2 / (rates[f, j] - rates[f, j - 1])
            if min(gaps[f, j - 1], gaps[f, j]) < 2.0 * drop:
                least, s = lowest_between(body, tables, laws, state, work, i, f, j, h)
                if least < -real[a.EPS_GAP]:
                    note(work, f, FIRST, _tau[j - 1], s, TOUCH, limit)
                    return


@inner
def stops(state, work, i, f, limit):
    """Note where a sliding foot first comes to a stop."""
    sense = state.sense[f]
    if sense == 0.0:
        return
    if state.order[f] == 0 and sense * work.w[i, 1, 0] <= 0.0:
        note(work, f, SECOND, 0.0, 0.0, STOP, 1.0)
        return
    for j in range(1, N):
        if _tau[j - 1] >= limit:
            return
        if sense * work.w[i, 1, j] < 0.0:
            note(work, f, SECOND, _tau[j - 1], _tau[j], STOP, limit)
            return


@inner
def brackets(body, tables, laws, state, work, h, limit):
    """What can be the first event of every foot, as brackets in work.when."""
    level = -state.real[a.EPS_FORCE]
    for f in range(body.leg.shape[0]):
        i = body.leg[f]
        for candidate in range(CANDIDATES):
            work.when[f, candidate, KIND] = 0.0
        contact = state.contact[f]
        if contact == AIR:
            touches(body, tables, laws, state, work, i, f, h, limit)
            continue
        falls_below(work.margin, f, level, limit, FIRST, PULL_OFF, work)
        if contact == SLIPPING:
            stops(state, work, i, f, limit)
        elif contact == STUCK:
            bounds(laws, work, f)
            bound, along = load(work.bound, (f,)), load(work.along, (f,))
            store(work.bound, (f,), bound - along)
            store(work.along, (f,), bound + along)
            falls_below(work.bound, f, level, limit, SECOND, SLIP_UP, work)
            falls_below(work.along, f, level, limit, THIRD, SLIP_DOWN, work)


@rare
def refine(body, tables, laws, state, work, f, candidate, h):
    """Scaled time of the event in a candidate's bracket, to rounding."""
    i = body.leg[f]
    kind = work.when[f, candidate, KIND]
    low, high = work.when[f, candidate, LOW], work.when[f, candidate, HIGH]
    level = -state.real[a.EPS_FORCE]
    if high <= 0.0:
        return 0.0
    sign = state.sense[f]
    if low == 0.0 and state.order[f] != 0 and kind in (TOUCH, STOP):
        low = high  # it starts from an exact zero: find a place after it where nothing has happened yet
        for _ in range(50):
            low *= 0.5
            if kind == TOUCH:
                value, _rate = gap_at(body, tables, laws, state, work, i, f, h, low)
            else:
                value = sign * leg_at(body, tables, state, work, i, 1, h, low)[1]
            if value > 0.0:
                break
            high = low
    s = 0.5 * (low + high)
    below, above = 0.0, 0.0  # values at the ends once known, for the secant
    known = 0
    for n in range(100):
        slope = 0.0
        if kind == TOUCH:
            value, slope = gap_at(body, tables, laws, state, work, i, f, h, s)
            slope *= h
        elif kind == STOP:
            value = sign * leg_at(body, tables, state, work, i, 1, h, s)[1]
        elif kind == PULL_OFF:
            value = polynomial_at(work.margin, f, s) - level
        elif kind == SLIP_UP:
            value = polynomial_at(work.bound, f, s) - level
        else:
            value = polynomial_at(work.along, f, s) - level
        if value >= 0.0:
            low, below = s, value
            known |= 1
        else:
            high, above = s, value
            known |= 2
        if high - low <= 4e-16 * high or value == 0.0:
            break
        if slope < 0.0:
            following = s - value / slope
        elif known == 3:
            following = low + (high - low) * below / (below - above)
        else:
            following = 0.5 * (low + high)
        if abs(following - s) < 1e-16 * s:
            break
        if not low < following < high or n % 6 == 5:
            following = 0.5 * (low + high)
        s = following
    return s


@inner
def nothing_along(state, work, f, s):
    """Whether no force along the ground is there to slip by: the bound passes 0 because the foot is about to leave."""
    along = 0.5 * (polynomial_at(work.along, f, s) - polynomial_at(work.bound, f, s))
    return abs(along) <= state.real[a.EPS_FORCE]


@rare
def first_of_foot(body, tables, laws, state, work, f, h, limit):
    """Put the earliest of a foot's candidates, at its own time, first."""
    best = 2.0
    kind = 0.0
    for candidate in range(CANDIDATES):
        its = work.when[f, candidate, KIND]
        if its == 0.0 or work.when[f, candidate, LOW] > min(best, limit):
            continue
        s = refine(body, tables, laws, state, work, f, candidate, h)
        if s > limit or s >= best or (its in (SLIP_UP, SLIP_DOWN) and nothing_along(state, work, f, s)):
            continue
        best = s
        kind = its
    work.when[f, FIRST, LOW] = best
    work.when[f, FIRST, HIGH] = best
    work.when[f, FIRST, KIND] = kind
    return best


@rare
def first_events(body, tables, laws, state, work, h, limit):
    """Scaled time of the first events (2: none); work.when[f, FIRST] of every foot with one is its own."""
    first = 2.0
    for f in range(body.leg.shape[0]):
        first = min(first, first_of_foot(body, tables, laws, state, work, f, h, limit))
    return first
