"""Ground that moves, as it is felt in its own frame (docs/shaker.md); waveforms are differentiated by own formulas."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from independent import drives
from independent.bodies import Robot


def shifts(scene: Any, robot: Robot) -> Iterator[tuple[Any, np.ndarray]]:
    """How the ground moves, with the unit translation that goes with it."""
    motion = scene.ground.motion
    for shift, way in ((motion.normal, robot.up), (motion.along, robot.ahead)) if motion is not None else ():
        if shift is not None:
            yield shift, way


def derivative(shift: Any, order: int, end: float) -> drives.Signal:
    """A derivative of the displacement over time."""
    given = {"displacement": 0, "velocity": 1, "acceleration": 2}
    name = next(one for one in given if getattr(shift, one) is not None)
    wave, times = getattr(shift, name), order - given[name]
    told = drives.command(wave, end)
    if times == 0:
        return told
    if wave.kind == "sine":
        w = 2.0 * math.pi * wave.frequency
        size, turned = wave.amplitude * w**times, wave.phase + 0.5 * math.pi * times
        pieces = [
            drives.Piece(
                p.start, p.end, lambda t: size * math.sin(w * t + turned), lambda t: size * w * math.cos(w * t + turned)
            )
            for p in told.pieces
        ]
        return drives.Signal(pieces, end)
    if wave.kind == "sampled" and wave.interpolation.value == "cubic":
        spline = CubicSpline(wave.times, wave.levels, bc_type="natural")
        own, slope = spline.derivative(times), spline.derivative(times + 1)
        inside = [
            drives.Piece(a, b, lambda t: float(own(t)), lambda t: float(slope(t)))
            for a, b in zip(wave.times, wave.times[1:], strict=False)
        ]
        return drives.Signal(inside, end)
    assert times == 1, wave
    return drives.Signal([drives.line(p.start, p.end, p.slope(p.start), p.slope(p.start)) for p in told.pieces], end)


def pushes(scene: Any, robot: Robot, end: float) -> list[tuple[np.ndarray, drives.Signal]]:
    """Loads (n,) with what they are multiplied by: inertia, and of a base that stays its dampers and springs."""
    out = []
    for shift, way in shifts(scene, robot):
        matrices = [(2, robot.mass)]
        if scene.ground.motion.base.value == "stays":
            matrices += [(1, robot.damping), (0, robot.stiffness)]
        out += [(-matrix @ way, derivative(shift, order, end)) for order, matrix in matrices]
    return out


def start(scene: Any, robot: Robot, end: float) -> np.ndarray:
    """Velocity (n,) of what rests on the ground at time 0."""
    found = np.zeros(len(robot.mass))
    for shift, way in shifts(scene, robot):
        if shift.acceleration is None:
            found = found + way * derivative(shift, 1, end).at(0.0).value(0.0)
    return found
