"""What happens at the ground: impact, capture, release, rest (compiled)."""

from __future__ import annotations

import math

from tarsus.core import hooks
from tarsus.core.arrays import (
    BOUNCE,
    CAPTURE,
    CONTACT_AT_START,
    E_ADHESION,
    E_AFTER,
    E_APEX,
    E_APEX_TIME,
    E_BEFORE,
    E_ENERGY,
    E_FOOT,
    E_INTEGRAL,
    E_KIND,
    E_PULL,
    E_STRENGTH,
    E_TIME,
    EPS_GAP,
    EPS_SPEED,
    EVENTS,
    PENDING,
    PROBE,
    RELEASE,
    REST,
    REST_HEIGHT,
    TIME,
)  # fmt: skip
from tarsus.core.flow import dot
from tarsus.core.hooks import HAS_FORCE, HAS_LATCH, HAS_MOMENTUM, MAP_AS_IS, PULL_AS_PRINTED
from tarsus.core.jit import rare
from tarsus.core.landing import landing, rest_time
from tarsus.core.signals import value

DUE = -1  # order of a foot at the ground whose blow waits for another foot to be let go


@rare
def log(events, count, t, foot, kind, before, after, pull, strength, energy, adhesion, apex):
    n = count[EVENTS]
    events[n, E_TIME] = t
    events[n, E_FOOT] = foot
    events[n, E_KIND] = kind
    events[n, E_BEFORE] = before
    events[n, E_AFTER] = after
    events[n, E_PULL] = pull
    events[n, E_STRENGTH] = strength
    events[n, E_ENERGY] = energy
    events[n, E_ADHESION] = adhesion
    events[n, E_APEX] = apex[foot, 0]
    events[n, E_APEX_TIME] = apex[foot, 1]
    events[n, E_INTEGRAL] = apex[foot, 2]
    count[EVENTS] = n + 1


@rare
def film_momenta(modes, laws, q, m, mask, size, w, gaps):
    """Gaps [m] of the free feet; y = w + sum beta_i P_i is added into w in place (flowing to modal state)."""
    ni = modes.feed.shape[2]
    for i in range(m):
        gaps[i] = 0.0
        if not mask >> i & 1:
            gaps[i] = dot(modes.outputs, q, i, size, w) + modes.feed[q, i, ni - 1]
    for i in range(m):
        if not mask >> i & 1 and laws.flags[i] & HAS_MOMENTUM:
            p = hooks.momentum(laws.parameters, laws.pointer, i, gaps[i])
            for r in range(size):
                w[r] += modes.beta[q, i, r] * p


@rare
def remove_momenta(modes, laws, q, m, mask, size, y, gaps):
    """Modal state back to the flowing state, in place."""
    for i in range(m):
        if not mask >> i & 1 and laws.flags[i] & HAS_MOMENTUM:
            p = hooks.momentum(laws.parameters, laws.pointer, i, gaps[i])
            for r in range(size):
                y[r] -= modes.beta[q, i, r] * p


@rare
def foot_volts(signals, cursor, laws, i, t):
    c = laws.volts[i]
    if c < 0:
        return 0.0
    return value(
        signals.first, signals.start, signals.end, signals.coef, signals.loop, signals.period, cursor, c, t
    )


@rare
def robot_pull(rows, feed, signals, cursor, q, m, nd, size, y, foot, t):
    """Pull on a foot at the ground by rows of the state and of the inputs, without the ground's own forces on it."""
    pull = dot(rows, q, foot, size, y) + feed[q, foot, 2 * m + nd]
    for d in range(nd):
        pull += feed[q, foot, 2 * m + d] * value(
            signals.first, signals.start, signals.end, signals.coef, signals.loop, signals.period, cursor, d, t
        )
    return pull


@rare
def held_pull(modes, laws, signals, cursor, q, m, nd, mask, size, y, gaps, foot, t, probe):
    """Structure's pull on free foot ``foot`` if it were stopped on the ground now, smooth force at contact included."""
    pull = robot_pull(modes.held, modes.held_feed, signals, cursor, q, m, nd, size, y, foot, t)
    if laws.flags[foot] & HAS_FORCE:
        pull += hooks.force(
            laws.parameters, laws.pointer, foot, 0.0, 0.0, foot_volts(signals, cursor, laws, foot, t), t
        )
    for k in range(m):
        factor = modes.held_feed[q, foot, m + k]
        if factor == 0.0 or k == foot or mask >> k & 1:
            continue
        rate = dot(modes.outputs, q, m + k, size, y)
        if laws.flags[k] & HAS_MOMENTUM:
            slope = hooks.momentum(laws.parameters, laws.pointer, k, gaps[k] + probe)
            slope -= hooks.momentum(laws.parameters, laws.pointer, k, gaps[k] - probe)
            pull += factor * rate * slope / (2.0 * probe)
        if laws.flags[k] & HAS_FORCE:
            volts = foot_volts(signals, cursor, laws, k, t)
            pull += factor * hooks.force(laws.parameters, laws.pointer, k, gaps[k], rate, volts, t)
    return pull


@rare
def leave_mode(modes, q, size, y, physical, count, mask):
    """Keep the physical state and ask for the contact mode ``mask``."""
    for r in range(modes.to_physical.shape[1]):
        physical[r] = modes.offset[q, r] + dot(modes.to_physical, q, r, size, y)
    count[PENDING] = mask


@rare
def enter_mode(modes, laws, q, m, physical, w, scratch, gaps):
    """Project the physical state on contact mode q (mass-weighted: new contacts are plastic)."""
    size = 2 * modes.nb[q]
    for r in range(modes.to_physical.shape[1]):
        scratch[r] = physical[r] - modes.offset[q, r]
    for r in range(size):
        s = 0.0
        for c in range(modes.to_physical.shape[1]):
            s += modes.from_physical[q, r, c] * scratch[c]
        w[r] = s
    ni = modes.feed.shape[2]
    for i in range(m):
        gaps[i] = 0.0
        if not modes.mask[q] >> i & 1:
            gaps[i] = dot(modes.outputs, q, i, size, w) + modes.feed[q, i, ni - 1]
    remove_momenta(modes, laws, q, m, modes.mask[q], size, w, gaps)


@rare
def follow(modes, q, foot, size, w, speed, after, as_is):
    """How the structure follows a blow beyond the mass-weighted map: the velocity b across the normal becomes
    alpha b + beta a, a = speed / sqrt(mobility). As it is: alpha = 1, beta = (1 + e) skew; passive: see
    laws.impact_map.Directed. Returns the kinetic energy [J] that this takes.
    """
    skew = modes.skew[q, foot]
    if skew == 0.0 or speed == 0.0:
        return 0.0
    e = after / speed
    alpha = 1.0
    beta = (1.0 + e) * skew
    if not as_is:
        theta = hooks.passive_angle(e, skew)
        alpha = math.cos(theta)
        beta = math.sqrt(max(1.0 - e * e, 0.0)) * math.sin(theta)
    before = dot(modes.side_rate, q, foot, size, w)
    then = alpha * before + beta * speed / math.sqrt(modes.mobility[q, foot])
    for r in range(size):
        w[r] += modes.side[q, foot, r] * (then - before)
    return 0.5 * (before * before - then * then)


@rare
def impact(modes, laws, signals, state, events, q, m, nd, size, foot, gaps, minimum):
    """Foot ``foot`` is at the ground and approaches: bounce, capture or rest. False if it does not approach."""
    count, real, w = state.count, state.real, state.w
    t = real[TIME]
    mask = modes.mask[q]
    film_momenta(modes, laws, q, m, mask, size, w, gaps)
    gaps[foot] = 0.0
    rate = dot(modes.outputs, q, m + foot, size, w)
    speed = max(-rate, 0.0)
    if speed <= minimum:
        remove_momenta(modes, laws, q, m, mask, size, w, gaps)
        return False
    pull = held_pull(modes, laws, signals, state.cursor, q, m, nd, mask, size, w, gaps, foot, t, real[PROBE])
    # A rocking body hands ever smaller blows from foot to foot: below the rest height all of them stay down.
    settled = pull < 0.0 and speed * speed < -2.0 * pull * modes.mobility[q, foot] * real[REST_HEIGHT]
    for k in range(m):
        if not settled and mask >> k & 1 and modes.reaction[q, foot, k] < -1e-12:
            # the blow would pull held foot k off: no finite adhesion carries an impulse
            log(events, count, t, k, RELEASE, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, state.apex)
            state.order[k] = 2
            state.order[foot] = DUE
            leave_mode(modes, q, size, w, state.physical, count, mask & ~(1 << k))
            return True
    energy = 0.5 / modes.mobility[q, foot]
    after = hooks.rebound(laws.parameters, laws.pointer, foot, speed)
    lost = energy * (speed * speed - after * after)
    kept = energy * after * after
    latch = laws.flags[foot] & HAS_LATCH
    strength = hooks.strength(laws.parameters, laws.pointer, foot, 0.0) if latch else 0.0
    printed = 0.0
    if laws.flags[foot] & PULL_AS_PRINTED:
        printed = robot_pull(modes.printed, modes.printed_feed, signals, state.cursor, q, m, nd, size, w, foot, t)
        printed += modes.printed_damping[q, foot] * (rate + after)
    kind = landing(laws, foot, after, pull, strength, printed, modes.mobility[q, foot], real[REST_HEIGHT])
    if kind != BOUNCE:
        over = rest_time(t, speed, after, pull, modes.mobility[q, foot]) if kind == REST else t
        taken = kept if latch and kind == CAPTURE else 0.0
        log(events, count, over, foot, kind, speed, 0.0, pull, strength, lost + kept, taken, state.apex)
        hold(modes, state, q, size, mask, foot, t)
        return True
    lost += follow(modes, q, foot, size, w, speed, after, laws.flags[foot] & MAP_AS_IS != 0)
    log(events, count, t, foot, BOUNCE, speed, after, pull, strength, lost, 0.0, state.apex)
    for r in range(size):
        w[r] += modes.jump[q, foot, r] * (after - rate)
    remove_momenta(modes, laws, q, m, mask, size, w, gaps)
    state.order[foot] = 1 if after > 0.0 else 2
    state.apex[foot, 0] = 0.0
    state.apex[foot, 1] = t
    return True


@rare
def hold(modes, state, q, size, mask, foot, t):
    """Put ``foot`` on the ground; ``state.w`` holds the modal state (film momenta added)."""
    state.since[foot] = t
    state.order[foot] = 0
    state.apex[foot, 0] = 0.0
    state.apex[foot, 1] = t
    leave_mode(modes, q, size, state.w, state.physical, state.count, mask | (1 << foot))


@rare
def release(modes, laws, state, events, q, m, size, foot, gaps):
    """A held foot's pull has outgrown the strength of its contact."""
    count, w, t = state.count, state.w, state.real[TIME]
    mask = modes.mask[q]
    age = t - state.since[foot]
    strength = hooks.strength(laws.parameters, laws.pointer, foot, age) if laws.flags[foot] & HAS_LATCH else 0.0
    log(events, count, t, foot, RELEASE, 0.0, 0.0, strength, strength, 0.0, 0.0, state.apex)
    film_momenta(modes, laws, q, m, mask, size, w, gaps)
    state.order[foot] = 2
    state.apex[foot, 0] = 0.0
    state.apex[foot, 1] = t
    leave_mode(modes, q, size, w, state.physical, count, mask & ~(1 << foot))


@rare
def reorder(modes, laws, state, q, m, size, gaps):
    """How each foot that has just left the ground departs, after blows on the others changed its rate: rising
    (order 1), from rest (order 2), or coming back at once (0: an impact is due)."""
    mask = modes.mask[q]
    film_momenta(modes, laws, q, m, mask, size, state.w, gaps)
    for i in range(m):
        if mask >> i & 1 or state.order[i] <= 0:
            continue
        rate = dot(modes.outputs, q, m + i, size, state.w)
        if rate > state.real[EPS_SPEED]:
            state.order[i] = 1
        elif rate < -state.real[EPS_SPEED]:
            state.order[i] = 0
        else:
            state.order[i] = 2
    remove_momenta(modes, laws, q, m, mask, size, state.w, gaps)


@rare
def settle(modes, laws, signals, state, events, q, m, nd, size, gaps):
    """Contacts that are due at this very moment: feet on the ground that approach, or rest there and are held."""
    count, real, w = state.count, state.real, state.w
    mask = modes.mask[q]
    ni = modes.feed.shape[2]
    for i in range(m):
        if mask >> i & 1 or state.order[i] > 0:
            continue
        gap = dot(modes.outputs, q, i, size, w) + modes.feed[q, i, ni - 1]
        if gap > real[EPS_GAP] and state.order[i] != DUE:
            continue
        state.order[i] = 0
        if impact(modes, laws, signals, state, events, q, m, nd, size, i, gaps, real[EPS_SPEED]):
            return True
        film_momenta(modes, laws, q, m, mask, size, w, gaps)
        rate = dot(modes.outputs, q, m + i, size, w)
        t = real[TIME]
        if rate <= real[EPS_SPEED]:
            pull = held_pull(modes, laws, signals, state.cursor, q, m, nd, mask, size, w, gaps, i, t, real[PROBE])
            latch = laws.flags[i] & HAS_LATCH
            strength = hooks.strength(laws.parameters, laws.pointer, i, 0.0) if latch else 0.0
            if pull <= strength:
                log(events, count, t, i, CONTACT_AT_START, 0.0, 0.0, pull, strength, 0.0, 0.0, state.apex)
                hold(modes, state, q, size, mask, i, t)
                return True
            state.order[i] = 2
        else:
            state.order[i] = 1
        remove_momenta(modes, laws, q, m, mask, size, w, gaps)
    return False


