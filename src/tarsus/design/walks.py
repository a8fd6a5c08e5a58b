"""Walks of many gaits on many grounds, as one batch, and what they are worth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.base.workers import Workers
from tarsus.design.energy import RECOVERY
from tarsus.design.gait_unknowns import GaitUnknowns
from tarsus.design.walk_objectives import WalkObjective
from tarsus.measure.switching import charging_energy
from tarsus.model.drive.waveforms import Constant
from tarsus.model.scene import Scene
from tarsus.solve.session import Session

__all__ = ["Walks", "without_legs"]

Floats = NDArray[np.float64]

MOST_AT_ONCE = 8192
"""Runs of one batch; their events fit into memory however long they are."""


@dataclass
class Walks:
    """Runs of a walker in which its gait is given; counts them.

    unknowns: of the gait; objectives: what walks are scored by; duration [s]: of a run, of which the first third is
    transient; runs: how many have been made.
    """

    scene: Scene
    unknowns: GaitUnknowns
    objectives: tuple[WalkObjective, ...]
    duration: float
    threads: Workers = None
    runs: int = 0

    def __post_init__(self) -> None:
        self._session = Session(self.scene)

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
            vary = {**self.unknowns.changes(points), **grounds}
            batch = self._session.batch(vary, duration, threads=self.threads)
            seen = {name: one.value for name, one in batch.measured(measures).items()}
        if any(one.priced for one in self.objectives):
            seen["energy"] = self.energy(points)
            seen["weight"] = self._weight(grounds, len(points))
        return seen

    def _weight(self, grounds: Mapping[str, Floats], count: int) -> Floats:
        gravity = self.scene.ground.gravity
        if gravity is None:
            return np.zeros(count)
        own = grounds.get("ground.gravity.acceleration", np.full(count, gravity.acceleration))
        return own * self.scene.robot.structure.total_mass  # pyright: ignore[reportAttributeAccessIssue]

    def energy(self, points: Floats) -> Floats:
        """Energy (n,) [J] that all drives draw in a drive period, as the measure ``electrical_energy`` has it."""
        values = self.unknowns.changes(points)
        if self._switched(values):
            gait, layout = self.scene.gait, self.scene.robot.layout()
            assert gait is not None and layout is not None
            low: Any = values.get("gait.low", gait.low)  # pyright: ignore[reportArgumentType]
            high: Any = values.get("gait.high", gait.high)  # pyright: ignore[reportArgumentType]
            drives = [
                self.scene.robot.drives[name]
                for name in gait.waveforms(layout)
                if name not in self.scene.signals
            ]
            share = sum((one.capacitance or np.nan) * (1.0 - (one.recovery or 0.0)) for one in drives)
            return np.broadcast_to(share * (high - low) ** 2, len(points)).astype(float)
        rows, which = np.unique(points, axis=0, return_inverse=True)
        return np.array([_drawn(self.scene_of(row)) for row in rows])[which.ravel()]

    def recovered_share(self) -> float:
        """Energy with charge recovery over that of plain on-off switching, where all drives recover alike."""
        given = {drive.recovery for drive in self.scene.robot.drives.values()}
        own = given.pop() if len(given) == 1 else None
        return 1.0 - (RECOVERY if own is None else own)

    def _switched(self, values: Mapping[str, Floats]) -> bool:
        """Whether every drive's volts are the gait's square wave, as it is, or do not change."""
        return (
            self.scene.gait is not None
            and all(path.startswith("gait.") for path in values)
            and all(isinstance(wave, Constant) for wave in self.scene.signals.values())
            and all(drive.amplifier.ideal for drive in self.scene.robot.drives.values())
        )

    def changes(self, point: Floats) -> dict[str, float]:
        """Values by path of the gait at a point (nu,)."""
        return {path: float(column[0]) for path, column in self.unknowns.changes(point[None]).items()}

    def scene_of(self, point: Floats, ground: Mapping[str, float] | None = None) -> Scene:
        """The scene with the gait at a point (nu,), on a ground with other values by path."""
        return with_values(self.scene, {**self.changes(point), **(ground or {})})


def _drawn(scene: Scene) -> float:
    signals = scene.actuator_volts
    period = max((wave.period or 0.0 for wave in scene.waveforms.values()), default=0.0)
    edges = np.array([period, 2.0 * period])
    return float(
        sum(charging_energy(drive, signals[name], edges)[0] for name, drive in scene.robot.drives.items())
    )


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
