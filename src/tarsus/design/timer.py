"""Switching times of a timer: whole ticks, chosen among the neighbours of the exact times by what they cost; and texts
within the comments of files for its program."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.units import format_quantity

__all__ = ["in_comment", "in_ticks", "neighbours"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

MOST = 729
"""Neighbours that are tried at most: one tick to either side of six edges."""


def in_comment(text: str) -> str:
    """A text as it may stand in a comment of C, C++ or TOML: one printable line that neither begins nor ends one."""
    line = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    return line.replace("*/", "* /").replace("/*", "/ *")


def in_ticks(period: float, tick: float) -> int:
    """Ticks in a period [s]. Raises InputError where a tick [s] is none, or longer than a hundredth of the period."""
    if not tick > 0.0:
        raise InputError(f"tick: expected a time above 0 s, got {tick:g} s")
    if period / tick > 1e15:
        raise InputError(
            f"tick: {tick:g} s is more than 1e15 times in a period of {period:g} s; give a longer one"
        )
    count = round(period / tick)
    if count < 100:
        shown = format_quantity(float(f"{tick:.4g}"), "s")
        raise InputError(
            f"tick: a timer of {shown} has {count} ticks in a period of {period:g} s, expected at least 100"
        )
    return count


def neighbours(durations: Floats, total: int, rng: np.random.Generator) -> Ints:
    """Ticks (n, S) of plateaus, at least one each and ``total`` together, whose edges lie within a tick of those of the
    durations (S,); the first row is plain rounding."""
    edges = np.cumsum(durations)[:-1] / durations.sum() * total
    near = np.rint(edges)
    inner = len(edges)
    shifts = np.array(list(product((0, -1, 1), repeat=inner))) if 3**inner <= MOST else None
    if shifts is None:
        shifts = np.concatenate(
            [np.zeros((1, inner), dtype=int), rng.integers(-1, 2, size=(MOST - 1, inner))]
        )
    moved = near + shifts[np.argsort(np.abs(shifts).sum(axis=1), kind="stable")]
    ticks = np.diff(np.column_stack([np.zeros(len(moved)), moved, np.full(len(moved), total)]), axis=1)
    return ticks[(ticks >= 1).all(axis=1)].astype(np.int64)
