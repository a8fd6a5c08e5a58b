"""What a design may change: numbers of a scene within ranges, phases tied by symmetry, and pulses of a signal."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.base.spec import by_path, float_paths, with_values
from tarsus.base.units import format_quantity
from tarsus.design.problems import Problems, listed
from tarsus.design.pulse_train import Pulses, PulseTrain, pulse_train, pulses_of
from tarsus.fit.unknowns import Unknown, Unknowns
from tarsus.model.drive.gait import CustomGait, Layout
from tarsus.model.scene import Provenance, Scene, Source

Floats = NDArray[np.float64]
Ends = tuple[str | float, str | float]

PHASES = "gait.phases"
"""Stands for the phases of all legs."""
USUAL_DUTY = 0.1, 0.9
"""Usual range of a duty: beyond it a leg is as good as always driven, or never."""
ANY = 0.37
"""A phase that is no simple fraction, for which it is tried whether a symmetry fits the robot's drives at all."""


class Symmetry(Enum):
    """How the phases of a gait's legs are tied; the first leg, or the first pair, is at 0."""

    NONE = "none"
    """Every leg, or every group of legs that one drive moves, has a phase of its own."""
    MIRROR = "mirror"
    """Legs across from each other are half a period apart: a phase for every pair."""
    PAIRS = "pairs"
    """Legs across from each other move together: a phase for every pair."""
    WAVE = "wave"
    """Along a side every leg is as late as ``lag`` says behind the one after it, and the right side is ``side``
    later than the left one: alternating gaits, ripples and waves from back to front and from front to back are all
    among these."""


NO_NUMBERS = Unknowns((), (), np.zeros(0), np.zeros(0), np.zeros(0, dtype=bool), ())
"""Of a design that chooses pulses alone."""


@dataclass(frozen=True)
class Free:
    """What a design chooses: points of a unit cube, and the np numbers of the scene that follow from them.

    scene: that has these numbers; numbers: unknowns; tied: paths whose values are base + share @ unknowns, modulo 1 for
    phases, base (nt,) and share (nt, nu); pulses: signals of a drive that are chosen with them, if any.
    """

    scene: Scene
    numbers: Unknowns
    tied: tuple[str, ...]
    base: Floats
    share: Floats
    pulses: PulseTrain | None = None

    @property
    def paths(self) -> tuple[str, ...]:
        """Of all numbers (np,) of the scene that are chosen."""
        return self.tied + (() if self.pulses is None else self.pulses.paths)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the unknowns."""
        return self.numbers.names + (() if self.pulses is None else self.pulses.names)

    @property
    def families(self) -> int:
        """Ways to choose that no number leads from one to the other: sequences of pulses."""
        return 1 if self.pulses is None else len(self.pulses.families)

    def __len__(self) -> int:
        """Coordinates of a point; with several families the first one says which."""
        return len(self.names) + (self.families > 1)

    @property
    def circular(self) -> NDArray[np.bool_]:
        """Which coordinates of a point close on themselves."""
        found = np.zeros(len(self), dtype=bool)
        at = int(self.families > 1)
        found[at : at + len(self.numbers)] = self.numbers.circular
        return found

    def parted(self, points: Floats) -> tuple[NDArray[np.int64], Floats]:
        """Families (n,) of points (n, len) and their other coordinates."""
        if self.families == 1:
            return np.zeros(len(points), dtype=np.int64), points
        number = np.clip((points[:, 0] * self.families).astype(np.int64), 0, self.families - 1)
        return number, points[:, 1:]

    def joined(self, number: NDArray[np.int64], rest: Floats) -> Floats:
        """Points of families (n,) and their other coordinates."""
        return rest if self.families == 1 else np.column_stack([(number + 0.5) / self.families, rest])

    def values(self, points: Floats) -> Floats:
        """Rows (n, np) of values [SI], in the order of the paths, of points; numbers have `DIGITS` significant digits:
        what a file says is what ran."""
        number, rest = self.parted(points)
        count = len(self.numbers)
        found = np.zeros((len(points), 0))
        if count:
            closed = np.array([_closes(path) for path in self.tied])
            found = self.base + self.numbers.values(rest[:, :count]) @ self.share.T
            found = significant(np.where(closed, np.remainder(found, 1.0), found))
            found[closed & (found == 1.0)] = 0.0
        if self.pulses is None:
            return found
        return np.concatenate([found, self.pulses.place(number, rest[:, count:])], axis=1)

    def chooses(self, path: str) -> bool:
        """Whether a number of the scene is chosen, as itself or as a part of a signal."""
        drive = None if self.pulses is None else self.pulses.drive
        return path in self.tied or (drive is not None and path.startswith(f"signals.{drive}."))

    def neighbours(self, row: Floats, rng: np.random.Generator) -> Floats:
        """Rows (n, np) about one (np,) that a device can be given: whole ticks of the timer of pulses, whole
        millivolts."""
        if self.pulses is None:
            return row[None]
        near = self.pulses.rounded(row[len(self.tied) :], rng)
        return np.concatenate([np.tile(row[: len(self.tied)], (len(near), 1)), near], axis=1)

    def tunable(self, row: Floats) -> tuple[list[int], float, float]:
        """Columns of a row (np,) that make up for what ticks of a timer take, and their lowest and highest value."""
        if self.pulses is None:
            return [], 0.0, 0.0
        step, tied = self.pulses.step, len(self.tied)
        return [tied + i for i in step.tunable(row[tied:])], step.levels.low, step.levels.high

    def as_it_is(self) -> Floats:
        """Rows (n, np) to begin with: the step without pulses."""
        if self.pulses is None or self.tied:
            return np.zeros((0, len(self.paths)))
        return self.pulses.plain()


DIGITS = 6
"""Significant digits of designed numbers: a millionth of a frequency or phase is less than a tick of any timer."""


def significant(values: Floats, digits: int = DIGITS) -> Floats:
    """Values rounded to so many significant digits, as the nearest floats of these decimals."""
    size = np.floor(np.log10(np.where(values == 0.0, 1.0, np.abs(values))))
    ten = 10.0 ** np.abs(digits - 1 - size)
    fine = size <= digits - 1  # powers of ten are exact, and so a quotient is the nearest float
    return np.where(fine, np.rint(values * ten) / ten, np.rint(values / ten) * ten)


def designed(scene: Scene, paths: Iterable[str]) -> Scene:
    """The scene with a provenance that says which of its numbers a search has set."""
    origin = Provenance(source=Source.DESIGNED, note="Set by the search of `tarsus design`.")
    return with_values(scene, {"provenance": {**scene.provenance, **dict.fromkeys(paths, origin)}})


Shared = tuple[Unknown, Mapping[str, float]]
"""An unknown, and by path how much of it the scene's numbers take."""


def _closes(path: str) -> bool:
    """Whether a number of the scene is counted modulo 1."""
    return path.startswith(f"{PHASES}.") or path == "gait.swing_lag"


def free_of(scene: Scene, given: Mapping[str, Any] | Iterable[str], symmetry: Symmetry | None = None) -> Free:
    """What a design may change, and the scene that has it: one whose phases are free has a free gait.

    Parameters
    ----------
    scene
        With the numbers that may change.
    given
        Paths, also as one text with commas, with their ranges (low, high), or None for the usual one: phases a whole
        period, duty 0.1 to 0.9, frequency and durations half to twice what they are, the upper voltage half of what it
        is to that. `PHASES` stands for all legs, with a `Symmetry` that ties them; ``signals.DRIVE`` takes `Pulses`.
    symmetry
        Of the phases that `PHASES` stands for, unless it is given there.

    Raises
    ------
    InputError
        With every problem: paths that are no numbers of the scene, ranges that are empty or have to be given.
    """
    ranges = given if isinstance(given, Mapping) else dict.fromkeys(listed(given))
    wanted = {path: _kind(one) for path, one in ranges.items()}
    trains = {path: one for path, one in wanted.items() if isinstance(one, Pulses)}
    wanted = by_path(scene, {path: one for path, one in wanted.items() if path not in trains})
    problems, found = Problems(), list[Shared]()
    base: dict[str, float] = {}
    if not wanted and not trains:
        problems.append("free: name at least one number that may change, such as gait.duty")
    if symmetry not in (None, Symmetry.NONE) and PHASES not in wanted:
        problems.append(f"symmetry: '{symmetry.value}' ties phases, so {PHASES} has to be free")
    if (PHASES in wanted or any(path.startswith(f"{PHASES}.") for path in wanted)) and scene.gait is not None:
        layout = scene.robot.layout()
        if layout is not None and not isinstance(scene.gait, CustomGait) and not scene.gait.faults(layout):
            scene = freed(scene, layout)
    owners: list[str] = []
    for path, span in wanted.items():
        if path == PHASES:
            phases, fixed = problems.tried(lambda span=span: _phases(scene, symmetry, span)) or ([], {})
            found += phases
            base |= fixed
            owners += fixed
        elif one := problems.tried(lambda path=path, span=span: _single(scene, path, span)):
            found.append(one)
            owners.append(path)
    problems += [f"{path}: is free twice" for path in dict.fromkeys(owners) if owners.count(path) > 1]
    problems += _order(scene, found)
    train = None
    if len(trains) > 1:
        problems.append(f"free: pulses of one drive at a time, got {' and '.join(trains)}")
    for path, one in trains.items() if len(trains) == 1 else ():
        train = problems.tried(lambda path=path, one=one: pulse_train(scene, path, one))
    if problems:
        raise InputError(problems)
    tied = tuple(dict.fromkeys(owners))
    share = np.array([[shares.get(path, 0.0) for _, shares in found] for path in tied])
    numbers = Unknowns.of(scene, [one for one, _ in found]) if found else NO_NUMBERS
    made = scene if train is None else train.carried_by(scene)
    return Free(made, numbers, tied, np.array([base.get(path, 0.0) for path in tied]), share, train)


def _kind(given: Any) -> Any:
    """What a path is given, as its type: a table of a file is of `Pulses`, a word a `Symmetry`."""
    if isinstance(given, Mapping):
        return pulses_of(given)
    if isinstance(given, str):
        try:
            return Symmetry(given)
        except ValueError:
            raise InputError(f"free: expected a range, usual, none, mirror, pairs or wave, got '{given}'") from None
    return given


def freed(scene: Scene, layout: Layout) -> Scene:
    """The scene with the phases that its gait gives written out leg by leg."""
    assert scene.gait is not None
    late = scene.gait.delays(layout)
    same = {name: getattr(scene.gait, name) for name in ("frequency", "low", "high", "duty", "swing_lag")}
    return with_values(scene, {"gait": CustomGait(**same, phases={leg: late[leg] % 1.0 for leg in layout.hips})})


def _single(scene: Scene, path: str, span: Ends | None) -> Shared:
    known = float_paths(scene)
    if path not in known:
        raise InputError(f"{path}: the scene has no such number{nearest(path, known)}")
    if path.startswith("initial."):
        raise InputError(f"{path}: how a run starts is no part of a design")
    about = known[path]
    low, high = _usual(path, about.value) if span is None else span
    ends = Unknowns.of(scene, [Unknown(path, low, high)])
    low, high = float(ends.low[0]), float(ends.high[0])
    for end in (low, high) if not path.startswith(("gait.low", "gait.high")) else ():
        with_values(scene, {path: end})
    around = _closes(path) and math.isclose(high - low, 1.0)
    return Unknown(path, low, high, name=path.removeprefix("gait."), circular=around), {path: 1.0}


def _usual(path: str, value: float) -> tuple[float, float]:
    leaf = path.rpartition(".")[2]
    if _closes(path):
        return 0.0, 1.0
    if path == "gait.duty" or leaf == "duty":
        return USUAL_DUTY
    if leaf == "frequency" or ".durations." in path:
        return 0.5 * value, 2.0 * value
    if leaf in ("high", "amplitude") and value > 0.0:
        return 0.5 * value, value  # never more volts than the scene says that the device bears
    raise InputError(f"{path}: has no usual range; give one, such as {path}=a:b")


def _phases(
    scene: Scene, symmetry: Symmetry | None, span: Symmetry | Ends | None
) -> tuple[list[Shared], dict[str, float]]:
    """Phases of all legs: the unknowns, and by path the part of each phase that is none."""
    if isinstance(span, Symmetry):
        symmetry, span = span, None
    symmetry = symmetry or Symmetry.NONE
    layout = scene.robot.layout()
    if scene.gait is None or layout is None or not isinstance(scene.gait, CustomGait):
        raise InputError(f"{PHASES}: the scene has no gait whose phases could be free")
    if span is not None:
        raise InputError(f"{PHASES}: phases of all legs range over a whole period; give a range to single legs only")
    names, base, share = _tied(layout, symmetry)
    if not names:
        raise InputError(f"{PHASES}: no phase is left free; all legs move together")
    paths = tuple(f"{PHASES}.{leg}" for leg in layout.hips)
    values = {path: float(b + s.sum() * ANY) % 1.0 for path, b, s in zip(paths, base, share, strict=True)}
    for _, text in with_values(scene.gait, {p.removeprefix("gait."): v for p, v in values.items()}).faults(layout):
        raise InputError(f"symmetry: '{symmetry.value}' does not fit the robot: {text}")
    columns = [dict(zip(paths, column.tolist(), strict=True)) for column in share.T]
    unknown = [Unknown(low=0.0, high=1.0, name=name, unit="1", circular=True) for name in names]
    return list(zip(unknown, columns, strict=True)), dict(zip(paths, base.tolist(), strict=True))


def _tied(layout: Layout, symmetry: Symmetry) -> tuple[list[str], Floats, Floats]:
    """Names of the unknown phases; base (nl,) and share (nl, nu) of the phases of all legs in them."""
    legs = list(layout.hips)
    place = {leg: (s, i) for s, side in enumerate(layout.sides) for i, leg in enumerate(side)}
    base = np.zeros(len(legs))
    if symmetry is Symmetry.WAVE:
        share = np.zeros((len(legs), 2))
        for row, leg in enumerate(legs):
            side, along = place[leg]
            share[row] = along, side
        used = [i for i in range(2) if share[:, i].any()]
        return [("lag", "side")[i] for i in used], base, share[:, used]
    if symmetry is Symmetry.NONE:
        owner = {leg: group[0] for group in layout.groups for leg in group}
        keys = [owner.get(leg, leg) for leg in legs]
        groups = [key for key in dict.fromkeys(keys)]
    else:
        keys = [str(place[leg][1]) for leg in legs]
        groups = sorted(set(keys), key=int)
        if symmetry is Symmetry.MIRROR:
            base = np.array([0.5 * place[leg][0] for leg in legs])
    share = np.array([[float(key == group) for group in groups[1:]] for key in keys])
    share = share.reshape(len(legs), len(groups) - 1)
    names = [
        f"phases.{group}" if symmetry is Symmetry.NONE else f"phase of pair {int(group) + 1}" for group in groups[1:]
    ]
    return names, base, share


def _order(scene: Scene, free: Sequence[Shared]) -> list[str]:
    """The lower voltage stays below the upper one wherever they are."""
    if scene.gait is None:
        return []
    ends = {"gait.low": (scene.gait.low,) * 2, "gait.high": (scene.gait.high,) * 2}
    for one, _ in free:
        if one.path in ends:
            ends[one.path] = float(one.low), float(one.high)
    low, high = ends["gait.low"][1], ends["gait.high"][0]
    if low > high:
        low, high = (format_quantity(float(f"{one:.6g}"), "V") for one in (low, high))
        return [f"gait.low: reaches {low}, above the least upper voltage {high}; narrow one of the ranges"]
    return []
