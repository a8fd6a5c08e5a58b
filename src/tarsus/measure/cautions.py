"""What to know when reading measures: counts that leave out what a reader of a figure would count."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from tarsus.measure.measure import Caution, CautionKind, Measure
from tarsus.tables.numbers import amount, interval

if TYPE_CHECKING:
    from tarsus.measure.segments import Floats
    from tarsus.measure.windows import WindowedHistories

HIGHEST = 0.1
"""Part of the flights that are the highest ones: those that a reader of a figure sees first."""
LOW = 0.05
"""Part of the peak below which the median bounce is invisible in a figure that shows the peak: a line's width."""
FEWEST = 3
"""Periods from which on a spread is stated with confidence: the standard deviation of n values is itself known to
1/sqrt(2 (n - 1)) of it, a half for three."""


def cautions(
    seen: WindowedHistories, feet: Sequence[str], measures: Mapping[str, Measure], *, count: int, periods: bool
) -> list[Caution]:
    """Warnings on the measures of the feet of one run by so many windows; ``periods``: these are drive periods."""
    found = []
    if count and feet:
        counting = seen.counting.of_one(0)
        dwell = interval(float(np.min(counting.dwell)), float(np.max(counting.dwell)), "s")
        high: dict[str, str] = {}
        low: dict[str, str] = {}
        for name, one in zip(feet, _of_feet(seen), strict=True):
            texts = _uncounted(*one, dwell), _low(*one, measures["peak"].per_foot[name])
            high |= {name: texts[0]} if texts[0] else {}
            low |= {name: texts[1]} if texts[1] else {}
        for kind, cautioned in ((CautionKind.HIGHEST_UNCOUNTED, high), (CautionKind.COUNTED_LOW, low)):
            for name, text in list(cautioned.items())[:1]:
                others = "" if len(cautioned) == 1 else f"; likewise {len(cautioned) - 1} of the other feet"
                found.append(Caution(kind, f"Foot {name}: {text}{others}."))
    if periods and count < FEWEST:
        found.append(
            Caution(
                CautionKind.FEW_PERIODS,
                f"The measures are of {count} drive period{'' if count == 1 else 's'}; "
                f"a spread takes {FEWEST} at least.",
            )
        )
    return found


def _of_feet(seen: WindowedHistories) -> list[tuple[Floats, np.ndarray]]:
    """Of each foot: apexes [m] of the flights from the ground that begin within the windows, and which are bounces."""
    flights, windows = seen.flights, seen.windows
    hops = seen.histories.hops(seen.counting.height)
    counted = np.zeros(len(flights.apex), dtype=bool)
    counted[seen.histories.bounces(seen.counting)] = True
    begun, own = flights.start[hops], flights.own[hops]
    hops = hops[(begun >= windows.edges[windows.first[own]]) & (begun <= windows.edges[windows.first[own + 1] - 1])]
    feet = np.searchsorted(flights.own[hops], np.arange(len(flights.until) + 1))
    return [(flights.apex[hops[a:b]], counted[hops[a:b]]) for a, b in pairwise(feet)]


def _uncounted(apex: Floats, counted: np.ndarray, dwell: str) -> str:
    """A text where most of the highest flights are no bounces, for they follow longer contacts; else none."""
    top = np.argsort(apex, kind="stable")[::-1][: math.ceil(HIGHEST * len(apex))]
    missed = int(np.count_nonzero(~counted[top]))
    if 2 * missed <= len(top):
        return ""
    share = "the" if missed == len(top) else f"{missed} of the"
    high = amount(float(apex.max()), "m", 3)
    if len(top) == 1:
        return f"the highest jump ({high}) follows a contact longer than {dwell}, so it is not counted as a bounce"
    return (
        f"{share} {len(top)} highest jumps (up to {high}) follow contacts longer than {dwell}, so they are not counted "
        "as bounces"
    )


def _low(apex: Floats, counted: np.ndarray, peak: float) -> str:
    """A text where the typical bounce is far below the peak, else none."""
    if not counted.any():
        return ""
    heights = np.sort(apex[counted])
    middle = len(heights) // 2
    typical = float(0.5 * (heights[middle] + heights[-1 - middle]))  # `np.median` loads masked arrays at first use
    if not typical < LOW * peak:
        return ""
    return f"its median bounce is {amount(typical, 'm', 3)} high, its peak {amount(peak, 'm', 3)}"
