"""Every set that a search has visited, what was read there and how it was found: on disk where a folder is given.

A search is a fixed sequence of questions, so a killed one is resumed by asking them again: those that were answered are
read back, the others are simulated. Both give the same bytes. Every search, that of the whole table and each without
one of its rows, has an archive of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.calibrate.problem import Problem
from tarsus.files.runstore import RunStore

__all__ = ["Archive"]

Floats = NDArray[np.float64]

DIGITS = 9
"""Digits to which points of the unit cube are rounded: a point that comes back from an optimiser is the same point."""


@dataclass
class Archive:
    """Visited points (n, nu) of the unit cube and their readings, by run branch.

    problem: what is asked; store: where answers are kept, from the part of this number on; on_sets: called after every
    question with the sets asked for and the most that are still to come; simulated: sets that were simulated in this
    process; ahead: most sets that are still to be asked for, as the search says.
    """

    problem: Problem
    store: RunStore | None = None
    part: int = 0
    on_sets: Callable[[int, int], None] | None = None
    simulated: int = 0
    ahead: int = 0
    _asked: int = 0
    _points: dict[int, list[Floats]] = field(default_factory=dict)
    _readings: dict[int, list[NDArray[np.floating]]] = field(default_factory=dict)
    _found: dict[int, list[str]] = field(default_factory=dict)
    _place: dict[tuple[int, bytes], int] = field(default_factory=dict)

    def evaluate(self, run: int, cube: Floats, found: str | Sequence[str] = "") -> NDArray[np.floating]:
        """Readings (ns, rows, channels, samples) at points (ns, nu); those visited before are not simulated again.

        found: how the points were found, all or each.
        """
        points = np.round(cube, DIGITS) + 0.0  # no negative zeros
        keys = [(run, one.tobytes()) for one in points]
        fresh = [i for i, key in enumerate(keys) if key not in self._place]
        fresh = list({keys[i]: i for i in reversed(fresh)}.values())[::-1]
        if fresh:
            read = self._answer(run, points[fresh], self.problem.rows)
            known = sum(map(len, self._points.get(run, [])))
            self._points.setdefault(run, []).append(points[fresh])
            self._readings.setdefault(run, []).append(read)
            each = [found] * len(points) if isinstance(found, str) else found
            self._found.setdefault(run, []).extend(each[i] for i in fresh)
            self._place.update({keys[i]: known + n for n, i in enumerate(fresh)})
        self.ahead = max(self.ahead - len(points), 0)
        if self.on_sets is not None:
            self.on_sets(len(points), self.ahead)
        return self.points(run)[1][[self._place[key] for key in keys]]

    def points(self, run: int) -> tuple[Floats, NDArray[np.floating]]:
        """All visited points (n, nu) of a run branch and their readings."""
        for kept in (self._points, self._readings):
            if len(kept[run]) > 1:
                kept[run] = [np.concatenate(kept[run])]  # pyright: ignore[reportArgumentType]
        return self._points[run][0], self._readings[run][0]

    def found(self, run: int, points: Floats) -> tuple[str, ...]:
        """How visited points (ns, nu) were found first."""
        keys = [(run, one.tobytes()) for one in np.round(points, DIGITS) + 0.0]
        return tuple(self._found[run][self._place[key]] for key in keys)

    @property
    def visited(self) -> int:
        """Number of sets that were visited."""
        return len(self._place)

    def elsewhere(self, run: int, points: Floats, row: int) -> NDArray[np.floating]:
        """Readings (ns, channels, samples) at points (ns, nu) in a row that the search does not know, for its
        prediction."""
        return self._answer(run, np.round(points, DIGITS) + 0.0, (row,))[:, 0]

    def slopes(self, run: int, point: Floats) -> Floats:
        """Derivatives (rows, channels, samples, nu) of the readings at a point (nu,) by the unknowns' SI values."""
        points = np.round(point, DIGITS)[None] + 0.0
        slopes = self.problem.slopes
        assert slopes is not None
        at = self.problem.unknowns.values(points)[0]
        found = self._kept(run, points, "slopes", lambda: slopes(run, at, self.problem.rows))
        return np.asarray(found, dtype=np.float64)

    def _answer(self, run: int, points: Floats, rows: tuple[int, ...]) -> NDArray[np.floating]:
        def simulated() -> NDArray[np.floating]:
            self.simulated += len(points)
            return self.problem.simulate(run, self.problem.unknowns.values(points), rows)

        return self._kept(run, points, "readings", simulated)

    def _kept(
        self, run: int, points: Floats, what: str, make: Callable[[], NDArray[np.floating]]
    ) -> NDArray[np.floating]:
        """The answer to the next question, read back or made."""
        number, self._asked = self.part + self._asked, self._asked + 1
        kept = self.store.read(number) if self.store is not None else None
        if kept is not None:
            if int(kept["run"]) != run or what not in kept or not np.array_equal(kept["points"], points):
                raise InputError(
                    f"part {number} of the folder belongs to another search; give another folder with -o"
                )
            return kept[what]
        made = make()
        if self.store is not None:
            self.store.write(number, {"run": np.array(run), "points": points, what: made})
        return made
