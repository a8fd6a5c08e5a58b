"""A function of points whose values are kept: what was asked for once is not computed again, in this process or the
next."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.workers import spread

Arrays = dict[str, NDArray[Any]]
Function = Callable[[NDArray[np.float64]], Mapping[str, NDArray[Any]]]
"""Takes points (k, nu), gives arrays (k, ...) by name; the value of a point depends on nothing else."""

POINTS = "points"
"""Name of the points in a kept batch, which no array of a function may have."""

KEY_DIGITS = 16
"""Hexadecimal digits of a batch's name: 64 bits, and the points themselves are compared."""


class Memo:
    """Values of a function at the points that it was asked for, in the order of the questions.

    Every batch of points that are new is one file of the store, named by its points: whoever repeats a search, also one
    that was killed, asks the same questions and reads their answers. So a file that is damaged, or not there, is
    computed again with the same bytes, and several processes may ask at the same time. One thread at a time asks one
    memo; threads that search each have a memo with a name of its own.

    computed, reused: points that were computed in this process, and that were read back from the store.
    """

    def __init__(
        self, read: Callable[[str], Arrays | None], write: Callable[[str, Arrays], None], name: str = ""
    ) -> None:
        """read, write: of a store, arrays by key."""
        self.computed = self.reused = 0
        self._read, self._write, self._name = read, write, name
        self._place: dict[bytes, int] = {}
        self._known: Arrays = {}

    def __len__(self) -> int:
        return len(self._place)

    @property
    def points(self) -> NDArray[np.float64]:
        """All points (n, nu) that were asked for, each once, in the order of the questions; (0, 0) before the first."""
        return self._known[POINTS][: len(self)] if self._known else np.empty((0, 0))

    @property
    def values(self) -> Arrays:
        """Arrays (n, ...) of all points by name, in their order."""
        return {name: array[: len(self)] for name, array in self._known.items() if name != POINTS}

    def places(self, points: NDArray[np.floating]) -> NDArray[np.intp]:
        """Numbers (k,) in `points` of points (k, nu) that were asked for. Raises KeyError for any other."""
        return np.array([self._place[key] for key in _keys(_plain(points))], dtype=np.intp)

    def evaluate(
        self,
        points: NDArray[np.floating],
        function: Function,
        *,
        chunk: int | None = None,
        threads: int | None = 1,
        progress: Callable[[int, int], None] | None = None,
    ) -> Arrays:
        """Values at points (k, nu), each computed at most once.

        Parameters
        ----------
        points
            Where; points are the same where all their digits are. Whoever takes neighbours for the same rounds first.
        function
            Asked for those points that are neither remembered nor kept, once for a batch.
        chunk
            Points in a batch; by default all new ones of this call are one.
        threads
            Threads that compute batches at the same time; None: one for each processor of this process.
        progress
            Called as ``progress(new points that are known, new points)`` after each batch.

        Returns
        -------
        dict[str, ndarray]
            Arrays (k, ...) by name, as the function gives them.

        Raises
        ------
        InputError
            Where the store cannot be read or written. Batches that were finished are kept.
        """
        points = _plain(points)
        keys = _keys(points)
        first = {key: i for i, key in reversed(list(enumerate(keys))) if key not in self._place}
        fresh = points[sorted(first.values())]
        size = chunk if chunk is not None else max(len(fresh), 1)
        batches = [fresh[k : k + size] for k in range(0, len(fresh), size)]
        known = 0
        for batch, (arrays, read) in zip(
            batches, spread(lambda one: self._batch(one, function), batches, threads), strict=True
        ):
            self._remember(batch, arrays)
            self.reused, self.computed = (self.reused + read * len(batch), self.computed + (not read) * len(batch))
            known += len(batch)
            if progress is not None:
                progress(known, len(fresh))
        chosen = self.places(points)
        return {name: array[chosen] for name, array in self.values.items()}

    def _batch(self, points: NDArray[np.float64], function: Function) -> tuple[Mapping[str, NDArray[Any]], bool]:
        """Arrays of a batch, and whether they were read."""
        said = hashlib.sha256(f"{self._name}\0{points.shape}\0".encode() + points.tobytes())
        key = said.hexdigest()[:KEY_DIGITS]
        kept = self._read(key)
        if kept is not None and np.array_equal(kept.pop(POINTS), points):
            return kept, True
        made = {name: np.asarray(array) for name, array in function(points).items()}
        if POINTS in made or any(len(array) != len(points) for array in made.values()):
            raise ValueError(f"a function of {len(points)} points gives as many values, under names but '{POINTS}'")
        self._write(key, {POINTS: points, **made})
        return made, False

    def _remember(self, points: NDArray[np.float64], arrays: Mapping[str, NDArray[Any]]) -> None:
        known = len(self._place)
        self._place.update({key: known + i for i, key in enumerate(_keys(points))})
        for name, array in {POINTS: points, **arrays}.items():
            own = self._known[name] if name in self._known else array[:0]
            kind = np.result_type(own, array)  # of longer texts, a wider one
            if len(own) < len(self) or own.dtype != kind:  # twice the room, so that each is copied about once
                room = np.empty((2 * len(self), *array.shape[1:]), kind)
                room[:known] = own[:known]
                self._known[name] = own = room
            own[known : len(self)] = array


def _plain(points: NDArray[np.floating]) -> NDArray[np.float64]:
    return np.ascontiguousarray(points, dtype=np.float64) + 0.0  # no negative zeros


def _keys(points: NDArray[np.float64]) -> list[bytes]:
    return [one.tobytes() for one in points]
