"""Waveforms: the voltage [V] on an actuator over time t >= 0 [s], one file a waveform.

Periodic waveforms repeat for ever; the others hold their last value.
"""

from __future__ import annotations

from functools import reduce
from operator import or_
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from tarsus.model.drive.signal import Signal
from tarsus.model.drive.waveforms.constant import Constant
from tarsus.model.drive.waveforms.on_off import OnOff
from tarsus.model.drive.waveforms.poling import Poling
from tarsus.model.drive.waveforms.ramp import Ramp
from tarsus.model.drive.waveforms.ramped_square import RampedSquare
from tarsus.model.drive.waveforms.registry import built_in
from tarsus.model.drive.waveforms.sampled import Sampled
from tarsus.model.drive.waveforms.sine import Sine
from tarsus.model.drive.waveforms.square import Square
from tarsus.model.drive.waveforms.swept_sine import SweptSine

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
    """Any waveform; `kind` says which."""
