"""Robots as they come from a workshop: values scattered about those of the drawing, legs that are dead or weak, and the
designs of runs that find out what it does to them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any, Literal

import numpy as np
from pydantic import Field

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.spec import Description
from tarsus.study.axes import SweepAxis, sobol_shares

DRAWS = 2
"""Shares that say how many parts are dead and how many are weak; one more for each part says which."""


class Scattered(Description):
    """Robots drawn from all axes at once (Sobol), some of whose parts are dead or weak.

    The numbers of dead and of weak parts are drawn evenly from their ranges, which ones they are as well. A part is an
    axis, such as the gain of a leg's drive: that of a dead one is 0, that of a weak one a fraction of what was drawn.
    """

    kind: Literal["scattered"] = "scattered"
    count: int = Field(ge=1, description="number of robots")
    seed: int = Field(default=0, ge=0, description="seed of the scrambling")
    parts: tuple[str, ...] = Field(default=(), description="axes that are dead or weak in some robots")
    dead: tuple[int, int] = Field(default=(0, 0), description="fewest and most dead parts")
    weak: tuple[int, int] = Field(default=(0, 0), description="fewest and most weak parts")
    weakness: float = Field(default=0.5, ge=0.0, le=1.0, description="what is left of a weak part")

    def runs(self, axes: Mapping[str, SweepAxis]) -> int:
        """Number of runs."""
        return self.count

    def faults(self, axes: Mapping[str, SweepAxis]) -> list[tuple[str, str]]:
        """What the design cannot use, as (path in the axes, sentence)."""
        faults = [(name, "is no axis, so it cannot be a part") for name in self.parts if name not in axes]
        for word, (low, high) in (("dead", self.dead), ("weak", self.weak)):
            if not 0 <= low <= high:
                faults.append((word, f"expected fewest:most of at least 0, got {low}:{high}"))
        if self.dead[1] + self.weak[1] > len(self.parts):
            faults.append(
                ("", f"at most {self.dead[1]} dead and {self.weak[1]} weak of {len(self.parts)} parts is too many")
            )
        return faults

    def points(self, axes: Mapping[str, SweepAxis], part: slice) -> dict[str, Floats]:
        """Values (k,) of the runs of a part, by axis."""
        shares = self._shares(axes, part)
        values = {name: axis.at(shares[:, i]) for i, (name, axis) in enumerate(axes.items())}
        left = self._left(shares[:, len(axes) :])
        return values | {name: values[name] * left[:, i] for i, name in enumerate(self.parts)}

    def left(self, axes: Mapping[str, SweepAxis], part: slice) -> Floats:
        """What is left (k, parts) of every part: 1 of a sound one, 0 of a dead one."""
        return self._left(self._shares(axes, part)[:, len(axes) :])

    def _shares(self, axes: Mapping[str, SweepAxis], part: slice) -> Floats:
        """Shares of the axes, of the numbers of dead and of weak parts, and of which ones they are."""
        return sobol_shares(len(axes) + DRAWS + len(self.parts), self.seed, part)

    def _left(self, shares: Floats) -> Floats:
        counts = [
            low + np.floor(shares[:, i] * (high - low + 1)) for i, (low, high) in enumerate((self.dead, self.weak))
        ]
        order = np.argsort(np.argsort(shares[:, DRAWS:], axis=1), axis=1)
        dead, weak = counts[0][:, None], counts[1][:, None]
        return np.where(order < dead, 0.0, np.where(order < dead + weak, self.weakness, 1.0))


class Saltelli(Description):
    """Runs that determine how much of a measure's variance each group of axes makes: Saltelli's design, drawn by SALib,
    as scipy's `sobol_indices` knows no groups."""

    kind: Literal["saltelli"] = "saltelli"
    count: int = Field(ge=2, description="base number of draws; there are (groups + 2) times as many runs")
    seed: int = Field(default=0, ge=0, description="seed of the scrambling")
    groups: tuple[str, ...] = Field(description="name of each axis's group, in the order of the axes")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the groups."""
        return tuple(dict.fromkeys(self.groups))

    def runs(self, axes: Mapping[str, SweepAxis]) -> int:
        """Number of runs."""
        return self.count * (len(self.names) + 2)

    def faults(self, axes: Mapping[str, SweepAxis]) -> list[tuple[str, str]]:
        """What the design cannot use, as (path in the axes, sentence)."""
        if len(self.groups) != len(axes):
            return [("", f"{len(self.groups)} names of groups for {len(axes)} axes")]
        if len(self.names) < 2:
            return [("", "one group alone makes all of the variance: at least two are compared")]
        return []

    def points(self, axes: Mapping[str, SweepAxis], part: slice) -> dict[str, Floats]:
        """Values (k,) of the runs of a part, by axis."""
        shares = _saltelli(self.count, self.seed, self.groups)[part]
        return {name: axis.at(shares[:, i]) for i, (name, axis) in enumerate(axes.items())}

    def indices(self, values: Floats) -> dict[str, dict[str, float]]:
        """Sobol indices of a measure (nr,) by group: `first` (alone), `total` (with all it acts together with), and the
        half-widths of their 95 % intervals, `first_error` and `total_error`."""
        from SALib.analyze import sobol

        # SALib takes a seed of 0 for none
        found = sobol.analyze(
            _problem(self.groups), values, calc_second_order=False, seed=self.seed + 1, num_resamples=RESAMPLES
        )
        keys = {"first": "S1", "first_error": "S1_conf", "total": "ST", "total_error": "ST_conf"}
        return {name: {word: float(found[key][i]) for word, key in keys.items()} for i, name in enumerate(self.names)}


RESAMPLES = 200
"""Bootstrap draws behind the intervals of indices: their half-widths are then known to about 5 %."""


def _problem(groups: tuple[str, ...]) -> dict[str, Any]:
    names = [f"x{i}" for i in range(len(groups))]
    return {"num_vars": len(groups), "names": names, "bounds": [[0.0, 1.0]] * len(groups), "groups": list(groups)}


@lru_cache(maxsize=4)
def _saltelli(count: int, seed: int, groups: tuple[str, ...]) -> Floats:
    """Shares (nr, axes) of the whole design, below 1."""
    try:
        from SALib.sample import sobol
    except ImportError:
        raise InputError("Sobol indices need SALib: pip install SALib") from None
    shares = sobol.sample(_problem(groups), count, calc_second_order=False, scramble=True, seed=seed)
    return np.minimum(shares, np.nextafter(1.0, 0.0))
