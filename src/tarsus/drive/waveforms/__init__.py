"""Waveforms: the voltage [V] on an actuator over time t >= 0 [s], one file a waveform.

Periodic waveforms repeat for ever; the others hold their last value.
"""

from __future__ import annotations

from functools import reduce
from operator import or_
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from tarsus.drive.signal import Signal
from tarsus.drive.waveforms.constant import Constant
from tarsus.drive.waveforms.on_off import OnOff
from tarsus.drive.waveforms.poling import Poling
from tarsus.drive.waveforms.ramp import Ramp
from tarsus.drive.waveforms.ramped_square import RampedSquare
from tarsus.drive.waveforms.registry import built_in
from tarsus.drive.waveforms.sampled import Sampled
from tarsus.drive.waveforms.sine import Sine
from tarsus.drive.waveforms.square import Square
from tarsus.drive.waveforms.swept_sine import SweptSine

__all__ = [
    "Constant",
    "OnOff",
    "Poling",
    "Ramp",
    "RampedSquare",
    "Sampled",
    "Signal",
    "Sine",
    "Square",
    "SweptSine",
    "Waveform",
]

if TYPE_CHECKING:
    Waveform = Signal
else:
    Waveform = Annotated[reduce(or_, built_in().values()), Field(discriminator="kind")]
    """Any waveform; `kind` tells which."""
