"""Grounds that a design must bear: a box of numbers, or an ensemble of them (draws of a posterior, members of a fit).

What varies is any float of the scene, by its path; it need not be the ground's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.spec import float_paths, get_value, with_values
from tarsus.base.units import format_quantity, parse_quantity
from tarsus.model.scene import Scene

__all__ = ["Box", "Ensemble", "Grounds", "Over", "even_points", "over_of"]

Floats = NDArray[np.float64]

CORNERS = 4
"""Boxes of at most so many sides give their corners as first grounds; more corners than 16 cost more than they tell."""


def even_points(dimensions: int, count: int, rng: np.random.Generator) -> Floats:
    """Points (count, dimensions) of the unit cube, spread evenly: the first of a scrambled Sobol sequence."""
    from scipy.stats import qmc  # takes longer to load than all of `tarsus.design`

    return qmc.Sobol(dimensions, rng=rng).random_base2(int(np.ceil(np.log2(max(count, 2)))))[:count]


@dataclass(frozen=True)
class Grounds:
    """ng grounds that candidates are judged on, the same for all: values (ng,) by path [SI], weights (ng,) of sum 1.

    The first is the scene as it is.
    """

    values: Mapping[str, Floats]
    weights: Floats

    def __len__(self) -> int:
        return len(self.weights)

    @classmethod
    def nominal(cls, scene: Scene, paths: Sequence[str] = ()) -> Grounds:
        """The scene alone."""
        return cls({path: np.array([get_value(scene, path)]) for path in paths}, np.ones(1))

    def with_more(self, values: Floats) -> Grounds:
        """These and others (n, np), of equal weight."""
        joined = {path: np.append(own, values[:, i]) for i, (path, own) in enumerate(self.values.items())}
        count = len(self) + len(values)
        return Grounds(joined, np.full(count, 1.0 / count))

    def points(self) -> Floats:
        """(ng, np), columns in the order of the paths."""
        return np.stack(list(self.values.values()), axis=1) if self.values else np.zeros((len(self), 0))


@dataclass(frozen=True)
class Box:
    """Every ground between low (np,) and high (np,) [SI] of the paths, each as likely as any other."""

    paths: tuple[str, ...]
    low: Floats
    high: Floats

    def at(self, cube: Floats) -> Floats:
        """Values (n, np) at points (n, np) of the unit cube."""
        return self.low + (self.high - self.low) * np.clip(cube, 0.0, 1.0)

    def spread(self, count: int, seed: int = 0) -> Floats:
        """``count`` values (count, np) spread evenly (Sobol)."""
        return self.at(even_points(len(self.paths), count, np.random.default_rng([seed, len(self.paths)])))

    def first(self) -> Floats:
        """Grounds (n, np) to begin with: the corners of a box of few sides, else an even spread."""
        if len(self.paths) > CORNERS:
            return self.spread(2**CORNERS)
        return self.at(np.array(list(product((0.0, 1.0), repeat=len(self.paths)))))


@dataclass(frozen=True)
class Ensemble:
    """A finite number of grounds: values (n,) by path [SI], and weights (n,), equal when absent."""

    values: Mapping[str, Floats]
    weights: Floats | None = None

    @property
    def paths(self) -> tuple[str, ...]:
        return tuple(self.values)

    def grounds(self, scene: Scene) -> Grounds:
        """The scene itself, without weight, and all members."""
        count = len(next(iter(self.values.values())))
        weights = np.full(count, 1.0) if self.weights is None else np.asarray(self.weights, dtype=float)
        values = {
            path: np.append(get_value(scene, path), np.asarray(own, dtype=float))
            for path, own in self.values.items()
        }
        return Grounds(values, np.append(0.0, weights / weights.sum()))


Over = Box | Ensemble


def over_of(scene: Scene, given: Any) -> Over | None:
    """What a design is to bear, from a mapping of paths to (low, high), an `Ensemble`, or the file of draws that
    `tarsus identify` writes; None for nothing.

    Raises InputError for unknown paths, for a box that is empty, and for values that the scene refuses.
    """
    if given is None or (isinstance(given, Mapping) and not given):
        return None
    if isinstance(given, (str, Path)):
        from tarsus.files.draws import read_draws

        given = Ensemble(read_draws(Path(given)))
    if isinstance(given, (Box, Ensemble)):
        _check(scene, given)
        return given
    problems, ends = [], []
    known = float_paths(scene)
    for path, pair in given.items():
        try:
            get_value(scene, path)
            if path not in known:
                raise InputError(f"{path}: is no number, so it has no range")
            low, high = (parse_quantity(one, known[path].unit) for one in pair)
        except (InputError, ValueError, TypeError) as error:
            told = (
                error.problems
                if isinstance(error, InputError)
                else [f"{path}: expected (low, high), got {pair}"]
            )
            problems += [one if one.startswith(path) else f"{path}: {one}" for one in told]
            continue
        if not low < high:
            shown = [format_quantity(float(f"{one:.6g}"), known[path].unit) for one in (low, high)]
            problems.append(
                f"{path}: the box is empty, expected its lower end before its upper one, got {shown[0]} to {shown[1]}"
            )
        ends.append((path, low, high))
    if problems:
        raise InputError(problems)
    box = Box(
        tuple(p for p, _, _ in ends), np.array([a for _, a, _ in ends]), np.array([b for _, _, b in ends])
    )
    _check(scene, box)
    return box


def _check(scene: Scene, over: Over) -> None:
    """Raise InputError for values that the scene refuses: bounds are intervals, so both ends suffice."""
    ends = (
        [dict(zip(over.paths, end.tolist(), strict=True)) for end in (over.low, over.high)]
        if isinstance(over, Box)
        else [{path: float(pick(own)) for path, own in over.values.items()} for pick in (np.min, np.max)]
    )
    problems: list[str] = []
    for end in ends:
        for path, value in end.items():
            try:
                with_values(scene, {path: value})
            except InputError as error:
                problems += error.problems
    if problems:
        raise InputError(list(dict.fromkeys(problems)))
