"""Whether a foot that lands bounces or is held: the one decision of both engines (compiled).

A foot's flags name its rule; without one it is captured unless the pull exceeds the strength of its contact.
"""

from __future__ import annotations

from tarsus.core import hooks
from tarsus.core.arrays import (
    BOUNCE,
    CAPTURE,
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
    EVENTS,
    REST,
)
from tarsus.core.hooks import HAS_LATCH, PULL_AS_PRINTED, RESTITUTES_FIRST
from tarsus.core.jit import rare


@rare
def landing(laws, foot, after, pull, strength, printed, mobility, height):
    """BOUNCE, CAPTURE or REST of a foot that would depart at ``after`` [m/s].

    pull, strength [N]: the structure's pull on the foot stopped there and what the new contact holds; printed [N]: pull
    by (2.13) as printed, where that is the rule; mobility [1/kg] of the foot; height [m] below which a flight is none.
    """
    flags = laws.flags[foot]
    # the ground presses, and what is left of the flights is a geometric series below the resolution
    low = pull < 0.0 and after * after < -2.0 * pull * mobility * height
    if flags & RESTITUTES_FIRST:
        held = pull <= strength and hooks.excess(laws.parameters, laws.pointer, foot, after) <= 0.0
    elif flags & PULL_AS_PRINTED:
        held = printed <= max(strength, 0.0)
    else:
        held = flags & HAS_LATCH != 0 and pull <= strength
        low = low and flags & HAS_LATCH == 0
    if held or (low and after == 0.0):
        return CAPTURE
    return REST if low else BOUNCE


@rare
def rest_time(t, speed, after, pull, mobility):
    """Time [s] at which a foot that comes to rest has made its flights, a geometric series under its pull [N]."""
    ratio = min(after / speed, 0.999999) if speed > 0.0 else 0.0
    return t - 2.0 * after / (pull * mobility) / (1.0 - ratio)


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
