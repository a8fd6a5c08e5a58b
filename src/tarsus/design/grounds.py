"""Grounds that a design must bear: those of a box of unknown numbers, or a finite number of them (draws of a posterior,
members of a fit).

What varies is any float of the scene, by its path; it need not be the ground's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.spec import by_path, get_value, with_values
from tarsus.files.draws import SURE, Reliance, read_draws, read_reliance
from tarsus.fit.unknowns import Unknown, Unknowns
from tarsus.model.scene import Scene

if TYPE_CHECKING:
    from tarsus.orbits.starts import Box

Floats = NDArray[np.float64]

CORNERS = 4
"""Boxes of at most so many sides give their corners as first grounds; more corners than 16 cost more than they tell."""


@dataclass(frozen=True)
class Grounds:
    """ng grounds, the same for all candidates: values (ng,) by path [SI], weights (ng,) of sum 1, equal unless given;
    reliance: how far they can be relied on.

    Of those that candidates are judged on the first is the scene as it is.
    """

    values: Mapping[str, Floats]
    weights: Floats = field(default_factory=lambda: np.zeros(0))
    reliance: Reliance = SURE

    def __post_init__(self) -> None:
        own = {path: np.asarray(one, dtype=float) for path, one in self.values.items()}
        count = len(next(iter(own.values()))) if own else 1
        weights = np.asarray(self.weights, dtype=float) if len(self.weights) else np.ones(count)
        object.__setattr__(self, "values", own)
        object.__setattr__(self, "weights", weights / weights.sum())

    def __len__(self) -> int:
        return len(self.weights)

    @property
    def names(self) -> tuple[str, ...]:
        """Paths of what varies."""
        return tuple(self.values)

    @classmethod
    def of_points(cls, paths: Sequence[str], points: Floats, reliance: Reliance = SURE) -> Grounds:
        """Of values (ng, np), all of equal weight."""
        return cls({path: points[:, i] for i, path in enumerate(paths)}, reliance=reliance)

    @classmethod
    def nominal(cls, scene: Scene, paths: Sequence[str] = ()) -> Grounds:
        """The scene alone."""
        return cls({path: np.array([get_value(scene, path)]) for path in paths})

    def with_more(self, points: Floats) -> Grounds:
        """These and others (n, np), all of equal weight."""
        return Grounds.of_points(self.names, np.concatenate([self.points(), points]))

    def points(self) -> Floats:
        """(ng, np), columns in the order of the paths."""
        return np.stack(list(self.values.values()), axis=1) if self.values else np.zeros((len(self), 0))

    def each(self) -> list[dict[str, float]]:
        """Values by path of every ground."""
        return [dict(zip(self.names, point, strict=True)) for point in self.points().tolist()]

    def crossed(self, rows: Floats) -> tuple[Floats, dict[str, Floats]]:
        """Every row of (n, nx) on every ground: rows (n ng, nx), grounds fastest, and values (n ng,) by path."""
        return np.repeat(rows, len(self), axis=0), self.rows(np.tile(np.arange(len(self)), len(rows)))

    def rows(self, which: Any) -> dict[str, Floats]:
        """Values by path of some grounds, by number or slice."""
        return {path: own[which] for path, own in self.values.items()}


Over = Unknowns | Grounds
"""What a design is to bear: every ground of a box, each as likely as any other, or a finite number of grounds."""


def with_starts(over: Over, starts: Box, seed: int, least: int) -> Over:
    """Grounds with starts: a box with the axes of a box of starts as further sides; of a finite number of grounds each
    as often as at least so many walks want, every time with another start."""
    names, ends = tuple(starts.ends), np.array(list(starts.ends.values()))
    if isinstance(over, Grounds):
        times = -(-least // len(over))
        which = np.tile(np.arange(len(over)), times)
        along = ends[:, 0] + np.ptp(ends, axis=1) * starts.drawn(len(which), seed)
        return Grounds({**over.rows(which), **dict(zip(names, along.T, strict=True))}, over.weights[which])
    size, units = len(names), starts.units()
    return Unknowns(
        (*over.names, *names),
        (*over.units, *units.values()),
        np.append(over.low, ends[:, 0]),
        np.append(over.high, ends[:, 1]),
        np.append(over.log, np.zeros(size, dtype=bool)),
        (*over.priors, *(None,) * size),
    )


def started(own: Grounds, starts: Box, count: int, seed: int) -> Grounds:
    """One ground, put on so many starts that are spread evenly over their box."""
    ends = np.array(list(starts.ends.values()))
    along = ends[:, 0] + np.ptp(ends, axis=1) * starts.drawn(count, seed)
    same = np.zeros(count, dtype=int)
    return Grounds({**own.rows(same), **dict(zip(starts.ends, along.T, strict=True))})


def spread(box: Unknowns, count: int, seed: int = 0) -> Floats:
    """``count`` values (count, np) spread evenly over a box."""
    return box.values(box.draws(count, np.random.default_rng([seed, len(box)])))


def corners(box: Unknowns) -> Floats:
    """Grounds (n, np) to begin with: the corners of a box of few sides, else an even spread."""
    if len(box) > CORNERS:
        return spread(box, 2**CORNERS)
    return box.values(np.array(list(product((0.0, 1.0), repeat=len(box)))))


def drawn(over: Over, count: int, rng: np.random.Generator) -> Grounds:
    """So many grounds by chance, all of equal weight."""
    if isinstance(over, Grounds):
        rows = rng.choice(len(over), count, p=over.weights)
        return Grounds.of_points(over.names, over.points()[rows])
    return Grounds.of_points(over.names, over.values(rng.random((count, len(over)))))


def over_of(scene: Scene, given: Any) -> Over | None:
    """What a design is to bear, from a mapping of paths to (low, high), `Grounds`, or the file of draws that
    `tarsus identify` writes; None for nothing.

    Raises InputError for unknown paths, for a box that is empty, and for values that the scene refuses.
    """
    if given is None or (isinstance(given, Mapping) and not given):
        return None
    if isinstance(given, (str, Path)):
        given = Grounds(read_draws(Path(given)), reliance=read_reliance(Path(given)))
    over = given if isinstance(given, (Unknowns, Grounds)) else _box(scene, by_path(scene, given))
    ends = (over.low, over.high) if isinstance(over, Unknowns) else _ends(over)
    problems: list[str] = []
    for end in ends:  # bounds are intervals, so both ends suffice
        for path, value in zip(over.names, end.tolist(), strict=True):
            try:
                with_values(scene, {path: value})
            except InputError as error:
                problems += error.problems
    if problems:
        raise InputError(list(dict.fromkeys(problems)))
    return over


def _ends(grounds: Grounds) -> tuple[Floats, Floats]:
    return grounds.points().min(axis=0), grounds.points().max(axis=0)


def _box(scene: Scene, given: Mapping[str, Any]) -> Unknowns:
    problems = [f"{path}: expected (low, high), got {pair}" for path, pair in given.items() if not _is_pair(pair)]
    ends = {path: pair for path, pair in given.items() if _is_pair(pair)}
    try:
        if ends or not problems:
            return Unknowns.of(scene, [Unknown(path, low, high) for path, (low, high) in ends.items()])
    except InputError as error:
        problems += error.problems
    raise InputError(problems)


def _is_pair(given: Any) -> bool:
    return isinstance(given, Sequence) and not isinstance(given, str) and len(given) == 2
