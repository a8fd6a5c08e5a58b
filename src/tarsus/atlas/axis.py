"""An axis of a map: a number of the scene, and the values that it has at the points of a grid."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.spec import float_paths, get_value, one_number, with_values
from tarsus.model.scene import Scene
from tarsus.study.axes import Logspace
from tarsus.study.sweep import Sweep

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class MapAxis:
    """A path of a scene and the ends [SI] between which its number goes, evenly or (log) by equal factors."""

    path: str
    low: float
    high: float
    log: bool = False
    unit: str = "1"

    @classmethod
    def of(cls, scene: Scene, given: tuple[Any, ...]) -> MapAxis:
        """From (path, low, high) or (path, low, high, "log"), numbers [SI] or texts with a unit.

        Raises InputError for an unknown path, ends that its number cannot have, and an empty range.
        """
        path, *span = given
        path = one_number(scene, path)
        if len(span) not in (2, 3) or (len(span) == 3 and span[2] not in ("log", "")):
            raise InputError(f"{path}: expected a:b or a:b:log, got {':'.join(map(str, span))}")
        low, high = (float(get_value(with_values(scene, {path: end}), path)) for end in span[:2])
        log = len(span) == 3 and span[2] == "log"
        if not (math.isfinite(high - low) and low < high):
            raise InputError(f"{path}: the range from {low:g} to {high:g} is empty")
        if log and low <= 0.0:
            raise InputError(f"{path}: a logarithmic axis begins above 0, got {low:g}")
        return cls(path, low, high, log, float_paths(scene)[path].unit)

    def at(self, share: Any) -> Floats:
        """Values [SI] at shares of the axis, from 0 to 1."""
        share = np.asarray(share, dtype=float)
        if self.log:
            return self.low * (self.high / self.low) ** share
        return self.low + share * (self.high - self.low)

    def share(self, values: Any) -> Floats:
        """Shares of the axis at values [SI]; those beyond its ends are below 0 or above 1."""
        values = np.asarray(values, dtype=float)
        if self.log:
            with np.errstate(divide="ignore", invalid="ignore"):
                return np.log(values / self.low) / math.log(self.high / self.low)
        return (values - self.low) / (self.high - self.low)

    def to_dict(self) -> dict[str, Any]:
        """Plain data, SI."""
        return {"path": self.path, "from": self.low, "to": self.high, "log": self.log, "unit": self.unit}


def axes_of(study: Sweep) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    """Both axes of a study that varies two numbers, as `MapAxis.of` takes them. Raises InputError for others."""
    paths = [path for name in study.vary for path in study.paths(name)]
    if len(study.vary) != 2 or len(paths) != 2:
        raise InputError(f"{study.name}: varies {', '.join(paths)}; an atlas is over two numbers, each by itself")
    x, y = (
        (path, *axis.ends, "log" if isinstance(axis, Logspace) else "")
        for path, axis in zip(paths, study.vary.values(), strict=True)
    )
    return x, y
