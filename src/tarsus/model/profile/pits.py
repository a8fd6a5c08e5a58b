"""Pits."""

from typing import Literal

import numpy as np

from tarsus.base.spec import Amount, quantity
from tarsus.model.profile.base import Floats, Profile


class Pits(Profile):
    """Level ground with pits that have vertical sides and a level floor, again and again."""

    kind: Literal["pits"] = "pits"
    spacing: Amount = quantity("m", "distance from one pit to the next", gt=0)
    width: Amount = quantity("m", "width of a pit", gt=0)
    depth: Amount = quantity("m", "depth of a pit", gt=0)
    start: Amount = quantity("m", "place at which a pit begins", default=0.0)

    def points(self) -> Floats:
        floor = self.start + self.width
        x = [self.start, self.start, floor, floor, self.start + self.spacing]
        return np.stack([x, [0.0, -self.depth, -self.depth, 0.0, 0.0]], axis=1)
