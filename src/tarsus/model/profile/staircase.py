"""Stairs."""

from typing import Literal

import numpy as np
from pydantic import Field

from tarsus.base.spec import Amount, quantity
from tarsus.model.profile.base import Floats, Profile


class Staircase(Profile):
    """Level treads and vertical risers, for ever or so many."""

    kind: Literal["staircase"] = "staircase"
    tread: Amount = quantity("m", "length of a tread", gt=0)
    rise: Amount = quantity("m", "height of a step; below 0 the stairs go down")
    start: Amount = quantity("m", "place of the first riser", default=0.0)
    steps: int | None = Field(default=None, ge=1, description="how many risers; absent: for ever, both ways")

    def points(self) -> Floats:
        if self.steps is None:
            end = self.start + self.tread
            return np.array([[self.start, self.rise], [end, self.rise], [end, 2.0 * self.rise]])
        at = self.start + self.tread * np.arange(self.steps)
        low, high = self.rise * np.arange(self.steps), self.rise * np.arange(1, self.steps + 1)
        return np.array([np.repeat(at, 2), np.stack([low, high], axis=1).ravel()], dtype=float).T.copy()

    @property
    def repeats(self) -> bool:
        return self.steps is None
