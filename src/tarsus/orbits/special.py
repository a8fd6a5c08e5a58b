"""Where a branch changes its character: folds, period doublings, tori, grazing, the onset of sticking.

Between two neighbouring points a test function of the orbit changes its sign, or the sequence of events changes:

    fold            the branch turns back: the parameter's share of the tangent is 0, a multiplier is +1
    flip            det(dP/ds + 1) = 0: a multiplier is -1, the period doubles
    neimark-sacker  a complex pair of multipliers has magnitude 1
    grazing         an impact appears or goes: its approach speed is 0
    sticking        a contact is held that was not, or bounces that accumulate to rest begin to
    capture         a landing is captured that bounced before, or the reverse
    simultaneous    events of different feet change their order
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from tarsus.base.events import CONTACT_BEGINS, IMPACTS
from tarsus.orbits.sequence import ACCUMULATED, kept_events

if TYPE_CHECKING:
    from tarsus.orbits.follow import Follower, Point
    from tarsus.orbits.orbit import Orbit

Floats = NDArray[np.float64]
Special = tuple[str, "Point", str]
"""Kind, where, and what happens in words."""

AT_ONE = 1e-3
"""A branch that turns back with no multiplier this near to 1 has a corner, as at a grazing, and no fold: multipliers
part from 1 with the root of the distance, which is known to `FINEST`."""
FINEST = 1e-12
"""Part of a step along the branch to which a change is located: a bisection ends where rounding decides."""
APART = 1e-5
"""Difference of impacts across a change, of the motion's speed and period, that is no continuous one: roots of `FINEST`
parts of a step are smaller."""
ALIKE = 0.65
"""Part of a change of impacts over a step that one half of it may have where the motion is the same: 0.5 over short
steps, 0.71 near a grazing, from which speeds rise as roots."""
JUMP = 1e-8
"""Distance in scaled unknowns of points on both sides of a change beyond which the motion jumps: a hundred times what
orbits close to."""


def between(follower: Follower, base: Point, now: Point, ahead: Point) -> Callable[..., Point | None]:
    """Points of a branch by their part of the step from one to another, sought from one near by and its part on, in
    planes across the tangent at a base."""
    level, way = float(base.tangent @ now.place), ahead.place - now.place

    def at(part: float, near: Point = now, there: float = 0.0) -> Point | None:
        if part in (0.0, 1.0):
            return ahead if part else now
        guess = near.place + (part - there) * way
        return follower.solve(guess, base.tangent, level + part * float(base.tangent @ way), base)

    return at


def crossings(follower: Follower, now: Point, ahead: Point) -> list[Special]:
    """What happens to the stability on the way between points with the same events, in order."""
    at, found = between(follower, now, now, ahead), list[tuple[float, Special]]()
    for kind, test, words in _TESTS:
        one, other = test(now), test(ahead)
        if np.isfinite(one) and np.isfinite(other) and one * other < 0.0:
            part, point = _crossing(at, test, ahead)
            if kind != "fold" or np.abs(point.orbit.multipliers - 1.0).min() < AT_ONE:
                found.append((part, (kind, point, words(now, ahead))))
    return [one for _, one in sorted(found, key=lambda pair: pair[0])]


def _crossing(at: Callable[[float], Point | None], test: Callable[[Point], float], ahead: Point) -> tuple[float, Point]:
    """Where a test function is zero: part of the step, and the point."""
    seen: dict[float, Point] = {}

    def value(part: float) -> float:
        point = at(part)
        if point is None:
            raise _Lost
        seen[part] = point
        return test(point)

    try:
        found: Any = brentq(value, 0.0, 1.0, xtol=FINEST)
    except _Lost:
        return 1.0, ahead
    part = float(found)
    return part, seen.get(part) or at(part) or ahead


class _Lost(Exception):
    """No orbit was found between two that were."""


@dataclass(frozen=True)
class Change:
    """Where a sequence of events ends: the last point that has it, and the first with another one, or with the same of
    another motion."""

    here: Point
    there: Point

    @property
    def jumps(self) -> bool:
        """Whether the motion itself is another one beyond, and not only its events."""
        return bool(np.abs(self.there.place - self.here.place).max() > JUMP)

    @property
    def what(self) -> tuple[str, str]:
        """Its kind, and in words."""
        return (why_lost(self.here) if self.jumps else None) or _difference(self.here, self.there)


def change(follower: Follower, base: Point, now: Point, ahead: Point) -> Change:
    """A change of the events between two points of other events, by bisection across the tangent at a base."""
    at, low, high, here, there = between(follower, base, now, ahead), 0.0, 1.0, now, ahead
    step = float(np.linalg.norm(ahead.place - now.place))
    while (high - low) * step > FINEST and low < (middle := 0.5 * (low + high)) < high:
        point = at(middle, here, low)
        if point is not None and point.sequence == now.sequence:
            low, here = middle, point
        else:
            high, there = middle, point or there
    return Change(here, there)


def change_seen(follower: Follower, base: Point, now: Point, ahead: Point) -> Change | None:
    """A change between two points, as the events there and half way say; None where they say nothing.

    Of the same events, what impacts change by is in both halves alike, but where another motion begins: there it is in
    one half, and in one half of that.
    """
    if now.sequence != ahead.sequence:
        return change(follower, base, now, ahead)
    at, low, high, here, there = between(follower, base, now, ahead), 0.0, 1.0, now, ahead
    step = float(np.linalg.norm(ahead.place - now.place))
    while (high - low) * step > FINEST and low < (middle := 0.5 * (low + high)) < high:
        point = at(middle, here, low)
        if point is None:
            return None
        if point.sequence != now.sequence:
            return change(follower, base, here, point)
        first, second = halves(here.orbit, point.orbit, there.orbit)
        worst = uneven(first, second)
        if worst is None:
            return None
        low, high, here, there = (
            (low, middle, here, point) if first[worst] > second[worst] else (middle, high, point, there)
        )
    return Change(here, there)


def halves(one: Orbit, middle: Orbit, other: Orbit) -> tuple[Floats, Floats]:
    """What times and speeds of impacts change by from one orbit to a second and a third of the same events, as parts of
    the motion's period and speed."""
    return np.abs(middle.marks - one.marks), np.abs(other.marks - middle.marks)


def uneven(first: Floats, second: Floats) -> int | None:
    """Number of what changes most over one of two halves and hardly over the other; None without."""
    whole = first + second
    most = np.where(whole > APART, np.maximum(first, second) - ALIKE * whole, 0.0)
    return int(np.argmax(most)) if len(most) and most.max() > 0.0 else None


def apart(one: Orbit, other: Orbit) -> float:
    """How far impacts of two orbits are apart, in speed and time as parts of the motion's speed and period, wherever
    their sections are; infinite where they do not have the same events. How fast bounces that accumulate come to rest
    says how many were resolved, and nothing of the motion."""
    (a, b), k = ([found.events[kept_events(found.events)] for found in (one, other)]), one.multiple
    if k != other.multiple or len(a) != len(b):
        return np.inf
    speed, period, best = one.map.speed(one.state), one.period, np.inf
    first = np.argsort(a["time"], kind="stable")
    for j in range(k):
        later = np.mod(b["time"] + other.start - one.start + j * one.map.period + EARLY * period, period)
        order = np.argsort(later, kind="stable")
        if [(e["foot"], e["kind"]) for e in a[first]] != [(e["foot"], e["kind"]) for e in b[order]]:
            continue
        faster = np.abs(b["speed_before"][order] - a["speed_before"][first]) / speed
        faster[np.isin(a["kind"][first], ACCUMULATED)] = 0.0
        late = np.abs(later[order] - a["time"][first] - EARLY * period).max(initial=0.0) / period
        best = min(best, max(float(faster.max(initial=0.0)), float(late)))
    return best


EARLY = 1e-3
"""Part of a period by which another orbit's events may be earlier than one's section and still be those behind it: an
event so close to a section moves that."""


def _difference(before: Point, after: Point) -> tuple[str, str]:
    """What a change of the sequence is, and in words."""
    gone, new = Counter(before.sequence), Counter(after.sequence)
    if before.sequence == after.sequence:
        return "grazing", "an impact goes as another comes"
    if gone == new:
        return "simultaneous", "events of different feet change their order"
    hits = [sum(n for (_, kind), n in counts.items() if kind in IMPACTS) for counts in (gone, new)]
    if hits[0] != hits[1] and _slowest(after if hits[1] > hits[0] else before) < GRAZING_SPEED:
        return "grazing", "an impact appears" if hits[1] > hits[0] else "an impact goes"
    held = [sum(n for (_, kind), n in counts.items() if kind in CONTACT_BEGINS) for counts in (gone, new)]
    if held[0] != held[1]:
        return "sticking", "a contact begins to be held" if held[1] > held[0] else "a held contact ends"
    if hits[0] != hits[1]:
        return ("capture", f"a foot stays on the ground after one impact {'more' if hits[1] > hits[0] else 'less'}")
    return "events", "a contact ends or slides otherwise than before"


def why_lost(point: Point) -> tuple[str, str] | None:
    """Kind and words of what ends a branch at a point; None where nothing is seen.

    An orbit grazes where a foot in flight comes as near to the ground, or lands as slowly, as rounding resolves.
    """
    orbit = point.orbit
    if _slowest(point) < GRAZING_SPEED:
        return "grazing", "an impact's approach speed is 0"
    if _clearance(point) < GRAZES * orbit.map.plan.length:
        return "grazing", "a foot comes down to the ground without an impact"
    return None


GRAZES = 1e-6
"""Clearance, of the plan's length, that counts as touching where a branch ends: its last steps are a millionth of that,
and clearance falls in proportion."""
GRAZING_SPEED = GRAZES**0.5
"""The same of approach speeds, of the motion's largest speed: they fall with the root of the clearance."""
LOOKS = 2048
"""Times in a period at which the gap is looked at before its minima are refined."""


def _slowest(point: Point) -> float:
    """Least approach speed of an impact, as part of the motion's speed; infinite without one."""
    orbit = point.orbit
    speeds = orbit.events["speed_before"][np.isin(orbit.events["kind"], IMPACTS)]
    return float(speeds.min(initial=np.inf)) / orbit.map.speed(orbit.state)


def _clearance(point: Point) -> float:
    """Least gap [m] of a foot between events, away from where it lands and departs."""
    orbit = point.orbit
    times, least = orbit.start + orbit.period * np.linspace(0.0, 1.0, LOOKS), np.inf
    for _ in range(4):  # each look is a thousand times closer than the one before
        found = orbit.map.window(orbit.state, times).states
        inner = (found.gap[:, 1:-1] <= found.gap[:, :-2]) & (found.gap[:, 1:-1] <= found.gap[:, 2:])
        inner &= ~(found.held[:, 1:-1] | found.held[:, :-2] | found.held[:, 2:])
        inner &= (found.rate[:, :-2] < 0.0) & (found.rate[:, 2:] > 0.0)
        if not inner.any():  # nothing comes down, or what is left of the gap is rounding
            break
        gaps = np.where(inner, found.gap[:, 1:-1], np.inf)
        foot, where = np.unravel_index(int(np.argmin(gaps)), gaps.shape)
        least = float(gaps[foot, where])
        times = np.linspace(times[where], times[where + 2], LOOKS)
    return least


def _flip(point: Point) -> float:
    return float(np.prod(1.0 + point.orbit.multipliers).real)


def _fold(point: Point) -> float:
    return float(point.tangent[-1])


def _torus(point: Point) -> float:
    pairs = [one for one in point.orbit.multipliers if one.imag > 1e-9 * abs(one)]
    return max(abs(one) for one in pairs) - 1.0 if pairs else np.nan


def _turned(now: Point, ahead: Point) -> str:
    return "the branch turns back: a multiplier is +1"


def _doubled(now: Point, ahead: Point) -> str:
    multiple = now.orbit.multiple
    return f"a multiplier is -1: period {2 * multiple} begins or ends"


def _circled(now: Point, ahead: Point) -> str:
    return "a pair of multipliers has magnitude 1: quasi-periodic motion begins or ends"


_TESTS = (("flip", _flip, _doubled), ("fold", _fold, _turned), ("neimark-sacker", _torus, _circled))
