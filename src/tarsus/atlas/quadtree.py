"""A grid that is refined where classes change.

A square whose corners differ is split, and so are its eight neighbours: a change that passes between two corners that
agree is then met from the side. A point that was never run has the class of the lower corner of its square, whose four
corners agree.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]
Ask = Callable[[Ints], NDArray[np.int16]]
"""Takes numbers (k, 2) of grid points along x and y, gives their classes (k,)."""


@dataclass
class Quadtree:
    """Classes on a grid of N + 1 points each way, N a power of 2.

    code (N + 1, N + 1), by x and y: class of every point; source: number of the run that it has its class from; points
    (nr, 2): where the runs are, in their order.
    """

    code: NDArray[np.int16]
    source: NDArray[np.int32]
    points: Ints

    @classmethod
    def refined(cls, depth: int, coarse: int, ask: Ask) -> Quadtree:
        """From 2^coarse squares each way to 2^depth."""
        size = 2**depth + 1
        grid = cls(np.zeros((size, size), np.int16), np.full((size, size), -1, np.int32), np.zeros((0, 2), np.int64))
        step = 2 ** (depth - coarse)
        every = np.ones((2**coarse + 1,) * 2, dtype=bool)
        grid._run(every, step, ask)
        while step > 1:
            step //= 2
            while (wanted := grid._wanted(step)).any():
                grid._run(wanted, step, ask)
            grid._fill(step)
        return grid

    @property
    def known(self) -> NDArray[np.bool_]:
        """Points (N + 1, N + 1) that were run."""
        known = np.zeros(self.code.shape, dtype=bool)
        known[self.points[:, 0], self.points[:, 1]] = True
        return known

    def _wanted(self, step: int) -> NDArray[np.bool_]:
        """Points of squares of twice this step that are to be split, and were not run."""
        code = self.code[:: 2 * step, :: 2 * step]
        low = np.minimum(code[1:], code[:-1])
        high = np.maximum(code[1:], code[:-1])
        differs = np.minimum(low[:, 1:], low[:, :-1]) != np.maximum(high[:, 1:], high[:, :-1])
        around = np.pad(differs, 1)
        n = len(differs)
        split = np.any([around[i : i + n, j : j + n] for i in range(3) for j in range(3)], axis=0)
        wanted = np.zeros((2 * n + 1,) * 2, dtype=bool)
        for i in range(3):
            for j in range(3):
                wanted[i : i + 2 * n : 2, j : j + 2 * n : 2] |= split
        return wanted & ~self.known[::step, ::step]

    def _run(self, wanted: NDArray[np.bool_], step: int, ask: Ask) -> None:
        points = np.argwhere(wanted) * step
        first = len(self.points)
        x, y = points.T
        self.code[x, y] = ask(points)
        self.source[x, y] = np.arange(first, first + len(points))
        self.points = np.concatenate([self.points, points])

    def _fill(self, step: int) -> None:
        """Points of this step that were not run have what the lower corner of their square has."""
        known = self.known[::step, ::step]
        lower = np.arange(len(known)) // 2 * 2
        for of in (self.code, self.source):
            part = of[::step, ::step]
            part[~known] = part[np.ix_(lower, lower)][~known]
