"""Derivatives of a step of a robot: by numbers of the scene, by the command and by the state that it begins with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.dual import Dual
from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.model.drive.lower import lower_track
from tarsus.model.drive.signal import Signal
from tarsus.plan.channels import SlopedDrive, channel_slopes
from tarsus.plan.lowering import Kind, lower_scene, slot
from tarsus.solve.commands import Command, course
from tarsus.solve.tangents import DataTangents, Entering, add_drive, entering
from tarsus.solve.window import Window, WindowGradients, simulate_window

if TYPE_CHECKING:
    from tarsus.solve.stepping import SteppedRobots

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class StepSlopes:
    """First derivatives of a step by P numbers: the paths asked for, ``drive.NAME`` of every drive that was told a
    voltage, ``state.0`` to ``state.{2n - 1}`` of the state that it began with.

    names (P,); state (2n, P): of the displacements and velocities at its end, NaN behind an event that has none;
    window: the step as a window, whose events have derivatives too (`tarsus.solve.window.Window.event_slopes`) and
    whose ``flags`` say by name why there are none.
    """

    names: tuple[str, ...]
    state: Floats
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


def step_slopes(
    robots: SteppedRobots,
    told: Mapping[str, Command],
    drive: Mapping[str, Any],
    seconds: float,
    paths: Sequence[str],
) -> StepSlopes:
    """Those of a step of one robot under commands, of which ``drive`` are told now. Raises InputError for several
    robots, paths by which there is no derivative, and voltages behind an amplifier that is not ideal, or of a drive
    that creeps."""
    if len(robots) != 1:
        raise InputError("gradients: a step of one robot has derivatives; fork a session for each")
    scene = with_values(robots.scene, {path: float(of[0]) for path, of in robots.values.items()})
    if wrong := [path for path in paths if _moves_drives(scene, path)]:
        raise InputError(
            [f"{path}: a step has derivatives by its command, not by numbers of its drives" for path in wrong]
        )
    plan = lower_scene(scene, robots.shared.drive)
    row, runs = robots.driven_row(told), robots.runs
    own = entering(scene, plan, paths, runs.longest)
    by_command = {name: of for name, of in drive.items() if not isinstance(of, (Signal, Sequence))}
    data = DataTangents.none(row, len(paths) + len(by_command))
    for name in ("parameters", "sources", "profile"):
        getattr(data, name)[..., : len(paths)] = getattr(own.data, name)
    for k, name in enumerate(by_command):
        moved = _told(robots, told[name], name, len(paths) + k, len(paths) + len(by_command))
        add_drive(data, row, plan, list(scene.robot.drives).index(name), moved)
    names = (*paths, *(f"drive.{name}" for name in by_command))
    entered = Entering(names, row, data, own.structure, own.perturbed)
    end = float(runs.time[0] + seconds)
    window = simulate_window(
        plan, runs.state[0], float(runs.time[0]), [end], runs.feet[0],
        gradients=WindowGradients((entered,), state=True, t0=False), shared=runs.tables, accuracy=runs.accuracy,
    )  # fmt: skip
    slopes = window.slopes
    assert slopes is not None
    state = np.concatenate([slopes.states.x[:, -1], slopes.states.v[:, -1]])
    return StepSlopes(slopes.names, state, window)


def _moves_drives(scene: Any, path: str) -> bool:
    place = slot(scene, path)
    return place is not None and place.kind in (Kind.DRIVE, Kind.GAIT)


def _told(robots: SteppedRobots, command: Command, name: str, number: int, count: int) -> SlopedDrive:
    """A drive that is told a voltage, with its derivative by that as one number of so many."""
    drive = robots.drive(name)
    if not drive.amplifier.ideal:
        raise InputError(
            f"drive.{name}: behind an amplifier a command has no derivative; step by ramps without one"
        )
    if drive.law.by_rate:
        raise InputError(
            f"drive.{name}: a command of a drive that creeps has no derivative; hold it in this step"
        )
    charged = list(robots.scene.robot.drives).index(name) in robots.runs.plan.charged
    level = Dual(command.asked.last[-1:], np.eye(count)[number][None])
    ramp = command.asked.first[0] != command.asked.last[0]
    track = course(level, command.asked.first[:1], float(command.asked.end[0]), bool(ramp))
    force, volts = lower_track(track, drive.law, tuple(command.past.T), volts=charged)
    none = np.zeros(count)
    return SlopedDrive(
        channel_slopes(force, count),
        channel_slopes(volts, count) if charged and volts is not None else None,
        None,
        none,
    )
