"""Walks of many gaits on many grounds, as one batch, and what they can be judged by."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.base.spec import with_values
from tarsus.base.workers import Workers
from tarsus.design.energy import RECOVERY, energies
from tarsus.design.gait_unknowns import GaitUnknowns
from tarsus.design.limits import DEFINITIONS, WalkLimit, measure_of
from tarsus.measure.measure import measure_name
from tarsus.measure.switching import rise_squares
from tarsus.model.drive.waveforms import Constant
from tarsus.model.scene import Scene
from tarsus.solve import Session

if TYPE_CHECKING:
    from tarsus.orbits.starts import Box
    from tarsus.solve import Batch

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class WalkObjective:
    """A measure of a walk with a direction.

    name: as typed; measure: of the walk; most: whether the largest is best; grounded: whether it depends on the ground
    at all; priced: whether it needs the drives' energy.
    """

    name: str
    measure: str
    most: bool

    @property
    def unit(self) -> str:
        """Of its values."""
        return DEFINITIONS[self.measure].unit

    @property
    def doc(self) -> str:
        """What it is, in words."""
        return DEFINITIONS[self.measure].words

    @property
    def grounded(self) -> bool:
        return self.measure != ENERGY

    @property
    def priced(self) -> bool:
        return self.measure in (ENERGY, TRANSPORT)

    def cost(self, values: Floats) -> Floats:
        """Of values, so that the least is best; infinite where there is none."""
        return np.where(np.isnan(values), np.inf, -values if self.most else values)

    def value(self, costs: Floats) -> Floats:
        """Of costs."""
        return -costs if self.most else costs


ENERGY, TRANSPORT = "electrical_energy", "cost_of_transport"
"""Measures that hang on the drives alone, or on their energy: made of their switchings here, not walk by walk."""
OBJECTIVES = {
    one.name: one
    for one in (
        WalkObjective("speed", "mean_speed", True),
        WalkObjective("energy", ENERGY, False),
        WalkObjective("transport", TRANSPORT, False),
        WalkObjective("slip", "foot_slip", False),
        WalkObjective("contact", "contact_duration", True),
        WalkObjective("support", "duty_factor", True),
        WalkObjective("sway", "vertical_amplitude", False),
        WalkObjective("hold", "longest_hold", True),
    )
}
"""What a gait can be designed for in one word; any measure can by its name, as ``most duty_factor``."""


def objectives_of(given: str | WalkObjective | Sequence[str | WalkObjective]) -> tuple[WalkObjective, ...]:
    """Objectives of words, or of one text with commas; raises InputError for unknown, repeated and too many ones."""
    given = (
        given.split(",") if isinstance(given, str) else [given] if isinstance(given, WalkObjective) else given
    )
    problems, found = list[str](), list[WalkObjective]()
    for word in given:
        try:
            found.append(word if isinstance(word, WalkObjective) else _objective(word.strip()))
        except InputError as error:
            problems += [f"objective: {one}" for one in error.problems]
    names = [one.name for one in found]
    problems += [
        f"objective: '{name}' is named twice" for name in dict.fromkeys(names) if names.count(name) > 1
    ]
    if not 1 <= len(given) <= 3:
        problems.append(
            f"objective: expected one to three, got {len(given)}: a front of more cannot be looked through"
        )
    if problems:
        raise InputError(problems)
    return tuple(found)


def _objective(word: str) -> WalkObjective:
    """One of `OBJECTIVES`, or a measure by name with a direction: most or least."""
    way, _, name = word.partition(" ")
    if way in ("most", "least"):
        measure = measure_of(name)
        return WalkObjective(measure.replace("_", " "), measure, way == "most")
    if word in OBJECTIVES:
        return OBJECTIVES[word]
    if measure_name(word) in DEFINITIONS:
        raise InputError(f"'{word}' is a measure: say whether the most or the least is best, as most {word}")
    raise InputError(f"there is none called '{word}'{nearest(word, OBJECTIVES)}")


MOST_AT_ONCE = 8192
"""Runs of one batch; their events fit into memory however long they are."""


@dataclass
class Walks:
    """Runs of a walker in which its gait is given; counts them.

    unknowns: of the gait; objectives: what walks are scored by; limits: what they have to keep; duration [s]: of a run,
    of which the first third is transient; starts: of the robot, whose axes grounds may have among their paths; runs:
    how many have been made.
    """

    scene: Scene
    unknowns: GaitUnknowns
    objectives: tuple[WalkObjective, ...]
    duration: float
    threads: Workers = None
    starts: Box | None = None
    limits: tuple[WalkLimit, ...] = ()
    runs: int = 0

    def __post_init__(self) -> None:
        self._sessions = {False: Session(self.scene)}
        if self.starts is not None:
            self._sessions[True] = Session(self.starts.scene)

    def each(self, points: Floats, grounds: Mapping[str, Floats]) -> Floats:
        """Costs (nr, no) of gaits at points (nr, nu), each on its own ground, values (nr,) by path; where there are
        limits, with a last column that is 1 where they are kept, and more the farther a walk is beyond them."""
        found = self.measured(points, grounds, [one.measure for one in self.objectives])
        costs = [one.cost(found[one.measure]) for one in self.objectives]
        if self.limits:
            beyond = [one.beyond(found[one.measure]) for one in self.limits]
            costs.append(1.0 + np.max(beyond, axis=0))
        return np.stack(costs, axis=1)

    def measured(
        self,
        points: Floats,
        grounds: Mapping[str, Floats],
        measures: Sequence[str],
        duration: float | None = None,
    ) -> dict[str, Floats]:
        """Measures (nr,) of gaits at points (nr, nu), each on its own ground, and those that limits are on, in walks of
        another duration [s] where one is given."""
        measures = tuple(dict.fromkeys([*measures, *(one.measure for one in self.limits)]))
        parts = [
            self._some(
                points[i : i + MOST_AT_ONCE],
                {p: v[i : i + MOST_AT_ONCE] for p, v in grounds.items()},
                measures,
                self.duration if duration is None else duration,
            )
            for i in range(0, len(points), MOST_AT_ONCE)
        ]
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}

    def _some(
        self, points: Floats, grounds: Mapping[str, Floats], measures: Sequence[str], duration: float
    ) -> dict[str, Floats]:
        seen: dict[str, Floats] = {}
        of_walks = {"stride" if name == TRANSPORT else name for name in measures if name != ENERGY}
        if of_walks:
            batch = self.batch(points, grounds, duration)
            seen = {name: one.value for name, one in batch.measured(of_walks).items()}
        if {ENERGY, TRANSPORT} & set(measures):
            seen[ENERGY] = self.energies(points, unsaid=0.0)[1]
        if TRANSPORT in measures:
            way = np.abs(seen["stride"]) * self._weight(grounds, len(points))
            seen[TRANSPORT] = np.divide(seen[ENERGY], way, out=np.full(len(way), np.inf), where=way > 0.0)
        return seen

    def batch(self, points: Floats, grounds: Mapping[str, Floats], duration: float | None = None) -> Batch:
        """Runs (nr,) of gaits at points (nr, nu), each on its own ground."""
        self.runs += len(points)
        started, own = self._placed(grounds)
        vary = {**self.unknowns.changes(points), **own}
        return self._sessions[started].batch(
            vary, self.duration if duration is None else duration, threads=self.threads
        )

    def _placed(self, grounds: Mapping[str, Floats]) -> tuple[bool, dict[str, Floats]]:
        """Whether grounds say how the robot starts, and their values (nr,) by path of a scene."""
        axes = {} if self.starts is None else {p: v for p, v in grounds.items() if p in self.starts.ends}
        own = {path: values for path, values in grounds.items() if path not in axes}
        return bool(axes), own if not axes or self.starts is None else {**own, **self.starts.placed(axes)}

    def _weight(self, grounds: Mapping[str, Floats], count: int) -> Floats:
        gravity = self.scene.ground.gravity
        if gravity is None:
            return np.zeros(count)
        own = grounds.get("ground.gravity.acceleration", np.full(count, gravity.acceleration))
        return own * self.scene.robot.structure.total_mass  # pyright: ignore[reportAttributeAccessIssue]

    def energies(self, points: Floats, unsaid: float = RECOVERY) -> tuple[Floats, Floats]:
        """Energy (n,) [J] of all drives in a drive period, plain and with charge recovery, where drives that do not
        say recover the share ``unsaid``."""
        drives, squares = self.scene.robot.drives.values(), self._rises(points)
        each = [energies(drive, own, unsaid) for drive, own in zip(drives, squares.T, strict=True)]
        plain, recovered = np.sum(each, axis=0)
        return plain, recovered

    def _rises(self, points: Floats) -> Floats:
        """Sums (n, nd) [V^2] of the squared rises of every drive's volts in a drive period."""
        values, gait, layout = self.unknowns.changes(points), self.scene.gait, self.scene.robot.layout()
        if gait is not None and layout is not None and self._switched(values):
            low: Any = values.get("gait.low", gait.low)  # pyright: ignore[reportArgumentType]
            high: Any = values.get("gait.high", gait.high)  # pyright: ignore[reportArgumentType]
            moved = [
                name in gait.waveforms(layout) and name not in self.scene.signals
                for name in self.scene.robot.drives
            ]
            return np.outer(np.broadcast_to((high - low) ** 2, len(points)), np.array(moved, dtype=float))
        rows, which = np.unique(points, axis=0, return_inverse=True)
        return np.array([_period_rises(self.scene_of(row)) for row in rows])[which.ravel()]

    def _switched(self, values: Mapping[str, Floats]) -> bool:
        """Whether every drive's volts are the gait's square wave, as it is, or do not change."""
        return (
            all(path.startswith("gait.") for path in values)
            and all(isinstance(wave, Constant) for wave in self.scene.signals.values())
            and all(drive.amplifier.ideal for drive in self.scene.robot.drives.values())
        )

    def changes(self, point: Floats) -> dict[str, float]:
        """Values by path of the gait at a point (nu,)."""
        return {path: float(column[0]) for path, column in self.unknowns.changes(point[None]).items()}

    def scene_of(self, point: Floats, ground: Mapping[str, float] | None = None) -> Scene:
        """The scene with the gait at a point (nu,), on a ground with other values by path, put down as these say; it
        lasts as long as walks do."""
        started, own = self._placed({path: np.array([value]) for path, value in (ground or {}).items()})
        placed = {path: float(value[0]) for path, value in own.items()}
        scene = self._sessions[started].scene
        return with_values(scene, {**self.changes(point), **placed, "duration": self.duration})


def _period_rises(scene: Scene) -> list[float]:
    signals = scene.actuator_volts
    period = max((wave.period or 0.0 for wave in scene.waves.values()), default=0.0)
    return [rise_squares(signals[name], np.array([period, 2.0 * period]))[0] for name in scene.robot.drives]


def without_legs(scene: Scene, dead: Sequence[str]) -> Scene:
    """The scene with legs that are dead: the drives that move them are gone, the legs stand and keep their place in
    the gait. Raises InputError for legs that there are not, and for a drive that moves a living leg too."""
    layout = scene.robot.layout()
    if layout is None:
        raise InputError("dead: only a walker has legs")
    problems = [f"dead: the robot has no leg '{leg}'" for leg in dead if leg not in layout.hips]
    gone = [name for name, reach in layout.drives.items() if set(reach.legs) & set(dead)]
    problems += [
        f"dead: drive '{name}' moves leg '{leg}' as well, which is not said to be dead"
        for name in gone for leg in layout.drives[name].legs if leg not in dead
    ]  # fmt: skip
    if problems:
        raise InputError(problems)
    if not gone:
        return scene
    feet = {
        name: foot.model_copy(update={"electrode": None}) if foot.electrode in gone else foot
        for name, foot in scene.robot.feet.items()
    }
    drives = {name: drive for name, drive in scene.robot.drives.items() if name not in gone}
    robot = scene.robot.model_copy(
        update={"feet": type(scene.robot.feet)(feet), "drives": type(scene.robot.drives)(drives)}
    )
    signals = {name: wave for name, wave in scene.signals.items() if name not in gone}
    return with_values(scene, {"robot": robot, "signals": signals})
