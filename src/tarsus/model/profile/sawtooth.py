"""Teeth."""

from typing import Literal

import numpy as np

from tarsus.base.spec import Amount, quantity
from tarsus.model.profile.base import Floats, Profile


class Sawtooth(Profile):
    """A straight rise and a straight fall, again and again."""

    kind: Literal["sawtooth"] = "sawtooth"
    length: Amount = quantity("m", "length of a tooth", gt=0)
    height: Amount = quantity("m", "height of a tooth", gt=0)
    rising: Amount = quantity("1", "part of its length over which a tooth rises", default=0.5, ge=0, le=1)
    start: Amount = quantity("m", "place at which a tooth begins", default=0.0)

    def points(self) -> Floats:
        x = self.start + self.length * np.array([0.0, self.rising, 1.0])
        return np.stack([x, [0.0, self.height, 0.0]], axis=1)
