"""Single runs behind the pictures of a robot's reproduction: over the ground, and high in the air."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

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
AIR_PERIODS = 2
"""Steady drive periods kept of a run in the air."""
SAMPLES = 2400
"""Samples of a drive period in the air."""
AIR_GAP = 0.03
"""Gap of every foot [m] in the air: the source's "greater than 3 cm"."""
STEADY, LONGEST = 1e-3, 10.0
"""A motion is steady when its start has decayed to this part, or after this long [s]."""

AIR_DRIVES = {"hexapod": ((15.0, 20.0, 25.0, 30.0), None), "quadruped": ((8.0,), 15.0)}
"""Volts of the square waves of Figs 3.10 and 3.9, and their frequency [Hz] where the source prints it."""


@dataclass(frozen=True)
class Near:
    """A run over the ground."""

    title: str
    run: Run


@dataclass(frozen=True)
class AirRun:
    """A run under a square wave of volt_v [V] and freq_hz [Hz] with no ground in reach; points: np that are shown."""

    volt_v: float
    freq_hz: float
    points: tuple[str, ...]
    run: Run

    @cached_property
    def steady(self) -> tuple[Floats, Floats, Floats]:
        """Times (nt,) in drive periods, volts (nt,) and displacements (np, nt) [m] of the last `AIR_PERIODS`."""
        turns = np.linspace(0.0, AIR_PERIODS, AIR_PERIODS * SAMPLES + 1)
        time = np.minimum(self.run.duration + (turns - AIR_PERIODS) / self.freq_hz, self.run.duration)
        structure, drive = self.run.scene.robot.structure, next(iter(self.run.scene.signals.values()))
        rows = np.array([structure.row(point) for point in self.points])
        return turns, drive.volts(time), rows @ self.run.states(time).x

    @property
    def peak_to_peak(self) -> Floats:
        """Highest minus lowest displacement of every point (np,) [m]."""
        return np.ptp(self.steady[2], axis=1)


def robot_runs(robot: str, own: Scene, progress: Progress | None = None) -> tuple[tuple[Near, ...], tuple[AirRun, ...]]:
    """Run what the figures of a robot show (Figs 3.19 to 3.22, 3.9 and 3.10), of a device that can bounce.

    Over the ground: the packaged rows of Table 3.2 and the bouncing foot, or, for a robot without a table, the
    device's own gap and amplitude as a square wave and all points. In the air: the square waves of `AIR_DRIVES`.
    """
    jobs = _over_ground(robot, own) + _in_air(robot, own)
    runs = []
    for number, (title, scene, seconds) in enumerate(jobs):
        if progress is not None:
            progress(number, len(jobs), title)
        runs.append(simulate(scene, seconds))
    volts, printed = AIR_DRIVES[robot]
    points = own.robot.structure.points if robot == "quadruped" else (_first_foot(own).point,)
    near = tuple(Near(title, run) for (title, *_), run in zip(jobs[: -len(volts)], runs, strict=False))
    frequency = printed or drive_frequency(own)
    air = zip(volts, runs[-len(volts) :], strict=True)
    return near, tuple(AirRun(volt, frequency, points, run) for volt, run in air)


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
    """The same of every run in the air: until transients have died out, and `AIR_PERIODS` more."""
    volts, printed = AIR_DRIVES[robot]
    freq_hz, jobs = printed or drive_frequency(own), []
    for volt in volts:
        row = {"wave": "square", "volt_v": volt, "gap_um": 1e6 * AIR_GAP, "freq_hz": freq_hz}
        scene = with_values(row_scene(own, row), {f"robot.feet.{foot}.gap": AIR_GAP for foot in own.robot.feet})
        seconds = (math.ceil(settling_time(scene) * freq_hz) + AIR_PERIODS) / freq_hz
        jobs.append((f"in the air, {volt:g} V", scene, seconds))
    return jobs


def settling_time(scene: Scene) -> float:
    """Time [s] in which the slowest free motion of the structure decays to `STEADY`, at most `LONGEST`."""
    m = scene.robot.structure.matrices()
    n = len(m.mass)
    state = np.zeros((2 * n, 2 * n))
    state[:n, n:] = np.eye(n)
    state[n:] = -np.linalg.solve(m.mass, np.hstack([m.stiffness, m.damping]))
    slowest = float(-np.linalg.eigvals(state).real.max())
    return min(-math.log(STEADY) / slowest, LONGEST) if slowest > 0.0 else LONGEST
