"""Steps along a branch: as long as the tangent turns little and Newton's method finds the next point at once.

Where the events of the next point are others, or the same of another motion, what changes in between is located, and
the branch goes on from behind it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.orbits.special import Change, between, change, change_seen, halves, uneven

if TYPE_CHECKING:
    from tarsus.orbits.follow import Follower, Point
    from tarsus.orbits.orbit import Orbit

Floats = NDArray[np.float64]

FIRST, MOST, LEAST = 0.01, 0.04, 1e-11
"""First, longest and shortest step along a branch, in units of the range and of the motion's size: a figure needs some
thirty points; below the last a branch ends."""
SPACING = 2.5e-3
"""Distance along a branch over which its events are compared: a dot of a figure. Two changes that undo each other in
less may be passed over."""
CLOSER = 4
"""How often distances are halved at which events that change unevenly are compared, before points are sought there."""
TURN = 0.9
"""Least cosine between the tangents of neighbouring points: a sharper turn is taken in shorter steps."""
STRAIGHT = 0.99
"""Cosine between tangents above which the next step may be longer."""
EASY, HARD = 4, 7
"""Corrections up to which the next step may be longer, and above which it is shorter."""
GROWTH = 2.0
"""By how much a step may be longer than the one before."""
SHARP = 1e-6
"""Step below which steps are counted: so short ones lead to the end of a branch alone."""
CREEPS = 60
"""Steps below `SHARP` in a row after which a branch ends: halved and half grown again, 40 lead to `LEAST`."""
CLOSE = 1e-3
"""Part of the way to a change that its last point before leaves: the multipliers there are those before the change."""
AT_CHANGE = 1e-8
"""Step to a change below which no point is put before it."""
AFRESH = 1e-3
"""First step behind a change."""


@dataclass
class Stepper:
    """Goes along a branch from a point. step: the next one to try; change: the next change of events, where it is
    known; short: steps below `SHARP` in a row."""

    follower: Follower
    now: Point
    step: float = FIRST
    change: Change | None = None
    short: int = 0

    def __post_init__(self) -> None:
        self.go(self.now)

    def go(self, ahead: Point) -> None:
        """On to a point; an event close to the section moves that."""
        self.now = ahead
        if self.follower.crowded(ahead):
            (self.follower, self.now), self.change = self.follower.moved(ahead), None

    def ahead(self) -> Point | Change | None:
        """The next point with the same events, or the change of events that is next; None where neither is."""
        if self.change is not None:
            return self._changed(self.change)
        while self.step >= LEAST and self.short <= CREEPS:
            target = self._target()
            found = None if target is None else self._change_before(target)
            if found is not None:
                target, found = self._before(found)
                if target is None and found is not None:
                    return self._changed(found)
            if target is None:
                self.step *= 0.5
                continue
            self.change, length = found, self._to(target)
            self.short = self.short + 1 if length <= SHARP else 0
            easy = target.corrections <= EASY and float(self.now.tangent @ target.tangent) >= STRAIGHT
            grown = GROWTH if easy else 0.5 if target.corrections > HARD else 1.0
            self.step = min(grown * length, MOST)
            return target
        return None

    def _target(self) -> Point | None:
        """The point at the next distance along the tangent; None where none is, or the branch turns sharply."""
        now = self.now
        level = float(now.tangent @ now.place) + self.step
        ahead = self.follower.solve(now.place + self.step * now.tangent, now.tangent, level, now)
        return None if ahead is None or self._turns(ahead) else ahead

    def _turns(self, ahead: Point) -> bool:
        """Whether the branch turns sharply to a point with the same events."""
        same = ahead.sequence == self.now.sequence
        return same and float(self.now.tangent @ ahead.tangent) < TURN

    def _to(self, point: Point) -> float:
        """The distance along the tangent to a point."""
        return float(self.now.tangent @ (point.place - self.now.place))

    def _change_before(self, target: Point) -> Change | None:
        """The first change that is seen on the way to a point."""
        follower, now, found = self.follower, self.now, None
        if target.sequence != now.sequence:
            found = change(follower, now, now, target)
            target = found.here
        at, count = between(follower, now, now, target), max(math.ceil(self._to(target) / SPACING), 2)
        looks = [now.orbit, *self._returns(target, np.arange(1, count) / count), target.orbit]
        for k in range(1, count):
            if self._same(looks[k - 1 : k + 2], target, (k - 1) / count, (k + 1) / count):
                continue
            one, two = at((k - 1) / count), at((k + 1) / count)
            earlier = None if one is None or two is None else change_seen(follower, now, one, two)
            if earlier is not None and earlier.here.sequence == now.sequence:
                return earlier
        return found

    def _returns(self, target: Point, parts: Floats) -> Sequence[Orbit | None]:
        """Returns at parts (k,) of the way to a point, on a parabola along the branch, as if they were orbits."""
        now = self.now
        along = self._to(target) * now.tangent
        part = parts[:, None]
        try:
            return self.follower.returns_at(now.place + part * along + part**2 * (target.place - now.place - along))
        except InputError:
            return [None] * len(parts)

    def _same(
        self, looks: Sequence[Orbit | None], target: Point, low: float, high: float, closer: int = CLOSER
    ) -> bool:
        """Whether three returns at equal distances have the events of the point, which change evenly from one to the
        next; or do from closer by, as where what they change by is itself 0 between them."""
        one, middle, two = looks
        if one is None or middle is None or two is None:
            return False
        if {each.sequence for each in (one, middle, two)} != {self.now.sequence}:
            return False
        first, second = halves(one, middle, two)
        worst = uneven(first, second)
        if worst is None or not closer:
            return worst is None
        half = 0.5 * (low + high)
        low, high, one, two = (low, half, one, middle) if first[worst] > second[worst] else (half, high, middle, two)
        between = self._returns(target, np.array([0.5 * (low + high)]))
        return self._same([one, *between, two], target, low, high, closer - 1)

    def _before(self, found: Change) -> tuple[Point | None, Change | None]:
        """The last point before a change that is further away, and the change; no change where the motion jumps there.

        A branch that turns away from the planes in which its points are sought seems to jump: what jumps is looked for
        again from close by.
        """
        if self._to(found.here) <= AT_CHANGE:
            return None, found
        near = between(self.follower, self.now, self.now, found.here)(1.0 - CLOSE)
        if near is None or near.sequence != self.now.sequence or self._turns(near):
            return None, None if found.jumps else found
        return near, None if found.jumps else found

    def _changed(self, found: Change) -> Change:
        """A change, behind which the branch goes on in short steps."""
        self.change, self.step, self.short = None, AFRESH, 0
        return found
