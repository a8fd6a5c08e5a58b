"""What one percent of each number that a design hangs on costs: its slope, and the worst within one percent.

Numbers that legs, feet or drives share are those of one batch of parts, and vary together.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.spec import float_paths
from tarsus.model.scene import Scene
from tarsus.tables.numbers import amount
from tarsus.tables.table import Column, Table

PERCENT = 0.01
"""How far numbers are varied: to about that a laboratory knows a length or a frequency that it has measured."""
NAMED = 3
"""Numbers that a console names: those that cost most."""
SAME = 1e-3
"""Share of a design's own value below which a percent of a number costs nothing that anybody would see."""
_ONE_OF_MANY = re.compile(
    r"^(robot\.structure\.legs|robot\.drives|robot\.feet|signals)\.[^.]+|(?<=\.load\.weights)\.[^.]+"
)
_NO_NUMBERS = re.compile(r"duration$|.*\.history\.|.*\.recovery$")

Ground = Mapping[str, Floats]
Measured = Callable[[Ground], Floats]
"""From values (n,) by path of the scene to the measure (n,) of a design there."""


@dataclass(frozen=True)
class Percent:
    """One number that a design hangs on.

    name: its path, * for each of several that vary together; slope: what a percent more of it adds to the measure;
    error: what that may be off by; worst: the worst of the measure within a percent to either side. All in the
    measure's unit.
    """

    name: str
    slope: float
    error: float
    worst: float

    def to_dict(self) -> dict[str, Any]:
        """Plain data, SI units."""
        return {one.name: getattr(self, one.name) for one in fields(self)}


@dataclass(frozen=True)
class Percents:
    """What a percent costs of one measure of a design. own: its value; box: the worst that was found where all numbers
    vary at once; most: whether more is better; each: numbers, those that cost most first."""

    measure: str
    unit: str
    most: bool
    own: float
    box: float
    each: tuple[Percent, ...]

    def table(self) -> Table:
        """A row for each number."""
        columns = (
            "number", Column("a percent more adds", self.unit, 3), Column("give or take", self.unit, 2),
            Column("worst within 1 %", self.unit, 3),
        )  # fmt: skip
        return Table("", columns, [(one.name, one.slope, one.error, one.worst) for one in self.each])

    @property
    def words(self) -> str:
        """The numbers that cost most, in a sentence."""
        if not self.each:
            return f"1 % of no number of the scene changes the {self.measure} by 0.1 %"
        named = ", ".join(f"{amount(one.worst, self.unit)} ({one.name})" for one in self.each[:NAMED])
        return f"{self.measure} within 1 % of one number, worst: {named}; of all at once: {amount(self.box, self.unit)}"

    def to_dict(self) -> dict[str, Any]:
        """Plain data, SI units."""
        return {
            "measure": self.measure, "unit": self.unit, "own": self.own, "box": self.box,
            "each": [one.to_dict() for one in self.each],
        }  # fmt: skip


def numbers_of(scene: Scene, designed: Callable[[str], bool]) -> dict[str, dict[str, float]]:
    """Numbers of a scene that are not zero and that the design does not choose, by path; those that parts share under
    one name."""
    found: dict[str, dict[str, float]] = {}
    for path, info in float_paths(scene).items():
        if info.value and not designed(path) and not _NO_NUMBERS.match(path):
            name = _ONE_OF_MANY.sub(lambda part: f"{part[1] or ''}.*", path)
            found.setdefault(name, {})[path] = info.value
    return found


def varied(
    numbers: Mapping[str, Mapping[str, float]], measured: Measured, steps: Floats
) -> dict[str, Floats]:
    """Measures (ns, ...) by name where one number alone, or all that share its name, are off by shares ``steps`` (ns,);
    of numbers that vary by themselves."""
    found = {}
    for name, own in numbers.items():
        try:
            found[name] = measured({path: value * (1.0 + steps) for path, value in own.items()})
        except InputError:  # it does not vary by itself, or not so far
            continue
    return found


def all_at_once(
    numbers: Mapping[str, Mapping[str, float]], names: Sequence[str], measured: Measured, count: int
) -> Floats:
    """Measures (count,) where all numbers of these names are off at once, each by up to a percent."""
    off = PERCENT * (2.0 * np.random.default_rng(11).random((count, len(names))) - 1.0)
    return measured(
        {
            path: value * (1.0 + off[:, i])
            for i, name in enumerate(names)
            for path, value in numbers[name].items()
        }
    )


def felt(worst: Mapping[str, float], own: float, most: bool) -> list[str]:
    """Names of the numbers that cost anything, those that cost most first."""
    lost = {name: (own - one if most else one - own) for name, one in worst.items()}
    kept = [name for name, one in lost.items() if not one <= SAME * abs(own)]
    return sorted(kept, key=lambda name: -lost[name] if np.isfinite(lost[name]) else -np.inf)
