"""How far a periodic motion is from one with other events, and how fast that changes along a branch.

As long as none of these reaches zero, the events stay as they are, and orbit, events and margins change smoothly:

    a flight    gap at a part tau of the time, over its zeros:  g / (tau^n (1 - tau)),  n = 1 behind a bounce
    a contact   strength less pull, over the zero of a release:  (f_a - f) / (1 - tau)
    a landing   what its rule decides by: approach speed, departing speed over the rule's, pull over strength
    an order    time from one event to the next

Between two points of a branch each is a function of which values and slopes are known at both ends; `Margins.room` says
in how much of the way it is certain to stay above zero.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.base.events import IMPACTS, EventKind
from tarsus.model.laws.landing import PullAsPrinted
from tarsus.orbits.looks import Looks, kept_events
from tarsus.solve.acting import Acting, slope, value

if TYPE_CHECKING:
    from tarsus.orbits.orbit import Orbit
    from tarsus.solve.tangents import Entering

Floats = NDArray[np.float64]
Pair = tuple[Floats, Floats]
Two = tuple[float, float]

DOUBT = 3.0
"""By how much a margin may bend more between two points than its slopes at these show."""
ROUNDED = 1e-6
"""Part of a margin that rounding and windows' steps may move it by."""
TOGETHER = 1e-13
"""Part of the time since the start below which events come together: it is known to a thousandth of that."""


@dataclass(frozen=True)
class Margins:
    """Values (2, k) of all margins of an orbit and their slopes along the branch (2, k), of one sequence of events in
    one order; of two in a column it is enough that one is above zero. looks: how often each flight and contact was
    looked at."""

    values: Floats
    slopes: Floats
    looks: tuple[int, ...]

    def room(self, ahead: Margins, ways: Sequence[Coordinate]) -> float:
        """The part of the way along the branch from here to another point that no margin is seen to reach zero within;
        1 and more where that is all of it. ways: coordinates along the branch, by any of which that may be seen."""
        if self.values.shape != ahead.values.shape:
            return 0.0
        a, b = self.values, ahead.values
        seen = np.zeros_like(a)
        for way in ways:
            da, db = self.slopes * way.here, ahead.slopes * way.there
            squared = _covered(a * a, 2.0 * a * da, b * b, 2.0 * b * db, way.length)
            seen = np.maximum(seen, np.maximum(_covered(a, da, b, db, way.length), squared))
        seen[(a < 0.0) | (b < 0.0)] = 0.0
        best, known = seen.max(axis=0), np.isfinite(a + b + self.slopes + ahead.slopes).any(axis=0)
        return float(best[known & ((a[0] != 0.0) | (b[0] != 0.0))].min(initial=np.inf))

    def jumps(self, ahead: Margins, step: float) -> bool:
        """Whether some margin changes by far more than the slopes at both ends allow: between them the events stay the
        same, but not the motion."""
        if self.values.shape != ahead.values.shape:
            return True
        moved, most = (
            np.abs(ahead.values - self.values),
            np.maximum(np.abs(self.slopes), np.abs(ahead.slopes)),
        )
        size = np.maximum(np.abs(ahead.values), np.abs(self.values))
        return bool((moved > DOUBT * most * step + ROUNDED * size)[np.isfinite(moved)].any())


@dataclass(frozen=True)
class Coordinate:
    """A coordinate along a branch between two points: its length, and its slopes at both by the distance, inverted."""

    length: float
    here: float
    there: float

    @classmethod
    def plain(cls, length: float) -> Coordinate:
        """The distance itself."""
        return cls(length, 1.0, 1.0)

    @classmethod
    def root(cls, here: float, there: float) -> Coordinate:
        """The root of the distance to where events change, from one distance to another: what an impact leaves behind
        goes with the root of the distance to its grazing."""
        return cls(
            abs(np.sqrt(there) - np.sqrt(here)),
            *(np.sign(there - here) * 2.0 * np.sqrt(one) for one in (here, there)),
        )


def _covered(a: Floats, da: Floats, b: Floats, db: Floats, step: float) -> Floats:
    """Part of a step (k,) within which functions of these values and slopes at both ends are above zero, if they bend
    nowhere more than ``DOUBT`` times as much as these say.

    From the left they are above a + a' s - K s^2 / 2, from the right the same, K being the bend.
    """
    with np.errstate(all="ignore"):
        chord = (b - a) / step
        bend = DOUBT * 2.0 * np.maximum(np.abs(da - chord), np.abs(db - chord)) / step
        bend = np.maximum(bend, 1e-300)
        left = (da + np.sqrt(da * da + 2.0 * bend * a)) / bend
        right = (-db + np.sqrt(db * db + 2.0 * bend * b)) / bend
        return np.nan_to_num(left / step, posinf=9.0) + np.nan_to_num(right / step, posinf=9.0)


def margins_of(
    orbit: Orbit, given: Entering, value: float, later: float, looks: tuple[int, ...] = ()
) -> Margins:
    """The margins of an orbit, with their slopes along a branch.

    given: what enters it, with derivatives by a number and along the way of its states; value: slope of that number;
    later: by how much the section is later with it [s]; looks: how often each flight and contact is looked at, where
    the orbit's events are those of another one, by default so often that the structure's modes are resolved.
    """
    seen = Looks.of(orbit, given, value, later, looks)
    parts = [
        seen.margins(),
        _of_landings(orbit, seen.events),
        _of_order(orbit, seen.events["time"], seen.longer),
    ]
    values, slopes = (np.concatenate([np.broadcast_to(part[k], (2, part[k].shape[-1])) for part in parts], axis=1)
                      for k in (0, 1))  # fmt: skip
    return Margins(values, slopes, seen.counts)


def _of_landings(orbit: Orbit, slopes: Mapping[str, Floats]) -> Pair:
    """Values and slopes (2, k) of the margins by which landings are what they are: of a bounce whose departing speed
    counts, two, of which one is enough. slopes (ne,): of the events' fields."""
    acting, found = Acting(orbit.map.plan, orbit.map.rows), list[tuple[Two, Two]]()
    printed = any(isinstance(law, PullAsPrinted) for law in orbit.scene.ground.acting_laws.values())
    for i in kept_events(orbit.events):
        event, by = orbit.events[i], {name: float(one[i]) for name, one in slopes.items()}
        if event["kind"] not in IMPACTS:
            continue
        rules = [(float(event["speed_before"]), by["speed_before"])] * 2
        found.append((rules[0], rules[1]))
        pulled = (float(event["pull"] - event["strength"]), by["pull"] - by["strength"])
        fast = _excess(acting, float(event["speed_before"]), by["speed_before"]) or pulled
        if event["kind"] not in (EventKind.BOUNCE, EventKind.CAPTURE):
            down = (-float(event["pull"]), -by["pull"])
            found.append((down, down))
        elif printed:
            continue
        elif event["kind"] == EventKind.CAPTURE:
            found += [((-one[0], -one[1]),) * 2 for one in (pulled, fast)]
        elif acting.on("strength") or acting.on("excess"):
            found.append((pulled, fast))
    values, by_way = np.array(found, dtype=float).reshape(-1, 2, 2).transpose(2, 1, 0)
    return values, by_way


def _excess(acting: Acting, speed: float, by: float) -> Two | None:
    """How much faster a foot departs than where it may be held, with its slope; None without such a rule."""
    for rule in acting.on("excess").values():
        rebound = next(iter(acting.on("rebound").values()), None)
        after, by_speed = (0.0, 0.0) if rebound is None else (value(rebound, speed), slope(rebound, speed))
        return float(value(rule, after)), float(slope(rule, after) * by_speed) * by
    return None


def _of_order(orbit: Orbit, slopes: Floats, longer: float) -> Pair:
    """Times between events, and from the section to the first and from the last to it, with their slopes."""
    kept = kept_events(orbit.events)
    times = np.diff(np.concatenate([[0.0], orbit.events["time"][kept], [orbit.period]]))
    times[times < TOGETHER * orbit.start] = 0.0
    return times, np.diff(np.concatenate([[0.0], slopes[kept], [longer]]))
