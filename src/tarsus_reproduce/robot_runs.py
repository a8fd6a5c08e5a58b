"""Single runs behind the pictures of a robot's reproduction: over the ground, and high in the air."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.model.robot import Foot
from tarsus.model.scene import Scene
from tarsus.solve import Run, simulate
from tarsus_reproduce.reproduction import Progress
from tarsus_reproduce.robots import OBSERVED, SETTLE, drive_frequency, printed_rows, row_scene
from tarsus_reproduce.rows import PrintedRow

PERIODS = 4
"""Drive periods a run over the ground has at least after its transient."""
SAMPLES = 2400
"""Samples of the drive period from which a motion in the air is measured."""
AIR_GAP = 0.03
"""Gap of every foot [m] in the air: the source's "greater than 3 cm"."""
STEADY = 10.0
"""A run in the air is this long [s] at least: the slowest motion of the packaged robots decays to a thousandth in 4."""

AIR_DRIVES = {"hexapod": ((15.0, 20.0, 25.0, 30.0), None), "quadruped": ((8.0,), 15.0)}
"""Volts of the square waves of Figs 3.10 and 3.9, and their frequency [Hz] where the source prints it."""


@dataclass(frozen=True)
class RobotRun:
    """A run and what it is of; points: np that the source looks at."""

    title: str
    run: Run
    points: tuple[str, ...]

    @property
    def peak_to_peak(self) -> Floats:
        """Highest minus lowest displacement of every point (np,) [m] over the last drive period."""
        structure, end = self.run.scene.robot.structure, self.run.duration
        time = end - np.linspace(1.0, 0.0, SAMPLES + 1) / drive_frequency(self.run.scene)
        return np.ptp(np.array([structure.row(one) for one in self.points]) @ self.run.states(time).x, axis=1)


def robot_runs(
    robot: str, own: Scene, progress: Progress | None = None
) -> tuple[tuple[RobotRun, ...], tuple[RobotRun, ...]]:
    """Run what the figures of a robot show (Figs 3.19 to 3.22, 3.9 and 3.10), of a device that can bounce.

    Over the ground: the packaged rows of Table 3.2 and the bouncing foot, or, for a robot without a table, the
    device's own gap and amplitude as a square wave and all points. In the air: the square waves of `AIR_DRIVES`.
    """
    ground = _over_ground(robot, own)
    points = own.robot.structure.points if robot == "quadruped" else (_first_foot(own).point,)
    jobs, runs = ground + _in_air(robot, own), []
    for number, (title, scene, seconds) in enumerate(jobs):
        if progress is not None:
            progress(number, len(jobs), title)
        runs.append(RobotRun(title, simulate(scene, seconds), points))
    return tuple(runs[: len(ground)]), tuple(runs[len(ground) :])


def check_device(scene: Scene, name: str) -> None:
    """Raise InputError for a device that cannot bounce: no foot, no drive signal, or one that does not repeat."""
    problems = []
    if not scene.robot.feet:
        problems.append(f"device '{name}' has no foot that could bounce")
    if not scene.signals:
        problems.append(f"device '{name}' has no drive signal; give it one, such as a square wave")
    elif next(iter(scene.signals.values())).period is None:
        problems.append(f"the drive signal of device '{name}' does not repeat; a square or sine wave does")
    if problems:
        raise InputError(problems)


def _over_ground(robot: str, own: Scene) -> list[tuple[str, Scene, float]]:
    """Title, scene and duration [s] of every run over the ground."""
    jobs = []
    for printed in printed_rows(robot) or [_own_row(own)]:
        freq_hz = printed.freq_hz or drive_frequency(own)
        title = f"{printed.words}, {freq_hz:.4g} Hz"
        jobs.append((title, row_scene(own, printed.conditions), SETTLE + max(OBSERVED, PERIODS / freq_hz)))
    return jobs


def _own_row(own: Scene) -> PrintedRow:
    """The device's own gap and highest voltage as a square wave."""
    signal = next(iter(own.signals.values()))
    highest = abs(getattr(signal, "amplitude", math.nan)) + abs(getattr(signal, "offset", math.nan))
    return PrintedRow("square", highest, gap_um=_first_foot(own).gap * 1e6)


def _first_foot(scene: Scene) -> Foot:
    return next(iter(scene.robot.feet.values()))


def _in_air(robot: str, own: Scene) -> list[tuple[str, Scene, float]]:
    """The same of every run in the air: whole drive periods of `STEADY` at least."""
    volts, printed = AIR_DRIVES[robot]
    freq_hz, jobs = printed or drive_frequency(own), []
    for volt in volts:
        row = {"wave": "square", "volt_v": volt, "gap_um": 1e6 * AIR_GAP, "freq_hz": freq_hz}
        scene = with_values(row_scene(own, row), {f"robot.feet.{foot}.gap": AIR_GAP for foot in own.robot.feet})
        jobs.append((f"{volt:g} V, square, in the air", scene, math.ceil(STEADY * freq_hz) / freq_hz))
    return jobs
