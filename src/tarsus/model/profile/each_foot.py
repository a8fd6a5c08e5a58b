"""A line of ground of its own for each foot."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Literal

from pydantic import Field

from tarsus.base.messages import nearest
from tarsus.base.spec import Named
from tarsus.model.profile.base import GroundLine, Relief

if TYPE_CHECKING:
    from tarsus.model.profile import AnyLine


class EachFoot(Relief):
    """Lines by the names of feet, or of all on a side, ``left`` and ``right``: a foot's name goes before its side."""

    kind: Literal["feet"] = "feet"
    feet: Named[AnyLine] = Field(description="shapes by foot, or by side: left and right")

    def lines(self, feet: Mapping[str, float]) -> tuple[list[GroundLine], list[int]]:
        lines: list[GroundLine] = []
        which: dict[str, int] = {}
        for key, shape in self.feet.items():
            own = {name: y for name, y in feet.items() if self._key(name, y) == key}
            if own:
                found, numbers = shape.lines(own)
                which |= {name: len(lines) + number for name, number in zip(own, numbers, strict=True)}
                lines += found
        return lines, [which[name] for name in feet]

    def faults(self, feet: Mapping[str, float]) -> list[tuple[str, str]]:
        of = {name: self._key(name, y) for name, y in feet.items()}
        found = [
            (f"feet.{key}", f"the robot has no foot '{key}', and it is no side, left or right{nearest(key, feet)}")
            for key in self.feet
            if key not in feet and key not in SIDES
        ]
        found += [
            ("feet", f"foot '{name}' has no ground: give that of its name or its side")
            for name, key in of.items()
            if key is None
        ]
        found += [
            (f"feet.{key}", "is the ground of no foot: leave it out")
            for key in self.feet
            if key in SIDES and key not in of.values()
        ]
        for key, shape in self.feet.items():
            own = {name: feet[name] for name, found_key in of.items() if found_key == key}
            found += [(f"feet.{key}.{path}", text) for path, text in shape.faults(own)]
        return found

    @property
    def wide(self) -> bool:
        return any(shape.wide for shape in self.feet.values())

    def _key(self, name: str, y: float) -> str | None:
        """What the line of a foot is given by."""
        side = SIDES[y < 0.0] if y != 0.0 else None
        return name if name in self.feet else side if side in self.feet else None


SIDES = ("left", "right")
