"""Derivatives of a step of a robot: by numbers of the scene, by the command and by the state that it begins with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.spec import get_value, with_values
from tarsus.model.drive.signal import Signal
from tarsus.plan.lowering import Kind, lower_scene, slot
from tarsus.plan.rows import Rows
from tarsus.solve.commands import Command
from tarsus.solve.differences import directions_of
from tarsus.solve.window import Window, WindowStart, simulate_windows
from tarsus.solve.window_gradients import Entered, ScenePair, WindowGradients

if TYPE_CHECKING:
    from tarsus.model.scene import Scene
    from tarsus.plan.lowering import Plan
    from tarsus.solve.stepping import SteppedRobots

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class StepSlopes:
    """First derivatives of a step by P numbers: the paths asked for, ``drive.NAME`` of every drive that was given a
    voltage, ``state.0`` to ``state.{2n - 1}`` of the state that it began with.

    names (P,); state (2n, P): of the displacements and velocities at its end, NaN behind an event that has none; error
    (2n, P): their errors; window: the step as a window, whose events have derivatives too
    (`tarsus.solve.window.Window.event_slopes`) and whose ``flags`` say by name why there are none.
    """

    names: tuple[str, ...]
    state: Floats
    error: Floats
    window: Window

    def by(self, name: str) -> Floats:
        """Derivatives (2n,) of the state at the end by one number. Raises KeyError for one that was not asked for."""
        if name not in self.names:
            raise KeyError(name)
        return self.state[:, self.names.index(name)]

    @property
    def by_state(self) -> Floats:
        """Derivatives (2n, 2n) of the state at the end by that at the begin."""
        return self.state[:, len(self.names) - len(self.state) :]

    @property
    def flags(self) -> Mapping[str, tuple[str, ...]]:
        """Why derivatives by a number are not to be had, by name; none as a rule."""
        return self.window.flags


@dataclass(frozen=True)
class StepAsked:
    """A step of one robot: commands of its drives, of which ``drive`` are given now, how long [s] it takes, and whether
    voltages are reached by ramps."""

    robots: SteppedRobots
    commands: Mapping[str, Command]
    drive: Mapping[str, Any]
    seconds: float
    ramp: bool

    def row(self, values: Mapping[str, float], drive: Mapping[str, float]) -> Rows:
        """The robot's row of data where numbers of its drives, by path, and commanded voltages are others."""
        robots = copy(self.robots)
        robots._rows = None
        robots.values = robots.values | {path: np.array([value]) for path, value in values.items()}
        again = self.drive if values else drive
        commands = {
            name: robots.command(name, drive.get(name, self.drive[name]), self.seconds, ramp=self.ramp)
            for name in again
        }
        return robots.driven_row({**self.commands, **commands})


def step_slopes(step: StepAsked, paths: Sequence[str]) -> StepSlopes:
    """Those of a step of one robot.

    Raises InputError for several robots, and for numbers of signals, which a command has taken the place of.
    """
    robots, runs = step.robots, step.robots.runs
    if len(robots) != 1:
        raise InputError("gradients: a step of one robot has derivatives; fork a session for each")
    scene = with_values(robots.scene, {path: float(of[0]) for path, of in robots.values.items()})
    signals = [path for one in directions_of(scene, paths).values() for path in one if _of_signal(scene, path)]
    if signals:
        raise InputError(
            [f"{path}: a step has derivatives by its command, not by numbers of its signals" for path in signals]
        )
    plan, end = lower_scene(scene, robots.shared.drive), float(runs.time[0] + step.seconds)
    start = WindowStart(runs.state[0], float(runs.time[0]), [end], runs.feet[0])
    by = WindowGradients((_entered(step, scene, plan, paths),), t0=False)
    (window,) = simulate_windows(plan, [start], gradients=by, shared=runs.tables, accuracy=runs.accuracy)
    slopes = window.slopes
    assert slopes is not None
    state, error = (np.concatenate([of.x[:, -1], of.v[:, -1]]) for of in (slopes.states, slopes.state_errors))
    return StepSlopes(slopes.names, state, error, window)


def _of_signal(scene: Scene, path: str) -> bool:
    place = slot(scene, path)
    return place is not None and place.kind in (Kind.DRIVE, Kind.GAIT) and not _of_drive(path)


def _of_drive(path: str) -> bool:
    return path.startswith("robot.drives.")


def _entered(step: StepAsked, scene: Scene, plan: Plan, paths: Sequence[str]) -> Entered:
    """What enters the step: by paths of the scene, then by the commanded voltages of drives."""
    own, row = Entered.of(scene, plan, paths), step.row({}, {})
    ways = {
        name: {path: w for path, w in one.items() if _of_drive(path) and slot(scene, path) is not None}
        for name, one in directions_of(scene, paths).items()
    }
    levels = {
        f"drive.{name}": (name, float(np.asarray(of).reshape(-1)[0]))
        for name, of in step.drive.items()
        if not isinstance(of, (Signal, Sequence))
    }

    def moved(name: str, place: float) -> Rows:
        values = {path: float(get_value(scene, path)) + place * w for path, w in ways[name].items()}
        return step.row(values, {}) if values else row

    def commanded(name: str, part: float) -> ScenePair:
        drive, level = levels[name]
        places = np.array([-1.0, 1.0]) * part * (abs(level) or 1.0)
        return ScenePair(places, tuple((None, step.row({}, {drive: level + by})) for by in places.tolist()))

    def perturbed(names: Sequence[str], part: float) -> dict[str, ScenePair]:
        found = own.perturbed([name for name in names if name not in levels], part)
        out = {
            name: ScenePair(
                of.places,
                tuple(
                    (other, _on(moved(name, at), copied))
                    for at, (other, copied) in zip(of.places.tolist(), of.copies, strict=True)
                ),
            )
            for name, of in found.items()
        }
        return out | {name: commanded(name, part) for name in names if name in levels}

    return Entered(row, (*own.names, *levels), perturbed)


def _on(row: Rows, ground: Rows) -> Rows:
    """A row on the ground, and in the laws, of another."""
    return replace(row, **{name: getattr(ground, name) for name in ("parameters", "sources", "profile")})
