"""Derivatives of returns, by pairs of returns from either side: whatever returns has derivatives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from tarsus.orbits.returns import Returned

Floats = NDArray[np.float64]
Copies = Callable[[Sequence[tuple[int, float]]], Sequence["Returned | None"]]
"""Returns by the number of a direction and a step along it; None where there is no return."""

FINE = 3e-4
"""Step, of the size of what is moved, of differences of fourth order by two pairs: returns resolve 1e-13 of themselves,
so that it leaves 3e-10."""
STEPS = (3e-5, 3e-6, 3e-7, 3e-8, 3e-9, 3e-10, 3e-11)
"""Steps of single pairs: the first leaves 3e-9. The others are for returns near a change of their events, that move
fast."""
BENT = 1e-3
"""Change of a slope over a step, of the slope, above which a shorter step is taken: its square is the error."""
RESOLVED = 1e-9
"""Difference of returns, of their size, below which their bend is not resolved: the engine's steps leave a third of it
where they fall otherwise."""
NOISE = 1e-8
"""Size below which a multiplier is rounding."""


def return_slopes(own: Returned, copies: Copies, count: int, scale: Floats, *, fine: bool = False) -> Floats:
    """Derivatives (N, count) of a return by directions in units of the steps along them.

    scale (N,): sizes of the return's entries; fine: whether by two pairs where nothing is in the way. The events of all
    copies are those of the return itself, else the map bends or jumps in between, and the step is shortened. Where one
    side alone has them, as at the very change of the events, that side says how the return moves.
    """
    slopes, side = np.zeros((len(own.state), count)), np.zeros(count)
    left = list(range(count))
    if fine and left:
        left = _by_two_pairs(own, copies, slopes, scale)
    for step in STEPS:
        if not left:
            break
        found, again = copies([(k, sign * step) for k in left for sign in (1.0, -1.0)]), []
        for k, ahead, behind in zip(left, found[::2], found[1::2], strict=True):
            before, sided = slopes[:, k] * step, side[k]
            moves, side[k] = _moves(own, ahead, behind)
            if moves and (side[k] != NEITHER or step == STEPS[0]):  # a jump counts least over the longest step
                slopes[:, k] = np.mean(moves, axis=0) / step
            other = moves[-1] if side[k] == BOTH else before
            known = side[k] in (BOTH, sided) and side[k] != NEITHER
            if not known or _bends(moves[0] / scale, other / scale):
                again.append(k)
        left = again
    return slopes


NEITHER, AHEAD, BEHIND, BOTH = range(4)
"""On which sides of a return its events are the same."""


def _moves(own: Returned, ahead: Returned | None, behind: Returned | None) -> tuple[list[Floats], int]:
    """By how much a return moves over a step, as seen on the sides with the same events, if any has them; which."""
    same = [one is not None and one.same_events(own) for one in (ahead, behind)]
    moves = [
        sign * (one.state - own.state)
        for sign, one, alike in zip((1.0, -1.0), (ahead, behind), same, strict=True)
        if one is not None and (alike or not any(same))
    ]
    return moves, AHEAD * same[0] + BEHIND * same[1]


def _by_two_pairs(own: Returned, copies: Copies, slopes: Floats, scale: Floats) -> list[int]:
    """Fill in derivatives (N, count) by differences of fourth order; numbers of the directions with other events, or
    along which the return bends too much."""
    places, left = FINE * np.array([1.0, -1.0, 2.0, -2.0]), []
    found = copies([(k, float(step)) for k in range(slopes.shape[1]) for step in places])
    for k in range(slopes.shape[1]):
        four = [one.state for one in found[4 * k : 4 * k + 4] if one is not None and one.same_events(own)]
        if len(four) < 4:
            left.append(k)
            continue
        near, far = (0.5 * (four[i] - four[i + 1]) for i in (0, 2))
        slopes[:, k] = (8.0 * near - far) / (6.0 * FINE)
        if _bends(2.0 * near / scale, far / scale):
            left.append(k)
    return left


def _bends(one: Floats, other: Floats) -> bool:
    """Whether two moves over a step differ by more than is resolved, and than a slope may change over it."""
    apart, size = np.abs(one - other).max(initial=0.0), np.abs(one + other).max(initial=0.0)
    return bool(apart > max(BENT * size, RESOLVED))
