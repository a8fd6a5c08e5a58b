"""What happens to a foot of a walker at the ground: blow, hold, pull-off, slip and stick (compiled).

A foot is a point mass between springs, so a blow changes its own velocity and nothing else: the mass-weighted map is
exact, and feet that touch at the same moment do not know of each other.
"""

from __future__ import annotations

from tarsus.core import hooks
from tarsus.core.arrays import BOUNCE, CAPTURE, CONTACT_AT_START, RELEASE, REST
from tarsus.core.contact import log
from tarsus.core.hooks import HAS_FORCE, HAS_LATCH, HAS_MOMENTUM, PULL_AS_PRINTED
from tarsus.core.jit import rare
from tarsus.core.landing import landing, rest_time
from tarsus.core.signals import value
from tarsus.core.walk import arrays as a
from tarsus.core.walk.scan import PULL_OFF, STOP, TOUCH
from tarsus.core.walk.states import AIR, BEGIN_SLIP, BEGIN_STICK, SLIPPING, STUCK


@rare
def structure_force(body, signals, state, i, d, u, nb, t):
    """Force of the structure on a foot held at ``u`` [N]: upward (its pull), or along the way."""
    force = 0.0
    for b in range(nb):
        r = body.hip[i, d, b]
        if r != 0.0:
            force += r * (body.stiffness[i, d] * state.body[0, b] + body.damping[i, d] * state.body[1, b])
    force -= body.stiffness[i, d] * u
    if d == 0:
        force -= body.weight[i]
    for n in range(body.first[i], body.first[i + 1]):
        force += body.gain[n, d] * value(
            signals.first, signals.start, signals.end, signals.coef, signals.loop, signals.period, state.cursor, body.drive[n], t
        )  # fmt: skip
    return force


@rare
def smooth_at_contact(laws, signals, state, f, t):
    """Smooth force [N] on a foot on the ground."""
    if not laws.flags[f] & HAS_FORCE:
        return 0.0
    volts = 0.0
    if laws.volts[f] >= 0:
        volts = value(
            signals.first, signals.start, signals.end, signals.coef, signals.loop, signals.period, state.cursor, laws.volts[f], t
        )  # fmt: skip
    return hooks.force(laws.parameters, laws.pointer, f, 0.0, 0.0, volts, t)


@rare
def film_momentum(laws, f, gap):
    if not laws.flags[f] & HAS_MOMENTUM:
        return 0.0
    return hooks.momentum(laws.parameters, laws.pointer, f, gap)


@rare
def hold(body, laws, state, i, f, t):
    """Put a foot on the ground; what it has along the ground stays."""
    state.foot[i, 0, 0] = -body.gap[i]
    state.foot[i, 0, 1] = 0.0
    state.since[f] = t
    state.apex[f, 0] = 0.0
    state.apex[f, 1] = t
    state.order[f] = 0
    along = state.foot[i, 1, 1]
    if hooks.friction(laws.parameters, laws.pointer, f, 1.0, 1.0) == 0.0:
        state.contact[f] = SLIPPING
        state.sense[f] = 0.0
    elif along == 0.0:
        state.contact[f] = STUCK
        state.sense[f] = 0.0
    else:
        state.contact[f] = SLIPPING
        state.sense[f] = 1.0 if along > 0.0 else -1.0


@rare
def rub(body, laws, state, i, f, change):
    """Coulomb friction of a blow that changed the normal velocity by ``change``: it brakes the motion along the ground
    by mu times as much at most. What adhesion adds is a force, which brakes nothing in no time. Returns the kinetic energy
    that takes [J]."""
    before = state.foot[i, 1, 1]
    most = hooks.friction(laws.parameters, laws.pointer, f, change, 0.0)
    after = max(before - most, 0.0) if before > 0.0 else min(before + most, 0.0)
    state.foot[i, 1, 1] = after
    return 0.5 * body.mass[i] * (before * before - after * after)


@rare
def touch(body, signals, laws, state, events, f, nb):
    """A foot is at the ground: bounce, capture, rest, or it lies there already."""
    i, t = body.leg[f], state.real[a.TIME]
    count, mass = state.count, body.mass[i]
    film = film_momentum(laws, f, 0.0)
    gap = state.foot[i, 0, 0] + body.gap[i]
    speed = -(state.foot[i, 0, 1] + film_momentum(laws, f, gap) / mass)
    state.foot[i, 0, 0] = -body.gap[i]
    own = structure_force(body, signals, state, i, 0, -body.gap[i], nb, t)
    pull = own + smooth_at_contact(laws, signals, state, f, t)
    latch = laws.flags[f] & HAS_LATCH != 0
    strength = hooks.strength(laws.parameters, laws.pointer, f, 0.0) if latch else 0.0
    if speed <= state.real[a.EPS_SPEED]:
        if pull <= strength:
            log(events, count, t, f, CONTACT_AT_START, 0.0, 0.0, pull, strength, 0.0, 0.0, state.apex)
            hold(body, laws, state, i, f, t)
        else:
            state.foot[i, 0, 1] = max(-speed, 0.0) - film / mass
            state.order[f] = 1
        return
    after = hooks.rebound(laws.parameters, laws.pointer, f, speed)
    lost = 0.5 * mass * (speed * speed - after * after)
    kept = 0.5 * mass * after * after
    printed = 0.0
    if laws.flags[f] & PULL_AS_PRINTED:
        printed = own - 2.0 * body.stiffness[i, 0] * body.gap[i] + body.damping[i, 0] * after
    kind = landing(laws, f, after, pull, strength, printed, 1.0 / mass, state.real[a.REST_HEIGHT])
    if kind != BOUNCE:
        over = rest_time(t, speed, after, pull, 1.0 / mass) if kind == REST else t
        taken = kept if latch and kind == CAPTURE else 0.0
        lost += rub(body, laws, state, i, f, speed)
        log(events, count, over, f, kind, speed, 0.0, pull, strength, lost + kept, taken, state.apex)
        hold(body, laws, state, i, f, t)
        return
    lost += rub(body, laws, state, i, f, speed + after)
    log(events, count, t, f, BOUNCE, speed, after, pull, strength, lost, 0.0, state.apex)
    state.foot[i, 0, 1] = after - film / mass
    state.order[f] = 1
    state.apex[f, 0] = 0.0
    state.apex[f, 1] = t


@rare
def happen(body, signals, laws, state, work, events, f, kind, nb):
    """Change the state of foot ``f`` by an event of that kind at the present time."""
    i, t = body.leg[f], state.real[a.TIME]
    if kind == TOUCH:
        touch(body, signals, laws, state, events, f, nb)
        return
    strength = 0.0
    if laws.flags[f] & HAS_LATCH:
        strength = hooks.strength(laws.parameters, laws.pointer, f, t - state.since[f])
    pull = structure_force(body, signals, state, i, 0, -body.gap[i], nb, t)
    pull += smooth_at_contact(laws, signals, state, f, t)
    if kind == PULL_OFF:
        log(events, state.count, t, f, RELEASE, 0.0, 0.0, pull, strength, 0.0, 0.0, state.apex)
        state.contact[f] = AIR
        state.foot[i, 0, 1] = -film_momentum(laws, f, 0.0) / body.mass[i]
        state.order[f] = 1
        state.apex[f, 0] = 0.0
        state.apex[f, 1] = t
        return
    along = structure_force(body, signals, state, i, 1, state.foot[i, 1, 0], nb, t)
    bound = hooks.friction(laws.parameters, laws.pointer, f, strength - pull, strength)
    state.foot[i, 1, 1] = 0.0
    if kind == STOP and abs(along) <= bound + state.real[a.EPS_FORCE]:
        log(events, state.count, t, f, BEGIN_STICK, 0.0, 0.0, along, bound, 0.0, 0.0, state.apex)
        state.contact[f] = STUCK
        state.sense[f] = 0.0
        state.order[f] = 0
        return
    log(events, state.count, t, f, BEGIN_SLIP, 0.0, 0.0, along, bound, 0.0, 0.0, state.apex)
    state.contact[f] = SLIPPING
    state.sense[f] = 1.0 if along > 0.0 else -1.0
    state.order[f] = 2
