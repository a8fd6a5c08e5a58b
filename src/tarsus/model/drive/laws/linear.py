"""A force in proportion to the voltage."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from tarsus.base.arrays import Floats
from tarsus.base.columns import columns
from tarsus.base.spec import Amount, quantity
from tarsus.model.drive.law import VoltageLaw
from tarsus.model.drive.parts import Parts, whole_parts
from tarsus.model.drive.track import Track


class LinearForce(VoltageLaw):
    """Force = offset + gain V."""

    kind: Literal["linear"] = "linear"
    gain: Amount = quantity("N/V", "force per volt")
    offset: Amount = quantity("N", "force at 0 V", default=0.0)

    @property
    def has_memory(self) -> bool:
        """False."""
        return False

    def force(self, volts: ArrayLike, history: Sequence[float] = ()) -> Floats:
        """Force [N] at `volts` [V], any shape."""
        return self.offset + self.gain * np.asarray(volts, dtype=np.float64)

    def held(self, volts: Floats, past: Floats) -> Floats:
        """The same, for actuators side by side."""
        return self.gain * volts + self.offset

    def parts(self, track: Track, history: Sequence[float]) -> Parts:
        """One part for each stretch."""
        return whole_parts(track, track.of_run(columns((self.offset, self.gain, 0.0, 0.0))))
