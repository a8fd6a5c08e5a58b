"""Where runs start that are to tell what a robot does in the long run: a box of starts, and points spread over it.

    x(0) = x0 + h u,   v(0) = v0 + s u,   u: feet lifted by 1 m

`height` h and `speed` s lift and throw the robot as a whole: a body that is free upwards rises as it is, one that
springs hold is bent as a force on its feet bends it. Everything else that a start consists of goes by its path.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.base.spec import float_paths, get_value, with_values
from tarsus.base.units import parse_quantity
from tarsus.model.drive.waveforms import Constant
from tarsus.model.scene import Initial
from tarsus.orbits.returns import drive_period
from tarsus.plan.lowering import Plan, lower_scene
from tarsus.tables.numbers import amount

if TYPE_CHECKING:
    from tarsus.model.scene import Scene

Floats = NDArray[np.float64]

HEIGHT, SPEED = "height", "speed"
UNITS = {HEIGHT: "m", SPEED: "m/s"}
"""The two numbers of a start that are no paths of a scene."""

WATCHED = 24
"""Drive periods of the scene's own run, in whose second half the box's height is seen."""


@dataclass(frozen=True)
class Box:
    """Starts of a scene. scene: with its initial displacements and velocities as numbers; ends: of every axis [SI], by
    `height`, `speed` or a path; lift (n,): displacements of a robot whose feet are lifted by 1 m."""

    scene: Scene
    ends: Mapping[str, tuple[float, float]]
    lift: Floats

    @classmethod
    def of(cls, scene: Scene, over: Mapping[str, tuple[Any, Any]] | None) -> Box:
        """The box between given ends, numbers [SI] or texts with a unit; without them of heights up to that of the feet
        in a run of the scene, and of speeds, up and down, that carry it there.

        Raises InputError for a path that is no part of a start, and for ends that its number cannot have.
        """
        plan = lower_scene(scene)
        displacement, velocity = np.split(np.asarray(plan.initial, dtype=float), 2)
        initial = Initial(displacement=tuple(displacement.tolist()), velocity=tuple(velocity.tolist()))
        explicit = scene.model_copy(update={"initial": initial})
        lift = _lift(plan)
        if over is None:
            return cls(explicit, _usual(explicit, plan, lift), lift)
        problems, ends = [], {}
        for path, pair in over.items():
            try:
                low, high = (_number(explicit, path, one) for one in pair)
            except InputError as error:
                problems += [said if path in said else f"{path}: {said}" for said in error.problems]
                continue
            ends[path] = (low, high)
        box = cls(explicit, ends, lift)
        problems += [
            f"{path}: the range from {amount(low, unit)} to {amount(high, unit)} is empty"
            for (path, (low, high)), unit in zip(ends.items(), box.units().values(), strict=True)
            if not low < high
        ]
        if problems:
            raise InputError(problems)
        return box

    def values(self, points: Floats) -> dict[str, Floats]:
        """Values (nr,) [SI] by path of the starts at points (nr, d) of the unit cube."""
        return self.placed(
            {
                path: low + (high - low) * points[:, i]
                for i, (path, (low, high)) in enumerate(self.ends.items())
            }
        )

    def placed(self, along: Mapping[str, Floats]) -> dict[str, Floats]:
        """Values (nr,) [SI] by path of the starts with values (nr,) [SI] by axis."""
        out = {path: one for path, one in along.items() if path not in UNITS}
        for axis, of in ((HEIGHT, "displacement"), (SPEED, "velocity")):
            for i in np.flatnonzero(self.lift) if axis in along else ():
                path = f"initial.{of}.{i}"
                out[path] = out.get(path, get_value(self.scene, path)) + along[axis] * self.lift[i]
        return out

    def units(self) -> dict[str, str]:
        """Unit of every axis."""
        known = float_paths(self.scene)
        return {path: UNITS[path] if path in UNITS else known[path].unit for path in self.ends}

    def drawn(self, count: int, seed: int) -> Floats:
        """Points (count, d) spread evenly over the unit cube (Halton, scrambled)."""
        from scipy.stats.qmc import Halton

        return np.asarray(Halton(len(self.ends), seed=seed).random(count))  # pyright: ignore[reportCallIssue]

    @property
    def own(self) -> Floats:
        """The scene's own start, as a point (1, d) of the unit cube or beyond."""
        ends = np.array(list(self.ends.values())).T
        values = [0.0 if path in UNITS else get_value(self.scene, path) for path in self.ends]
        return ((np.array(values, dtype=float) - ends[0]) / (ends[1] - ends[0]))[None]

    def late(self, values: Mapping[str, Floats], count: int) -> Floats:
        """By how much [s] the drive of each of so many runs is ahead, whose phase varies; else 0."""
        out = np.zeros(count)
        for path, phases in values.items():
            if path.endswith(".phase"):
                out = phases / (2.0 * math.pi) * drive_period(self.scene)
        return out


def _lift(plan: Plan) -> Floats:
    """Displacements (n,) that lift the feet by 1 m in the mean: of a free body as it is, else bent by forces there."""
    system = plan.system
    mass, stiffness, feet = (
        np.asarray(one, dtype=float) for one in (system.mass, system.stiffness, system.normals)
    )
    up = -np.linalg.solve(mass, np.asarray(system.weight[:, 0], dtype=float))
    bent = float(up @ stiffness @ up) > RIGID * float(up**2 @ np.diag(stiffness)) or not up.any()
    shape = np.linalg.lstsq(stiffness, feet.sum(axis=1), rcond=None)[0] if bent else up
    raised = float((shape @ feet).mean()) if feet.shape[1] else float(np.abs(shape).max(initial=0.0))
    return shape / raised if raised else shape


RIGID = 1e-9
"""Share of what springs would hold if they did not move together, below which they are not strained."""


def _usual(scene: Scene, plan: Plan, lift: Floats) -> dict[str, tuple[float, float]]:
    """Heights up to those of the feet in a run of the scene, and speeds, up and down, that carry it as high."""
    from tarsus.solve.trajectories import Trajectories

    system, period = plan.system, drive_period(scene)
    times = np.asarray(period * (np.arange(WATCHED * 8) + 0.5) / 8.0, dtype=np.float64)
    runs = Trajectories.of(scene, {}, (WATCHED + 1) * period)
    (window,) = runs.advance([times])
    gaps = window.states.gap[:, len(times) // 2 :]
    rest = float(np.asarray(system.sources)[: plan.feet].max(initial=0.0))
    mass, weight = float(lift @ system.mass @ lift), -float(system.weight[:, 0] @ lift)
    height = max(float(gaps.max(initial=0.0)), rest)
    if height <= plan.length:  # it stays on the ground: as high as a flight of one period
        height = max(weight / mass * period**2 / 8.0, plan.length)
    work = height**2 * float(lift @ system.stiffness @ lift) + 2.0 * height * weight
    speed = math.sqrt(max(work, 0.0) / mass) or height / period
    return {HEIGHT: (0.0, height), SPEED: (-speed, speed)}


def _number(scene: Scene, path: str, given: Any) -> float:
    """An end of an axis [SI]."""
    if path in UNITS:
        return parse_quantity(given, UNITS[path]) if isinstance(given, str) else float(given)
    known = [*UNITS, *(one for one in float_paths(scene) if _starts(one, scene))]
    if path not in known:
        told = "is no part of a start" if path in float_paths(scene) else "unknown path"
        raise InputError([f"{path}: {told} (a start is {HEIGHT}, {SPEED}, initial.*, a drive's history, and the phase "
                          f"of a scene's only drive){nearest(path, known)}"])  # fmt: skip
    return float(get_value(with_values(scene, {path: given}), path))


def _starts(path: str, scene: Scene) -> bool:
    """Whether a number says how a run starts, and nothing of what the robot or its drive is."""
    keys = path.split(".")
    driven = [name for name, wave in scene.waveforms.items() if not isinstance(wave, Constant)]
    return (
        keys[0] == "initial"
        or (keys[:2] == ["robot", "drives"] and keys[3] == "history")
        or (keys[0] == "signals" and keys[2:] == ["phase"] and driven == [keys[1]])
    )
