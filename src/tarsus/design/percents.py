"""What one percent of each number that a design depends on costs: its slope, and the worst within one percent.

Numbers that legs, feet or drives share are those of one batch of parts, and vary together.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.spec import float_paths
from tarsus.model.scene import Scene
from tarsus.tables.numbers import amount
from tarsus.tables.table import Column, Table

if TYPE_CHECKING:
    from tarsus.design.grounds import Grounds
    from tarsus.design.runs import Runs

PERCENT = 0.01
"""How far numbers are varied: to about that a laboratory knows a length or a frequency that it has measured."""
NAMED = 3
"""Numbers that a console names: those that cost most."""
SAME = 1e-3
"""Share of a design's own value below which a percent of a number costs nothing that anybody would see."""
COARSE = PERCENT * np.array([-1.0, 1.0])
"""Where a number of motions from several starts is varied: these scatter by more than what lies between."""
FINE = PERCENT * np.array([-0.01, 0.01, -1.0, -0.75, -0.5, -0.25, 0.25, 0.5, 0.75, 1.0])
"""Where it is varied of a periodic motion: a hundredth of a percent for the slope, and quarters, for a speed that is
the root of an energy has its kink within the percent."""
BOX = {True: 128, False: 32}
"""Places where all numbers are off at once, of a periodic motion and of others: what none of so many is, is less than
2.3 % and 9 % of the box (95 %)."""
_ONE_OF_MANY = re.compile(
    r"^(robot\.structure\.legs|robot\.drives|robot\.feet|signals)\.[^.]+|(?<=\.load\.weights)\.[^.]+"
)
_NO_NUMBERS = re.compile(r"duration$|.*\.history\.|.*\.recovery$")

Ground = Mapping[str, Floats]
Measured = Callable[[Ground], Floats]
"""From values (n,) by path of the scene to the measure (n,) of a design there."""


@dataclass(frozen=True)
class Percent:
    """One number that a design depends on.

    name: its path, * for each of several that vary together; slope: what a percent more of it adds to the measure;
    error: of that; worst: the worst of the measure within a percent to either side. All in the
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
            "number",
            Column("a percent more adds", self.unit, 3),
            Column("give or take", self.unit, 2),
            Column("worst within 1 %", self.unit, 3),
        )
        return Table("", columns, [(one.name, one.slope, one.error, one.worst) for one in self.each])

    @property
    def words(self) -> str:
        """The numbers that cost most, in a sentence."""
        if not np.isfinite(self.own):
            return f"there is no {self.measure} that 1 % of a number could change"
        if not self.each:
            return f"a change of 1 % in any one number changes the {self.measure} by less than 0.1 %"
        named = ", ".join(f"{amount(one.worst, self.unit)} ({one.name})" for one in self.each[:NAMED])
        return f"{self.measure} within 1 % of one number, worst: {named}; of all at once: {amount(self.box, self.unit)}"

    def to_dict(self) -> dict[str, Any]:
        """Plain data, SI units."""
        return {
            "measure": self.measure,
            "unit": self.unit,
            "own": self.own,
            "box": self.box,
            "each": [one.to_dict() for one in self.each],
        }


def percents_of(runs: Runs, row: Floats, starts: Grounds, *, periodic: bool) -> Percents:
    """Of a candidate (np,), in its first objective, the mean of runs from starts on the scene's own ground; with exact
    slopes where the motion is ``periodic``."""
    one, count = runs.objectives[0], len(starts)
    train, known = runs.free.pulses, float_paths(runs.scene)
    chosen = () if train is None else (f"signals.{train.drive}.",)
    numbers = numbers_of(runs.scene_of(row), lambda path: path.startswith(("initial.", *chosen)) or path not in known)

    def each(ground: Ground) -> Floats:
        """Measures (n, starts), by which means are taken."""
        size = len(next(iter(ground.values()), [0]))
        own = starts.rows(np.tile(np.arange(count), size))  # with what the design is to bear as the scene has it
        own |= {path: np.repeat(value, count) for path, value in ground.items()}
        rows = np.tile(row, (size * count, 1))
        return runs.measured(rows, own, [one.measure])[one.measure].reshape(size, count)

    def bad(values: Floats) -> float:
        """The worst of means (n,); what has no value is none."""
        return float(values.min() if one.most else values.max())

    steps = FINE if periodic else COARSE
    middle = each({})[0]
    seen = varied(numbers, each, steps)
    own = float(middle.mean())
    worst = {name: bad(np.append(values.mean(axis=1), own)) for name, values in seen.items()}
    names = costly(worst, own, one.most) if np.isfinite(own) else []
    box = own
    if names:
        together = all_at_once(numbers, names, lambda ground: each(ground).mean(axis=1), BOX[periodic])
        box = bad(np.append(together, [worst[name] for name in names]))  # it holds those of one number too
    far = PERCENT / float(steps[1])
    made = tuple(Percent(name, *_slope(seen[name][:2], middle, far), worst[name]) for name in names)
    return Percents(one.name, one.unit, one.most, own, box, made)


def _slope(values: Floats, middle: Floats, far: float) -> tuple[float, float]:
    """Mean over starts of the slope by a percent, of measures (2, ns) to both sides, a percent over ``far`` away, and
    (ns,) between; and its error: the standard error over starts, and half of what the slopes to both sides differ
    by."""
    below, above = values
    slopes = 0.5 * far * (above - below)
    bend = 0.5 * far * abs(float((above + below - 2.0 * middle).mean()))
    scatter = float(slopes.std(ddof=1)) / np.sqrt(len(slopes)) if len(slopes) > 1 else 0.0
    return float(slopes.mean()), float(np.hypot(scatter, bend))


def numbers_of(scene: Scene, designed: Callable[[str], bool]) -> dict[str, dict[str, float]]:
    """Numbers of a scene that are not zero and that the design does not choose, by path; those that parts share under
    one name."""
    found: dict[str, dict[str, float]] = {}
    for path, info in float_paths(scene).items():
        if info.value and not designed(path) and not _NO_NUMBERS.match(path):
            name = _ONE_OF_MANY.sub(lambda part: f"{part[1] or ''}.*", path)
            found.setdefault(name, {})[path] = info.value
    return found


def varied(numbers: Mapping[str, Mapping[str, float]], measured: Measured, steps: Floats) -> dict[str, Floats]:
    """Measures (ns, ...) by name where one number alone, or all that share its name, deviate by shares ``steps``
    (ns,); of numbers that vary by themselves."""
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
        {path: value * (1.0 + off[:, i]) for i, name in enumerate(names) for path, value in numbers[name].items()}
    )


def costly(worst: Mapping[str, float], own: float, most: bool) -> list[str]:
    """Names of the numbers that cost anything, those that cost most first."""
    lost = {name: (own - one if most else one - own) for name, one in worst.items()}
    kept = [name for name, one in lost.items() if not one <= SAME * abs(own)]
    return sorted(kept, key=lambda name: -lost[name] if np.isfinite(lost[name]) else -np.inf)
