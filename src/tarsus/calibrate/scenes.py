"""The scenes of a calibration: which run each row of a variant is, and values of all paths for a set of unknowns."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from tarsus.base.arrays import Floats
from tarsus.base.expressions import Expression
from tarsus.model.scene import Scene


@dataclass(frozen=True)
class Setting:
    """An unknown and the paths that take its value."""

    name: str
    paths: tuple[str, ...]


@dataclass(frozen=True)
class Interpolated:
    """Values (na,) at values ``at`` (na,) of an unknown, for a path or a name of expressions."""

    unknown: str
    at: tuple[float, ...]
    target: str
    values: tuple[float, ...]

    def of(self, x: Floats) -> Floats:
        """By linear interpolation, held at the ends."""
        return np.interp(x, self.at, self.values)


@dataclass(frozen=True)
class Row:
    """One run: the scene without its floats, the floats that hold for every set, and the conditions in SI.

    last: floats that prevail over those of the unknowns (a constraint's own); motion: its motion is read as well.
    """

    name: str
    template: Scene
    fixed: Mapping[str, float]
    conditions: Mapping[str, float]
    last: Mapping[str, float] = field(default_factory=dict)
    motion: bool = False


@dataclass(frozen=True)
class Variant:
    """Options that need runs of their own, and the rows as they are run with them."""

    options: Mapping[str, str]
    rows: tuple[Row, ...]
    constants: Mapping[str, float]
    settings: tuple[Setting, ...]
    along: tuple[Interpolated, ...]
    derived: tuple[tuple[str, Expression], ...]

    def columns(self, unknowns: Mapping[str, Floats], row: Row) -> dict[str, Floats]:
        """Floats (ns,) of a row's scene by path, of values (ns,) of the unknowns; NaN where an expression has no
        value."""
        out: dict[str, ArrayLike] = dict(row.fixed)
        names: dict[str, ArrayLike] = {**self.constants, **row.conditions, **unknowns}
        for setting in self.settings:
            out.update(dict.fromkeys(setting.paths, unknowns[setting.name]))
        for one in self.along:
            (out if "." in one.target else names)[one.target] = one.of(unknowns[one.unknown])
        for target, expression in self.derived:
            (out if "." in target else names)[target] = expression.values(names)
        out.update(row.last)
        shape = next(iter(unknowns.values())).shape
        return {path: np.broadcast_to(np.asarray(one, dtype=float), shape) for path, one in out.items()}

    def values(self, unknowns: Mapping[str, float], row: Row) -> dict[str, float]:
        """The same of one set."""
        found = self.columns({name: np.array([one]) for name, one in unknowns.items()}, row)
        return {path: float(one[0]) for path, one in found.items()}

    @cached_property
    def driven(self) -> tuple[str, ...]:
        """Paths that depend on the unknowns or the conditions through settings, tables and expressions."""
        paths = [path for setting in self.settings for path in setting.paths]
        paths += [one.target for one in self.along if "." in one.target]
        paths += [target for target, _ in self.derived if "." in target]
        return tuple(dict.fromkeys(paths))


def finite(values: Mapping[str, float]) -> bool:
    """Whether all values are."""
    return all(map(math.isfinite, values.values()))
