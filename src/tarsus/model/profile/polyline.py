"""A ground of given points."""

from typing import Literal

import numpy as np

from tarsus.base.spec import quantity
from tarsus.model.profile.base import Floats, Profile


class Polyline(Profile):
    """Facets between given points."""

    kind: Literal["polyline"] = "polyline"
    given: tuple[tuple[float, float], ...] = quantity("m", "points from rear to front: place along the way, height")
    periodic: bool = False

    def points(self) -> Floats:
        return np.array(self.given, dtype=float).reshape(-1, 2)

    @property
    def repeats(self) -> bool:
        return self.periodic
