"""Steps along a branch, so short that no change of the events is passed over.

A step is taken where every margin of the events (`tarsus.orbits.margins`) is seen to stay above zero all along it; a
change of the events is located, and reached in such steps.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from tarsus.orbits.margins import Coordinate, Margins
from tarsus.orbits.special import Change, change

if TYPE_CHECKING:
    from tarsus.orbits.follow import Follower, Point

FIRST, MOST, LEAST = 0.01, 0.04, 1e-11
"""First, longest and shortest step along a branch, in units of the range and of the motion's size: a figure needs some
thirty points; below the last a branch ends."""
RESOLVED = 1e-8
"""Step below which margins are not asked: two changes that are no further apart count as one."""
TURN = 0.9
"""Least cosine between the tangents of neighbouring points: a sharper turn is taken in shorter steps."""
SHARP = 1e-6
"""Step below which a sharp turn is taken as it is: the branch has a corner, as where its events change."""
CREEPS = 60
"""Shorter steps in a row after which a branch ends: halved and half grown again, 40 lead from `SHARP` to `LEAST`."""
CLOSE = 1e-3
"""Part of the way to a change that is left for the next step: there slopes by its root are still known."""
AFRESH = 1e-3
"""First step behind a change."""
GROWTH = 2.0
"""By how much a step may be longer than the one before, which tells little of what is further away."""


@dataclass
class Stepper:
    """Goes along a branch from a point. step: the next one to try; change: the next change of events, where it is
    known; since: where the last one was; short: steps below `SHARP` in a row."""

    follower: Follower
    now: Point
    step: float = FIRST
    change: Change | None = None
    since: Point | None = None
    short: int = 0
    margins: Margins | None = field(init=False)

    def __post_init__(self) -> None:
        self.go(self.now)

    def go(self, ahead: Point, margins: Margins | None = None) -> None:
        """On to a point, with its margins where they are known; an event close to the section moves that."""
        self.now, self.margins = ahead, margins
        if self.follower.crowded(ahead):
            (self.follower, self.now), self.margins, self.change = self.follower.moved(ahead), None, None
        if self.margins is None:
            self.margins = self.now.margins()

    def ahead(self) -> tuple[Point | Change | None, Margins | None]:
        """The next point with the same events and its margins, or the change of the events that is next; None where
        there is neither."""
        step = self.step
        while step >= LEAST and self.short <= CREEPS:
            target = self._next(step)
            if target is None:
                step *= 0.5
                continue
            length = self._to(target)
            if self.change is not None and self._to(self.change.here) <= RESOLVED:
                found, self.change, self.step, self.short = self.change, None, AFRESH, 0
                self.since = found.there
                return found, None
            room, margins = self._room(target, length)
            if room < 1.0 and length > RESOLVED:
                if self.change is None and self.margins and margins and self.margins.jumps(margins, length):
                    self.change = change(self.follower, self.now, target)
                step = length * min(max(0.8 * room, 0.1), 0.5)
                continue
            self.short = self.short + 1 if length <= SHARP else 0
            self.step = min(GROWTH * length, MOST)
            return target, margins
        return None, None

    def _next(self, step: float) -> Point | None:
        """The point at a distance along the branch, or one close to the next change of events before it."""
        if self.change is None or self._to(self.change.here) > step:
            target = self._target(step)
            if target is None or target.sequence == self.now.sequence:
                return target
            self.change = change(self.follower, self.now, target)
            assert self.change is not None  # of other events there always is one
        return self._target((1.0 - CLOSE) * self._to(self.change.here))

    def _target(self, step: float) -> Point | None:
        """The point at a distance along the tangent; None where there is none, or the branch turns sharply to it."""
        now = self.now
        level = float(now.tangent @ now.place) + step
        ahead = self.follower.solve(now.place + step * now.tangent, now.tangent, level, now)
        if ahead is None or ahead.sequence != now.sequence:
            return ahead
        return ahead if float(now.tangent @ ahead.tangent) >= TURN else None

    def _to(self, point: Point) -> float:
        """The distance along the tangent to a point."""
        return float(self.now.tangent @ (point.place - self.now.place))

    def _room(self, ahead: Point, length: float) -> tuple[float, Margins | None]:
        """Part of the way to a point with the same events that no margin is seen to reach zero within."""
        if self.margins is None:
            return float("inf"), None
        margins, ways = ahead.margins(self.margins.looks), [Coordinate.plain(length)]
        if self.change is not None and (left := self._to(self.change.here)) > length:
            ways.append(Coordinate.root(left, left - length))
        if self.since is not None and (passed := -self._to(self.since)) >= 0.0:
            ways.append(Coordinate.root(passed, passed + length))
        return (float("inf") if margins is None else self.margins.room(margins, ways)), margins
