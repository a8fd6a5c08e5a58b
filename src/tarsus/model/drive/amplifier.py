"""An amplifier between a signal and an actuator: what it takes from the command."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import field_validator, model_validator

from tarsus.base.errors import InputError
from tarsus.base.messages import PathErrors
from tarsus.base.spec import Amount, Description, MaybeAmount, quantity
from tarsus.base.units import parse_quantity
from tarsus.model.drive.output import Stage, amplified
from tarsus.model.drive.parts import IDENTITY, to_pieces, whole_parts
from tarsus.model.drive.pieces import Pieces, evaluate
from tarsus.model.drive.signal import Signal
from tarsus.model.drive.track import Track


class Amplifier(Description):
    """One pole in a loop whose rate and whose output saturate; every limit that is absent does not act.

    lag dV/dt = u - V with ``|dV/dt|`` <= slew_rate and low <= V <= high, of the command u. The lag is
    1 / (2 pi bandwidth), or rise_time / ln 9. Small signals see the lag, large steps the slew rate until the error is
    below slew_rate times lag. At a rail the output stays while the command is beyond it and comes back with the
    command. At t = 0 the amplifier gives the last voltage of the drive's history, 0 V without one.
    """

    slew_rate: MaybeAmount = quantity("V/s", "fastest change of the output", default=None, gt=0)
    bandwidth: MaybeAmount = quantity("Hz", "where small signals have fallen by 3 dB", default=None, gt=0)
    rise_time: MaybeAmount = quantity("s", "small step's time from 10 % to 90 %", default=None, gt=0)
    clip: tuple[float, float] | None = quantity(
        "V", "lowest and highest output; one voltage stands for both signs", default=None
    )

    @field_validator("clip", mode="before")
    @classmethod
    def _both_signs(cls, value: Any) -> Any:
        if isinstance(value, bool) or not isinstance(value, (str, int, float)):
            return value
        try:
            volts = parse_quantity(value, "V")
        except InputError as error:
            raise PathErrors([("", str(error))]) from None
        if not volts > 0.0:
            raise PathErrors([("", f"expected a voltage (V) above 0 for both signs, got {value!r}")])
        return -volts, volts

    @model_validator(mode="after")
    def _check(self) -> Amplifier:
        faults: list[tuple[str, str]] = []
        if self.bandwidth is not None and self.rise_time is not None:
            faults.append(("rise_time", "bandwidth says the same: give one of the two"))
        if self.clip is not None and not self.clip[0] < self.clip[1]:
            low, high = self.clip
            faults.append(("clip", f"expected the lowest voltage before the highest, got {low:g} V and {high:g} V"))
        if faults:
            raise PathErrors(faults)
        return self

    @property
    def ideal(self) -> bool:
        """True if the output is the command."""
        return self.stage() == Stage(0.0, math.inf, -math.inf, math.inf)

    def stage(self) -> Stage:
        """Its numbers, one a run where the amplifier's are."""
        lag: Any = 0.0
        if self.bandwidth is not None:
            lag = 1.0 / (2.0 * math.pi * self.bandwidth)
        elif self.rise_time is not None:
            lag = self.rise_time / math.log(9.0)
        low, high = self.clip or (-math.inf, math.inf)
        return Stage(lag, math.inf if self.slew_rate is None else self.slew_rate, low, high)

    def output(self, command: Signal, history: tuple[float, ...] = ()) -> Signal:
        """The signal at the actuator, after `history` [V]."""
        if self.ideal:
            return command
        return Amplified(command=command, amplifier=self, start=history[-1] if history else 0.0)


class Amplified(Signal):
    """What an amplifier makes of a command; its period is the command's, after what comes once."""

    command: Signal
    amplifier: Amplifier
    start: Amount = quantity("V", "output until t = 0", default=0.0)

    def periods(self) -> Any:
        """Period [s] of the command."""
        return self.command.periods()

    def volts(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """Voltage [V] at the actuator at `time` [s], any shape."""
        return evaluate(_output(self)[1], time)  # pyright: ignore[reportArgumentType]  # frozen, so that it has a hash

    def track(self) -> Track:
        """The voltage at the actuator, with what comes once before what repeats."""
        return _output(self)[0]  # pyright: ignore[reportArgumentType]


@lru_cache(maxsize=32)
def _output(signal: Amplified) -> tuple[Track, Pieces]:
    track = amplified(signal.command.track(), signal.amplifier.stage(), signal.start)
    return track, to_pieces(track, whole_parts(track, IDENTITY))[0]
