"""Ground that moves: how it is displaced along its normal and along the way, and what the robot's base does."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from enum import Enum
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from tarsus.base.arrays import Floats
from tarsus.base.messages import PathErrors
from tarsus.base.quantities import Quantity
from tarsus.base.spec import Description
from tarsus.model.drive.integrals import integral
from tarsus.model.drive.other_units import waveforms_of
from tarsus.model.drive.parts import IDENTITY, to_pieces, whole_parts
from tarsus.model.drive.pieces import Channels, Pieces
from tarsus.model.drive.signal import Signal
from tarsus.model.drive.waveforms.sampled import Interpolation

GIVEN = (Quantity.DISPLACEMENT, Quantity.VELOCITY, Quantity.ACCELERATION)
"""What a waveform may say of ground that moves: each is the rate of the one before."""

if TYPE_CHECKING:
    AnyDisplacement = AnyVelocity = AnyAcceleration = Signal
else:
    AnyDisplacement, AnyVelocity, AnyAcceleration = (waveforms_of(one, globals()) for one in GIVEN)

JUMP = 1e-9
"""Part of the range of a value by which it differs on both sides of a jump: waveforms are followed to 1e-12."""


class Base(Enum):
    """What the part of the world does that the structure's springs and dampers are fixed to."""

    MOVES = "moves"
    """It is on the ground, as everything is on a shaker's table."""
    STAYS = "stays"
    """It stands in the laboratory, while the ground passes below, as a belt does."""


class GroundShift(Description):
    """How ground moves in one direction: one waveform of its displacement, velocity or acceleration.

    From a velocity or an acceleration it starts at zero, from an acceleration at rest too.
    """

    displacement: AnyDisplacement | None = Field(default=None, description="where it is [m]")
    velocity: AnyVelocity | None = Field(default=None, description="how fast it moves [m/s]")
    acceleration: AnyAcceleration | None = Field(default=None, description="how it is accelerated [m/s^2]")

    @model_validator(mode="after")
    def _one(self) -> GroundShift:
        given = [one.name.lower() for one in GIVEN if getattr(self, one.name.lower()) is not None]
        if len(given) != 1:
            said = f"got {' and '.join(given)}" if given else "got none"
            raise PathErrors([("", f"expected one of displacement, velocity and acceleration, {said}")])
        return self

    @property
    def given(self) -> int:
        """Which derivative of the displacement is given: 0, 1 or 2."""
        return next(k for k, one in enumerate(GIVEN) if getattr(self, one.name.lower()) is not None)

    @property
    def word(self) -> str:
        """What is given: the name of its field."""
        return GIVEN[self.given].name.lower()

    @property
    def wave(self) -> Signal:
        """The waveform that is given."""
        wave: Signal = getattr(self, self.word)
        return wave

    def at(self, time: ArrayLike, derivative: int = 0) -> Floats:
        """The displacement, or a derivative of it, up to the second, at times [s], any shape; after a jump."""
        over = derivative - self.given
        pieces = pieces_of(self.wave, max(over, 0))  # pyright: ignore[reportArgumentType]  # frozen, so that it has a hash
        return integral(pieces, time, max(-over, 0))

    def faults(self, until: float) -> list[tuple[str, str]]:
        """Jumps of the velocity before a time [s], which would be impacts on all that is on the ground, as (field,
        sentence)."""
        kept = (pieces_of(self.wave, order) for order in range(2 - self.given))  # pyright: ignore[reportArgumentType]
        return [(self.word, text) for text in jumps(self.wave, self.given, until, kept)]


class GroundMotion(Description):
    """Ground that moves, along its normal, along the way (+x), or both; the robot is described in its frame.

    ``-M R s''`` acts on a structure, and where its base stays ``-C R s' - K R s`` as well, with R its unit translation
    (`upward`, `forward`).
    """

    normal: GroundShift | None = Field(default=None, description="out of the ground, +z of level ground")
    along: GroundShift | None = Field(default=None, description="along the way, +x")
    base: Base = Field(default=Base.MOVES, description="whether what holds the structure moves with the ground")

    @model_validator(mode="after")
    def _some(self) -> GroundMotion:
        faults = []
        if self.normal is None and self.along is None:
            faults.append(("", "expected normal, along or both, got neither"))
        if self.base is Base.STAYS:
            text = "a base that stays depends on where the ground is: give the displacement"
            faults += [(f"{name}.{one.word}", text) for name, one in self.shifts() if one.given > 0]
        if faults:
            raise PathErrors(faults)
        return self

    def shifts(self) -> Iterator[tuple[str, GroundShift]]:
        """The directions that it moves in, by name."""
        for name in ("normal", "along"):
            one = getattr(self, name)
            if one is not None:
                yield name, one

    def faults(self, until: float) -> list[tuple[str, str]]:
        """Jumps before a time [s], as (path, sentence)."""
        return [(f"{name}.{path}", text) for name, one in self.shifts() for path, text in one.faults(until)]


def rates_of(wave: Signal, times: int) -> Channels:
    """A waveform differentiated so many times by time, as pieces of every run that it has numbers of."""
    while times > 0 and (closed := wave.rate()) is not None:
        wave, times = closed, times - 1
    track = wave.track()
    channels = to_pieces(track, whole_parts(track, IDENTITY))
    for _ in range(times):
        channels = channels.rate()
    return channels


@lru_cache(maxsize=64)
def pieces_of(wave: Signal, times: int) -> Pieces:
    """The same of a waveform of one run."""
    pieces: Pieces = rates_of(wave, times)[0]
    return pieces


def jumps(wave: Signal, given: int, until: float, pieces: Iterable[Pieces] | None = None) -> list[str]:
    """A sentence where the velocity of what a waveform moves jumps between 0 and a time [s]; given: 0 of a
    displacement, 1 of a velocity; an acceleration may jump. pieces: of its derivatives up to the velocity, where they
    are known."""
    runs = (run for order in range(2 - given) for run in rates_of(wave, order)) if pieces is None else pieces
    first = min((jump for run in runs if (jump := _jump(run, until))), default=None)
    if first is None:
        return []
    lines = getattr(wave, "interpolation", None) is Interpolation.LINEAR
    cubic = "; join samples by a cubic spline (interpolation)" if lines else ""
    said = f"the velocity of the ground would jump at {first:.6g} s, an impact on all that is on it"
    return [f"{said}: give a smooth {GIVEN[given].name.lower()}{cubic}"]


def _jump(pieces: Pieces, until: float) -> float | None:
    """First time [s] after 0 and before another at which the value jumps."""
    odd = (-1.0) ** np.arange(pieces.coef.shape[1])
    before, after = pieces.coef.sum(axis=1), (pieces.coef * odd).sum(axis=1)
    # the value that comes after each piece: that of the next, of the first that repeats, or the last one held
    follows = np.append(after[1:], after[pieces.loop] if pieces.loop >= 0 else before[-1])
    large = np.abs(before - follows) > JUMP * pieces.span
    times = pieces.start[1:][large]
    return float(times[0]) if len(times) and times[0] < until else None
