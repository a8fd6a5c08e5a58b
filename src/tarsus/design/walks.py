"""Walks of many gaits on many grounds, as one batch, and what they can be judged by."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
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
from tarsus.measure.switching import rise_squares
from tarsus.model.drive.waveforms import Constant
from tarsus.model.scene import Scene
from tarsus.solve import Session

if TYPE_CHECKING:
    from tarsus.orbits.starts import Box

Floats = NDArray[np.float64]

Seen = Mapping[str, Floats]
"""Measures (nr,) of runs by name, with ``energy`` that is drawn in a drive period [J], and ``weight`` [N]."""


@dataclass(frozen=True)
class WalkObjective:
    """One number of a walk.

    name: as typed; unit: SI; most: whether the largest is best; measures: of the walk that it is made of; of: the
    number (nr,); grounded: whether it depends on the ground at all; priced: whether it needs the drives' energy.
    """

    name: str
    unit: str
    most: bool
    doc: str
    measures: tuple[str, ...]
    of: Callable[[Seen], Floats]
    grounded: bool = True
    priced: bool = False

    def cost(self, values: Floats) -> Floats:
        """Of values, so that the least is best; infinite where there is none."""
        return np.where(np.isnan(values), np.inf, -values if self.most else values)

    def value(self, costs: Floats) -> Floats:
        """Of costs."""
        return -costs if self.most else costs


def _transport(seen: Seen) -> Floats:
    way = np.abs(seen["stride"]) * seen["weight"]
    return np.divide(seen["energy"], way, out=np.full(len(way), np.inf), where=way > 0.0)


def _plain(name: str, unit: str, doc: str, *, most: bool, measure: str) -> WalkObjective:
    return WalkObjective(name, unit, most, doc, (measure,), lambda seen: seen[measure])


OBJECTIVES = {
    one.name: one
    for one in (
        _plain("speed", "m/s", "mean speed forward", most=True, measure="mean_speed"),
        WalkObjective(
            "energy", "J", False, "electrical energy that all drives draw in a drive period, one step of every leg",
            (), lambda seen: seen["energy"], grounded=False, priced=True,
        ),
        WalkObjective(
            "transport", "1", False, "cost of transport: energy of a drive period over weight times stride",
            ("stride",), _transport, priced=True,
        ),
        _plain("slip", "m", "path that a foot slides in contact in a drive period, mean of the feet", most=False,
               measure="foot_slip"),
        _plain("contact", "s", "time of a drive period that a foot is on the ground, mean of the feet (4.4.2)",
               most=True, measure="contact_duration"),
        _plain("support", "1", "share of the time that a foot is on the ground, mean of the feet", most=True,
               measure="duty_factor"),
        _plain("sway", "m", "highest minus lowest heave of the body in a drive period", most=False,
               measure="vertical_amplitude"),
    )
}  # fmt: skip
"""What a gait can be designed for, by name."""


def objectives_of(given: str | WalkObjective | Sequence[str | WalkObjective]) -> tuple[WalkObjective, ...]:
    """Objectives of names, or of one text with commas; raises InputError for unknown, repeated and too many ones."""
    given = (
        given.split(",") if isinstance(given, str) else [given] if isinstance(given, WalkObjective) else given
    )
    words = [word.strip() if isinstance(word, str) else word for word in given]
    names = [word if isinstance(word, str) else word.name for word in words]
    problems = [
        f"objective: there is none called '{name}'{nearest(name, OBJECTIVES)}"
        for name, word in zip(names, words, strict=True)
        if isinstance(word, str) and name not in OBJECTIVES
    ]
    problems += [
        f"objective: '{name}' is named twice" for name in dict.fromkeys(names) if names.count(name) > 1
    ]
    if not 1 <= len(words) <= 3:
        problems.append(
            f"objective: expected one to three, got {len(words)}: a front of more cannot be looked through"
        )
    if problems:
        raise InputError(problems)
    return tuple(OBJECTIVES[word] if isinstance(word, str) else word for word in words)


MOST_AT_ONCE = 8192
"""Runs of one batch; their events fit into memory however long they are."""


@dataclass
class Walks:
    """Runs of a walker in which its gait is given; counts them.

    unknowns: of the gait; objectives: what walks are scored by; duration [s]: of a run, of which the first third is
    transient; starts: of the robot, whose axes grounds may have among their paths; runs: how many have been made.
    """

    scene: Scene
    unknowns: GaitUnknowns
    objectives: tuple[WalkObjective, ...]
    duration: float
    threads: Workers = None
    starts: Box | None = None
    runs: int = 0

    def __post_init__(self) -> None:
        self._sessions = {False: Session(self.scene)}
        if self.starts is not None:
            self._sessions[True] = Session(self.starts.scene)

    def each(self, points: Floats, grounds: Mapping[str, Floats]) -> Floats:
        """Costs (nr, no) of gaits at points (nr, nu), each on its own ground, values (nr,) by path."""
        measures = tuple(dict.fromkeys(name for one in self.objectives for name in one.measures))
        seen = self.measured(points, grounds, measures)
        return np.stack([one.cost(one.of(seen)) for one in self.objectives], axis=1)

    def measured(
        self,
        points: Floats,
        grounds: Mapping[str, Floats],
        measures: Sequence[str],
        duration: float | None = None,
    ) -> dict[str, Floats]:
        """Measures (nr,) of gaits at points (nr, nu), each on its own ground, in walks of another duration [s] where
        one is given; with ``energy`` and ``weight``, where the objectives want them."""
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
        if measures:
            self.runs += len(points)
            started, own = self._placed(grounds)
            vary = {**self.unknowns.changes(points), **own}
            batch = self._sessions[started].batch(vary, duration, threads=self.threads)
            seen = {name: one.value for name, one in batch.measured(measures).items()}
        if any(one.priced for one in self.objectives):
            seen["energy"] = self.energies(points, unsaid=0.0)[1]
            seen["weight"] = self._weight(grounds, len(points))
        return seen

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
