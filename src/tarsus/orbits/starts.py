"""Where runs start that are to show what a robot does in the long run: a box of starts, and points spread over it.

    x(0) = x0 + h u,   v(0) = v0 + s u,   u: feet lifted by 1 m

`height` h and `speed` s lift and throw the robot as a whole: a body that is free upwards rises as it is, one that
springs hold is bent as a force on its feet bends it. Where it would be below uneven ground it is lifted onto it.
`phase` is where in their common period all drives are when it starts. Everything else that a start consists of goes by
its path.
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
from tarsus.model.drive.gait import CustomGait
from tarsus.model.drive.waveforms import Constant
from tarsus.model.drive.waveforms.periodic import Periodic
from tarsus.model.scene import Initial
from tarsus.orbits.returns import drive_period
from tarsus.plan.lowering import Plan, lower_scene
from tarsus.tables.numbers import amount

if TYPE_CHECKING:
    from tarsus.model.scene import Scene

Floats = NDArray[np.float64]

HEIGHT, SPEED, PHASE = "height", "speed", "phase"
UNITS = {HEIGHT: "m", SPEED: "m/s", PHASE: "rad"}
"""The numbers of a start that are no paths of a scene."""

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
        initial = Initial(
            displacement=tuple(displacement.tolist()),
            velocity=tuple(velocity.tolist()),
            lifted=scene.ground.profile is not None,
        )
        explicit = scene.model_copy(update={"initial": initial})
        lift = _lift(plan)
        if over is None:
            return cls(explicit, _usual(explicit, plan, lift), lift)
        if PHASE in over:
            explicit = _with_phases(explicit)
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
            {path: low + (high - low) * points[:, i] for i, (path, (low, high)) in enumerate(self.ends.items())}
        )

    def placed(self, along: Mapping[str, Floats]) -> dict[str, Floats]:
        """Values (nr,) [SI] by path of the starts with values (nr,) [SI] by axis."""
        out = {path: one for path, one in along.items() if path not in UNITS}
        for axis, of in ((HEIGHT, "displacement"), (SPEED, "velocity")):
            for i in np.flatnonzero(self.lift) if axis in along else ():
                path = f"initial.{of}.{i}"
                out[path] = out.get(path, get_value(self.scene, path)) + along[axis] * self.lift[i]
        return out | _ahead(self.scene, along[PHASE]) if PHASE in along else out

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
        span = ends[1] - ends[0]
        return ((np.array(values, dtype=float) - ends[0]) / np.where(span > 0.0, span, 1.0))[None]

    def late(self, points: Floats) -> Floats:
        """By how much [s] the drives of each start (nr, d) are ahead of the scene's own."""
        low, high = self.ends.get(PHASE, (0.0, 0.0))
        turned = points[:, list(self.ends).index(PHASE)] if PHASE in self.ends else np.zeros(len(points))
        return (low + (high - low) * turned) / (2.0 * math.pi) * drive_period(self.scene)


def _with_phases(scene: Scene) -> Scene:
    """The scene with a gait whose legs have a phase each. Raises InputError where a drive's signal has none."""
    problems = [
        f"{PHASE}: signals.{name} is {type(wave).__name__}, which has no phase"
        for name, wave in scene.signals.items()
        if not isinstance(wave, (Constant, Periodic))
    ]
    if problems:
        raise InputError(problems)
    layout = scene.robot.layout()
    if scene.gait is None or layout is None:
        return scene
    numbers = scene.gait.model_dump(exclude={"kind", "phases"})
    return scene.model_copy(update={"gait": CustomGait(**numbers, phases=scene.gait.delays(layout))})


def _ahead(scene: Scene, phase: Floats) -> dict[str, Floats]:
    """Values (nr,) by path of a scene's drives that are ahead by phases (nr,) [rad] of their common period."""
    turns = phase / (2.0 * math.pi) * drive_period(scene)
    out = {
        f"signals.{name}.phase": wave.phase + 2.0 * math.pi * wave.frequency * turns
        for name, wave in scene.signals.items()
        if isinstance(wave, Periodic)
    }
    if isinstance(scene.gait, CustomGait):
        out |= {f"gait.phases.{leg}": late - scene.gait.frequency * turns for leg, late in scene.gait.phases.items()}
    return out


def _lift(plan: Plan) -> Floats:
    """Displacements (n,) that lift the feet by 1 m in the mean: of a free body as it is, else bent by forces there.

    Where feet face each other so that no lift is one of all, it is that of the first.
    """
    system = plan.system
    mass, stiffness, feet = (np.asarray(one, dtype=float) for one in (system.mass, system.stiffness, system.normals))
    if np.abs(feet.sum(axis=1)).max(initial=0.0) <= RIGID * np.abs(feet).max(initial=0.0):
        feet = feet[:, :1]
    up = -np.linalg.solve(mass, np.asarray(system.weight[:, 0], dtype=float))
    bent = float(up @ stiffness @ up) > RIGID * float(up**2 @ np.diag(stiffness)) or not up.any()
    shape = np.linalg.lstsq(stiffness, feet.sum(axis=1), rcond=None)[0] if bent else up
    raised = float((shape @ feet).mean()) if feet.shape[1] else float(np.abs(shape).max(initial=0.0))
    return shape / raised if raised else shape


RIGID = 1e-9
"""Share of what springs would hold if they did not move together, below which they are not strained; and of a foot's
normal, below which normals cancel."""


def _usual(scene: Scene, plan: Plan, lift: Floats) -> dict[str, tuple[float, float]]:
    """Heights up to those of the feet in a run of the scene, and speeds, up and down, that carry it as high; no height
    that takes a foot below its ground."""
    from tarsus.solve import Trajectories

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
    raised = lift @ np.asarray(system.normals, dtype=float)[:, : plan.feet]
    start = np.asarray(system.sources)[: plan.feet] + plan.initial[: len(lift)] @ system.normals[:, : plan.feet]
    height = float(np.min(np.maximum(start, 0.0)[raised < 0.0] / -raised[raised < 0.0], initial=height))
    work = height**2 * float(lift @ system.stiffness @ lift) + 2.0 * height * weight
    speed = math.sqrt(max(work, 0.0) / mass) or height / period
    return {HEIGHT: (0.0, height), SPEED: (-speed, speed)}


def _number(scene: Scene, path: str, given: Any) -> float:
    """An end of an axis [SI]."""
    if path in UNITS:
        return parse_quantity(given, UNITS[path]) if isinstance(given, str) else float(given)
    known = [*UNITS, *(one for one in float_paths(scene) if _starts(one))]
    if path not in known:
        fault = "is no part of a start" if path in float_paths(scene) else "unknown path"
        raise InputError(
            [
                f"{path}: {fault} (a start is {HEIGHT}, {SPEED}, {PHASE} of the drives, initial.*, a "
                f"drive's history){nearest(path, known)}"
            ]
        )
    return float(get_value(with_values(scene, {path: given}), path))


def _starts(path: str) -> bool:
    """Whether a number says how a run starts, and nothing of what the robot or its drive is."""
    keys = path.split(".")
    return keys[0] == "initial" or (keys[:2] == ["robot", "drives"] and keys[3] == "history")
