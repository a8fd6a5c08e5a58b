"""Ground that moves, as forces on the structure in its frame: a load and a channel each, behind those of the drives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.linear import product
from tarsus.model.drive.pieces import Channels, Pieces
from tarsus.model.motion import Base, jumps, pieces_of, rates_of

if TYPE_CHECKING:
    from tarsus.base.arrays import Floats
    from tarsus.core.modes import LinearSystem
    from tarsus.model.drive.signal import Signal
    from tarsus.model.motion import GroundShift
    from tarsus.model.scene import Scene
    from tarsus.model.structure.base import Matrices

ROUNDED = 1e-12
"""Part of a matrix's largest entry below which the force of a translation through it is rounding: a free structure has
no springs and dampers to its base."""


@dataclass(frozen=True)
class GroundForce:
    """One force of moving ground on a structure: ``load`` (n,) times ``size`` times a derivative of the displacement in
    one direction, which is a force [N]; rates: how often the waveform that is given is differentiated for it."""

    direction: str
    shift: GroundShift
    load: Floats
    size: float
    rates: int

    @property
    def path(self) -> str:
        """Of the waveform in the scene."""
        return f"ground.motion.{self.direction}.{self.shift.word}"

    @property
    def pieces(self) -> Pieces:
        """The channel of its force [N]."""
        channels = Channels.of([pieces_of(self.shift.wave, self.rates)])  # pyright: ignore[reportArgumentType]
        pieces: Pieces = channels.times(self.size)[0]
        return pieces

    def channels(self, wave: Signal) -> Channels:
        """The same where the waveform has numbers of many runs."""
        return rates_of(wave, self.rates).times(self.size)


def ground_forces(scene: Scene, matrices: Matrices | LinearSystem) -> list[GroundForce]:
    """``-M R s''``, and where the base stays ``-C R s' - K R s``, of each direction that the ground moves in."""
    motion, out = scene.ground.motion, []
    if motion is None:
        return []
    for direction, shift in motion.shifts():
        way = scene.robot.structure.translation(direction)
        assert way is not None  # checked by Scene
        parts = {2: matrices.mass}
        if motion.base is Base.STAYS:
            parts |= {1: matrices.damping, 0: matrices.stiffness}
        for derivative, matrix in parts.items():
            onto = product(matrix, way)
            if derivative == 2:
                size = float(product(way, onto))
            else:
                size = float(np.abs(onto).max())
                if size <= ROUNDED * float(np.abs(matrix).max() * np.abs(way).max()):
                    continue
            out.append(GroundForce(direction, shift, -onto / size, size, derivative - shift.given))
    return out


def speed_at_start(scene: Scene, direction: str, wave: Signal) -> Floats:
    """Velocity (nr,) [m/s] of the ground at t = 0, of a waveform that may have numbers of many runs."""
    motion = scene.ground.motion
    assert motion is not None
    shift: GroundShift = getattr(motion, direction)
    if shift.given == 2:
        return np.zeros(1)
    channels = rates_of(wave, 1 - shift.given)
    odd = (-1.0) ** np.arange(channels.coef.shape[1])
    first: Floats = channels.coef[channels.first] @ odd
    return first


def velocities_at_start(scene: Scene, waves: Mapping[str, Signal]) -> Floats:
    """What is subtracted from velocities (nr, n) given in the laboratory; waves: by direction, of a run or many."""
    n = scene.robot.structure.size
    out = np.zeros((1, n))
    for direction, wave in waves.items():
        way = scene.robot.structure.translation(direction)
        assert way is not None  # checked by Scene
        out = out + speed_at_start(scene, direction, wave)[:, None] * way
    return out


def shifts_of(scene: Scene) -> dict[str, GroundShift]:
    """By direction, how the ground of a scene moves; nothing where it stays."""
    return {} if scene.ground.motion is None else dict(scene.ground.motion.shifts())


def refuse_jumps(scene: Scene, until: float, waves: Mapping[str, Any] | None = None) -> None:
    """Raise InputError where ground would jump to another speed before a time [s]; waves: other waveforms than its own,
    by direction."""
    problems = []
    for direction, shift in shifts_of(scene).items():
        wave = (waves or {}).get(direction)
        texts = (text for _, text in shift.faults(until)) if wave is None else jumps(wave, shift.given, until)
        problems += [f"ground.motion.{direction}.{shift.word}: {text}" for text in texts]
    if problems:
        raise InputError(problems)
