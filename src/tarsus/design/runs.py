"""Runs of many candidates on many grounds, as one batch, and what they are judged by."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.base.workers import Workers
from tarsus.design.energy import RECOVERY, energies, period_rises
from tarsus.design.measures import ENERGY, TRANSPORT, DesignLimit, DesignObjective, parts_of
from tarsus.measure.switching import rise_squares
from tarsus.model.drive.waveforms import Constant
from tarsus.model.scene import Scene
from tarsus.solve import Session

if TYPE_CHECKING:
    from tarsus.design.free import Free
    from tarsus.orbits.starts import Box
    from tarsus.solve import Batch

Floats = NDArray[np.float64]

MOST_AT_ONCE = 8192
"""Runs of one batch; their events fit into memory however long they are."""


@dataclass
class Runs:
    """Runs of a scene in which what is free is given, rows (n, np) of values; counts them.

    objectives: what runs are scored by; limits: what they have to keep; duration [s]: of a run; skip: drive periods
    that are left out, the first third unless given; starts: of the robot, whose axes grounds may have among their
    paths; made: how many.
    """

    free: Free
    objectives: tuple[DesignObjective, ...]
    duration: float
    threads: Workers = None
    starts: Box | None = None
    limits: tuple[DesignLimit, ...] = ()
    skip: int | None = None
    made: int = 0

    def __post_init__(self) -> None:
        self._sessions = {False: Session(self.scene)}
        if self.starts is not None:
            self._sessions[True] = Session(self.starts.scene)

    @property
    def scene(self) -> Scene:
        """The scene that has what is free."""
        return self.free.scene

    def each(self, rows: Floats, grounds: Mapping[str, Floats]) -> Floats:
        """Costs (nr, no) of candidates (nr, np), each on its own ground, values (nr,) by path; where there are limits,
        with a last column that is 1 where they are kept, and more the farther a run is beyond them."""
        found = self.measured(rows, grounds, [one.measure for one in self.objectives])
        costs = [one.cost(found[one.measure]) for one in self.objectives]
        if self.limits:
            beyond = [one.beyond(found[one.measure]) for one in self.limits]
            costs.append(1.0 + np.max(beyond, axis=0))
        return np.stack(costs, axis=1)

    def measured(
        self, rows: Floats, grounds: Mapping[str, Floats], measures: Sequence[str], duration: float | None = None
    ) -> dict[str, Floats]:
        """Measures (nr,) of candidates (nr, np), each on its own ground, and those that limits are on, in runs of
        another duration [s] where one is given."""
        measures = tuple(dict.fromkeys([*measures, *(one.measure for one in self.limits)]))
        parts = [
            self._some(
                rows[i : i + MOST_AT_ONCE], {p: v[i : i + MOST_AT_ONCE] for p, v in grounds.items()}, measures, duration
            )
            for i in range(0, len(rows), MOST_AT_ONCE)
        ]
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}

    def _some(
        self, rows: Floats, grounds: Mapping[str, Floats], measures: Sequence[str], duration: float | None
    ) -> dict[str, Floats]:
        seen: dict[str, Floats] = {}
        of_runs = ["stride" if name == TRANSPORT else name for name in measures if name != ENERGY]
        if of_runs:
            options = {} if duration is not None or self.skip is None else {"skip": self.skip}
            names = dict.fromkeys(parts_of(name)[0] for name in of_runs)
            found = self.batch(rows, grounds, duration).measured(names, **options)
            feet = list(self.scene.robot.feet)
            for full in of_runs:
                name, foot = parts_of(full)
                one = found[name]
                seen[full] = one.value if one.per_foot is None or not foot else one.per_foot[:, feet.index(foot)]
        if {ENERGY, TRANSPORT} & set(measures):
            seen[ENERGY] = self.energies(rows, unsaid=0.0)[1]
        if TRANSPORT in measures:
            way = np.abs(seen["stride"]) * self._weight(grounds, len(rows))
            seen[TRANSPORT] = np.divide(seen[ENERGY], way, out=np.full(len(way), np.inf), where=way > 0.0)
        return seen

    def batch(self, rows: Floats, grounds: Mapping[str, Floats], duration: float | None = None) -> Batch:
        """Runs (nr,) of candidates (nr, np), each on its own ground."""
        self.made += len(rows)
        started, own = self._placed(grounds)
        vary = {**dict(zip(self.free.paths, np.ascontiguousarray(rows.T), strict=True)), **own}
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

    def energies(self, rows: Floats, unsaid: float = RECOVERY) -> tuple[Floats, Floats]:
        """Energy (n,) [J] of all drives in a drive period, plain and with charge recovery, where drives that do not
        say recover the share ``unsaid``."""
        drives, squares = self.scene.robot.drives.values(), self._rises(rows)
        each = [energies(drive, own, unsaid) for drive, own in zip(drives, squares.T, strict=True)]
        plain, recovered = np.sum(each, axis=0)
        return plain, recovered

    def _rises(self, rows: Floats) -> Floats:
        """Sums (n, nd) [V^2] of the squared rises of every drive's volts in a drive period."""
        values = dict(zip(self.free.paths, rows.T, strict=True))
        gait, layout = self.scene.gait, self.scene.robot.layout()
        if gait is not None and layout is not None and self._switched():
            low, high = (values.get(f"gait.{end}", getattr(gait, end)) for end in ("low", "high"))
            moved = [
                name in gait.waveforms(layout) and name not in self.scene.signals for name in self.scene.robot.drives
            ]
            return np.outer(np.broadcast_to((high - low) ** 2, len(rows)), np.array(moved, dtype=float))
        train = self.free.pulses
        if train is not None and list(self.scene.robot.drives) == [train.drive] and not self.free.tied:
            return period_rises(np.split(rows, 2, axis=1)[0])[:, None]
        rows, which = np.unique(rows, axis=0, return_inverse=True)
        return np.array([_period_rises(self.scene_of(row)) for row in rows])[which.ravel()]

    def _switched(self) -> bool:
        """Whether every drive's volts are the gait's square wave, as it is, or do not change."""
        return (
            all(path.startswith("gait.") for path in self.free.paths)
            and all(isinstance(wave, Constant) for wave in self.scene.signals.values())
            and all(drive.amplifier.ideal for drive in self.scene.robot.drives.values())
        )

    def changes(self, row: Floats) -> dict[str, float]:
        """Values by path of a candidate (np,)."""
        return dict(zip(self.free.paths, row.tolist(), strict=True))

    def scene_of(self, row: Floats, ground: Mapping[str, float] | None = None) -> Scene:
        """The scene with a candidate (np,), on a ground with other values by path, placed as these say; it lasts as
        long as runs do."""
        started, own = self._placed({path: np.array([value]) for path, value in (ground or {}).items()})
        placed = {path: float(value[0]) for path, value in own.items()}
        scene = self._sessions[started].scene
        return with_values(scene, {**self.changes(row), **placed, "duration": self.duration})


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
        for name in gone
        for leg in layout.drives[name].legs
        if leg not in dead
    ]
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
