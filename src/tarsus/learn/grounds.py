"""What an agent does not know: numbers of the ground, drawn anew at every reset."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.files.draws import read_draws

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class GroundBox:
    """Numbers of a scene by path, each between two bounds: evenly, or with ``log`` their logarithms."""

    bounds: Mapping[str, tuple[float, float]]
    log: bool = False

    def __post_init__(self) -> None:
        for path, (low, high) in self.bounds.items():
            if not (low <= high and np.isfinite([low, high]).all() and (low > 0.0 or not self.log)):
                above = " above 0" if self.log else ""
                raise InputError(f"{path}: expected two bounds in order{above}, got {low:g} and {high:g}")

    def __call__(self, rng: np.random.Generator, count: int) -> dict[str, Floats]:
        """Values (count,) by path."""
        if self.log:
            return {p: np.exp(rng.uniform(np.log(a), np.log(b), count)) for p, (a, b) in self.bounds.items()}
        return {path: rng.uniform(low, high, count) for path, (low, high) in self.bounds.items()}


@dataclass(frozen=True)
class Draws:
    """Numbers of a scene that an identification left: draws (ns,) by path, of which each robot gets one."""

    draws: Mapping[str, Floats]

    @classmethod
    def of(cls, file: str | PathLike[str]) -> Draws:
        """Those of the ``draws.npz`` of `tarsus identify`. Raises InputError for a file that is none."""
        return cls(read_draws(Path(file)))

    def __call__(self, rng: np.random.Generator, count: int) -> dict[str, Floats]:
        """Values (count,) by path."""
        chosen = rng.integers(min(map(len, self.draws.values())), size=count)
        return {path: np.asarray(of, dtype=float)[chosen] for path, of in self.draws.items()}
