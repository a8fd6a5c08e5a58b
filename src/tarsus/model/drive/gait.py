"""Gaits: square waves for the drives of a robot's legs, in a pattern over where the legs stand.

A pattern gives every leg a phase, in periods, counted as delay: **a leg with phase p is p periods late**.  Leg 0 of a
pattern has its high volts from t = 0 on, for the fraction ``duty`` of every period; a leg with phase 0.25 has them a
quarter of a period later.  Legs without a drive keep their place in the pattern; nothing is sent to them.

A drive that moves several legs (a group) has the phase they share.  A drive that acts along the way only follows the
legs it moves by ``swing_lag``; one that also acts upward is in phase with them.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from tarsus.base.messages import PathErrors, nearest
from tarsus.base.spec import Amount, Description, MaybeAmount, Named, quantity
from tarsus.base.units import format_quantity
from tarsus.model.drive.waveforms.square import Square

__all__ = ["Alternating", "AnyGait", "CustomGait", "Gait", "Layout", "MetachronalGait", "Reach", "Ripple", "Tripod"]


@dataclass(frozen=True)
class Reach:
    """What a drive moves: its legs, in order; lateral: it acts on them along the way only."""

    legs: tuple[str, ...]
    lateral: bool = False


@dataclass(frozen=True)
class Layout:
    """What a gait needs to know of a robot.

    hips: position (x forward, y to the left) [m] of every leg's hip, in the robot's order; drives: reach of each.
    """

    hips: Mapping[str, tuple[float, float]]
    drives: Mapping[str, Reach]

    @property
    def sides(self) -> list[list[str]]:
        """Legs from front to back, on the left (and in the middle) and on the right; a side without legs is omitted.

        Legs that stand next to each other on one side keep the robot's order.
        """
        order = sorted(self.hips, key=lambda leg: -self.hips[leg][0])
        left = [leg for leg in order if self.hips[leg][1] >= 0.0]
        right = [leg for leg in order if self.hips[leg][1] < 0.0]
        return [side for side in (left, right) if side]

    @property
    def groups(self) -> list[tuple[str, ...]]:
        """Different sets of legs that drives move, in the drives' order."""
        return list(dict.fromkeys(reach.legs for reach in self.drives.values() if reach.legs))


class Gait(Description, ABC):
    """Base of the gaits; a subclass gives the phase of every leg."""

    synonyms: ClassVar[Mapping[str, str]] = {
        "amplitude": "high",
        "voltage": "high",
        "volts": "high",
        "hz": "frequency",
        "duty_cycle": "duty",
    }

    frequency: Amount = quantity("Hz", "steps of each leg per second", gt=0)
    low: Amount = quantity("V", "lower voltage", default=0.0)
    high: Amount = quantity("V", "upper voltage")
    duty: Amount = quantity("1", "fraction of the period at the upper voltage", default=0.5, gt=0, lt=1)
    swing_lag: Amount = quantity(
        "1", "how late drives that act along the way only follow their legs, in periods", default=0.25
    )

    turn: MaybeAmount = quantity(
        "1",
        "share by which strides are shorter on the inside of a turn, the left where it is positive: 1 leaves those "
        "legs standing, 2 has them step backward; absent: strides are alike",
        default=None,
        ge=-2,
        le=2,
    )

    @model_validator(mode="after")
    def _in_order(self) -> Gait:
        if self.high < self.low:
            low, high = (format_quantity(one, "V") for one in (self.low, self.high))
            raise PathErrors([("high", f"the upper voltage {high} is below the lower one, {low}")])
        return self

    @abstractmethod
    def delays(self, layout: Layout) -> dict[str, float]:
        """How late each leg is [periods], for a layout without `faults`."""

    def faults(self, layout: Layout) -> list[tuple[str, str]]:
        """Why this gait does not fit a robot, as (path in the gait, sentence); empty where it fits."""
        if not layout.groups:
            return [("", "no drive of the robot moves a leg, so that there is nothing to walk with")]
        faults = self._pattern_faults(layout)
        if self.turn is not None:
            faults += _turn_faults(layout)
        if np.any(self.high < self.low):  # of numbers that are one a run, which no one else has looked at together
            faults.append(("high", "the upper voltage is below the lower one"))
        if faults:
            return faults
        late = self.delays(layout)
        for drive, reach in layout.drives.items():
            for leg in reach.legs:
                if not _alike(late[leg], late[reach.legs[0]]):
                    text = f"drive '{drive}' moves legs '{reach.legs[0]}' and '{leg}' together, but their phases differ"
                    faults.append(("", text))
                    break
        return faults

    def _pattern_faults(self, layout: Layout) -> list[tuple[str, str]]:
        """What keeps the pattern from being laid over the legs."""
        return []

    def waveforms(self, layout: Layout) -> dict[str, Square]:
        """Voltage of every drive that moves a leg, for a layout without `faults`; numbers of the gait may be one a run
        (nr,), and those of the waves are then as well."""
        late = self.delays(layout)
        middle, half = 0.5 * (self.high + self.low), 0.5 * (self.high - self.low)
        strides = {} if self.turn is None else self._strides(self.turn, layout)
        waves: dict[str, Square] = {}
        for drive, reach in layout.drives.items():
            if reach.legs:
                delay = late[reach.legs[0]] + (self.swing_lag if reach.lateral else 0.0)
                waves[drive] = Square.model_construct(
                    amplitude=half * strides[drive] if drive in strides else half,
                    offset=middle,
                    frequency=self.frequency,
                    duty=self.duty,
                    phase=2.0 * math.pi * (-delay % 1.0),
                )
        return waves

    @staticmethod
    def _strides(turn: Any, layout: Layout) -> dict[str, Any]:
        """Strides of the drives that make them on either side, as shares of whole ones."""
        left, right = 1.0 - np.where(turn > 0.0, turn, 0.0), 1.0 + np.where(turn < 0.0, turn, 0.0)
        sides = {name: _side(layout, layout.drives[name]) for name in _striding(layout)}
        return {name: left if side > 0.0 else right for name, side in sides.items() if side != 0.0}


class Alternating(Gait):
    """Two groups of legs half a period apart: neighbours along a side, and legs across from each other, differ.

    Where drives move groups of legs and there are two groups, these are the ones that alternate.
    """

    synonyms: ClassVar[Mapping[str, str]] = {**Gait.synonyms, "trot": "alternating", "diagonal": "alternating"}
    kind: Literal["alternating"] = "alternating"

    def delays(self, layout: Layout) -> dict[str, float]:
        """0 or a half for each leg [periods]; the leftmost front leg, or the first group, is at 0."""
        groups = layout.groups
        late = _each(layout, _checkered)
        if len(groups) == 2 and any(len(group) > 1 for group in groups):
            late |= {leg: 0.5 * number for number, group in enumerate(groups) for leg in group}
        return late


class Tripod(Gait):
    """Six legs in two tripods half a period apart: front and hind leg of one side with the middle leg of the other."""

    kind: Literal["tripod"] = "tripod"

    def _pattern_faults(self, layout: Layout) -> list[tuple[str, str]]:
        across = [y for _, y in layout.hips.values()]
        left, right = sum(y > 0.0 for y in across), sum(y < 0.0 for y in across)
        if (left, right, len(across)) == (3, 3, 6):
            return []
        got = f"{len(across)} in all, {left} on the left and {right} on the right"
        return [("kind", f"a tripod needs six legs, three on each side of the body, got {got}")]

    def delays(self, layout: Layout) -> dict[str, float]:
        """0 for the left front leg's tripod, a half for the other [periods]."""
        return _each(layout, _checkered)


class MetachronalGait(Gait):
    """One leg after the other: from back to front on the left, then from back to front on the right.

    The sides are half a period apart, and the legs of each share that half period.
    """

    synonyms: ClassVar[Mapping[str, str]] = {
        **Gait.synonyms,
        "metachronal": "wave",
        "crawl": "wave",
        "walk": "wave",
        "creep": "wave",
    }
    kind: Literal["wave"] = "wave"

    def delays(self, layout: Layout) -> dict[str, float]:
        """How late each leg is [periods]; the left hind leg is at 0."""
        sides = len(layout.sides)
        return _each(layout, lambda side, place, count: (side + (count - 1 - place) / count) / sides)


class Ripple(Gait):
    """Overlapping waves: one runs from back to front on each side within a period, the two half a period apart."""

    kind: Literal["ripple"] = "ripple"

    def delays(self, layout: Layout) -> dict[str, float]:
        """How late each leg is [periods]; the left hind leg is at 0."""
        return _each(layout, lambda side, place, count: (0.5 * side + (count - 1 - place) / count) % 1.0)


class CustomGait(Gait):
    """Every leg with a phase of its own, by name."""

    synonyms: ClassVar[Mapping[str, str]] = {
        **Gait.synonyms,
        **dict.fromkeys(("custom", "pace", "bound", "gallop", "pronk"), "free"),
    }
    kind: Literal["free"] = "free"
    phases: Named[float] = quantity("1", "how late each leg is, in periods, by its name")

    def _pattern_faults(self, layout: Layout) -> list[tuple[str, str]]:
        unknown = [leg for leg in self.phases if leg not in layout.hips]
        missing = [leg for leg in layout.hips if leg not in self.phases]
        return [
            *((f"phases.{leg}", f"the robot has no leg '{leg}'{nearest(leg, layout.hips)}") for leg in unknown),
            *(("phases", f"leg '{leg}' has no phase; give one to every leg") for leg in missing),
        ]

    def delays(self, layout: Layout) -> dict[str, float]:
        """As given [periods]."""
        return dict(self.phases)


def _striding(layout: Layout) -> list[str]:
    """Drives that make the strides: those that act along the way only, or where there are none all."""
    own = [name for name, reach in layout.drives.items() if reach.legs and reach.lateral]
    return own or list(layout.drives)


def _side(layout: Layout, reach: Reach) -> float:
    """1 for a drive of legs on the left, -1 on the right, 0 for any other."""
    sides = {float(np.sign(layout.hips[leg][1])) for leg in reach.legs}
    return sides.pop() if len(sides) == 1 else 0.0


def _turn_faults(layout: Layout) -> list[tuple[str, str]]:
    """Drives that cannot make the strides of the two sides differ."""
    return [
        ("turn", f"drive '{name}' moves legs of both sides, so that their strides cannot differ")
        for name in _striding(layout)
        if len({np.sign(layout.hips[leg][1]) for leg in layout.drives[name].legs} - {0.0}) > 1
    ]


def _each(layout: Layout, delay: Callable[[int, int, int], float]) -> dict[str, float]:
    """``delay(side, place, count)`` of every leg: side 0 left or 1 right, place from the front, legs on that side."""
    return {
        leg: delay(side, place, len(legs)) for side, legs in enumerate(layout.sides) for place, leg in enumerate(legs)
    }


def _checkered(side: int, place: int, count: int) -> float:
    return 0.5 * ((side + place) % 2)


def _alike(one: Any, other: Any) -> bool:
    """Whether two phases [periods], or those of every run (nr,), are the same instant of a period."""
    away = (one - other) % 1.0
    return bool(np.all(np.minimum(away, 1.0 - away) < 1e-9))


AnyGait = Annotated[Alternating | Tripod | MetachronalGait | Ripple | CustomGait, Field(discriminator="kind")]
"""Any gait; `kind` says which."""
