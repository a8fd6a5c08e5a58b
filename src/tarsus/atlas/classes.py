"""Classes of motions, as coarse as they are sound: how often a motion repeats, and what its feet do on the ground.

A class is a number: 16 times the multiple of the drive period, and a bit for each of what is in `DOES`; below 0 those
of `WORDS`. Counts of bounces are none of it: they change a hundred times along a line on which nothing else does.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from tarsus.orbits.basins import CHAOTIC, FAILED, OTHERS, UNSETTLED
from tarsus.orbits.settling import Settling

Codes = NDArray[np.int16]

TOUCHES, HELD, RESTS, STAYS = 1, 2, 4, 8
DOES = {TOUCHES: "touches the ground", HELD: "held", RESTS: "comes to rest", STAYS: "stays on the ground"}
"""What feet do in a period: any touches; any is captured, or never released; bounces of any accumulate to rest; all of
them are on the ground throughout."""

REFUSED = -4
WORDS = {**OTHERS, CHAOTIC: "chaotic", UNSETTLED: "not settled", FAILED: "did not reach its end", REFUSED: "refused"}
"""Classes of runs that do not repeat: twins of chaotic ones part; the scene refuses the values of refused ones."""


def words(code: int) -> str:
    """A class in words, as "period 2, held"."""
    if code < 0:
        return WORDS[code]
    does = code % 16
    said = [text for bit, text in DOES.items() if does & bit and bit != TOUCHES]
    if does & STAYS:
        said = [DOES[STAYS]]
    return ", ".join([f"period {code // 16}", *(said if does else ["never touches the ground"])])


def meanings(codes: Iterable[int]) -> dict[str, str]:
    """What each word of some classes means, by the word."""
    found = set(codes)
    bits = {bit for code in found if code >= 0 for bit in DOES if code % 16 & bit and bit != TOUCHES}
    multiples = sorted({code // 16 for code in found if code >= 0})
    said = {f"period {k}": f"the motion repeats after {k} drive period{'s' * (k > 1)}" for k in multiples}
    said |= {DOES[bit]: _MEANING[bit] for bit in sorted(bits)}
    if any(code >= 0 and code % 16 == 0 for code in found):
        said |= {"never touches the ground": "no foot does, in any drive period"}
    return said | {WORDS[code]: _OPEN[code] for code in sorted(found) if code in _OPEN}


_MEANING = {
    HELD: "a foot lands without a rebound in every such period, or never leaves the ground",
    RESTS: "the bounces of a foot follow each other ever faster, until it lies on the ground",
    STAYS: "all feet are on the ground throughout",
}
_OPEN = {
    CHAOTIC: "the motion does not repeat, and two that begin almost alike part",
    UNSETTLED: "the motion does not repeat within a run, and two that begin almost alike stay together",
    FAILED: "the run stopped before its end",
    REFUSED: "the scene does not take these values",
}


def codes_of(settling: Settling) -> Codes:
    """Class (nr,) of every run."""
    multiple = settling.multiple
    code = np.full(len(multiple), UNSETTLED, dtype=np.int16)
    stays, never_released = on_the_ground(settling)
    for r in np.flatnonzero(multiple).tolist():
        k = int(multiple[r])
        counted = {name: of[r, -k:].any() for name, of in settling.counts.items()}
        does = TOUCHES * (counted["impacts"] or never_released[r])
        does += HELD * (counted["captures"] or never_released[r]) + RESTS * counted["rests"] + STAYS * stays[r]
        code[r] = 16 * k + does
    code[~settling.runs.done] = FAILED
    open_ = np.flatnonzero(code == UNSETTLED)
    code[open_[settling.chaotic(open_)]] = CHAOTIC
    return code


def on_the_ground(settling: Settling) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Whether all feet, and any foot, of every run (nr,) lie on the ground for as long as the motion's period."""
    runs, feet = settling.runs, settling.runs.plan.feet
    since = np.array([max(int(k), 1) for k in settling.multiple]) * settling.periods
    count = (runs.held & (runs.since <= (runs.time - since)[:, None])).sum(axis=1)
    return (count == feet) & (feet > 0), count > 0
