"""What to know when reading measures: counts that leave out what a reader of a figure would count."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from tarsus.measure.history import Counting, Floats, FootHistory
from tarsus.measure.measure import Caution, CautionKind, Measure

HIGHEST = 0.1
"""Part of the flights that are the highest ones: those that a reader of a figure sees first."""
LOW = 0.05
"""Part of the peak below which the median bounce is invisible in a figure that shows the peak: a line's width."""
FEWEST = 3
"""Periods from which on a spread is stated with confidence: the standard deviation of n values is itself known to
1/sqrt(2 (n - 1)) of it, a half for three."""


def cautions(
    histories: Mapping[str, FootHistory],
    edges: Floats,
    counting: Counting,
    measures: Mapping[str, Measure],
    *,
    periods: bool,
) -> list[Caution]:
    """Warnings on the measures of feet between ``edges`` (np + 1,) [s]; ``periods``: these are drive periods."""
    found = []
    if len(edges) > 1:
        high: dict[str, str] = {}
        low: dict[str, str] = {}
        for name, history in histories.items():
            one = _of_foot(history, edges, counting)
            texts = _uncounted(*one), _low(*one, measures["peak"].per_foot[name])
            high |= {name: texts[0]} if texts[0] else {}
            low |= {name: texts[1]} if texts[1] else {}
        for kind, feet in ((CautionKind.HIGHEST_UNCOUNTED, high), (CautionKind.COUNTED_LOW, low)):
            for name, text in list(feet.items())[:1]:
                others = "" if len(feet) == 1 else f"; likewise {len(feet) - 1} of the other feet"
                rule = f"height {counting.words()['height']}, dwell {counting.words()['dwell']}"
                found.append(Caution(kind, f"Foot {name}: {text} ({rule}){others}."))
    count = max(len(edges) - 1, 0)
    if periods and count < FEWEST:
        found.append(
            Caution(
                CautionKind.FEW_PERIODS,
                f"The measures are of {count} drive period{'' if count == 1 else 's'}; "
                f"a spread takes {FEWEST} at least.",
            )
        )
    return found


def _of_foot(history: FootHistory, edges: Floats, counting: Counting) -> tuple[Floats, np.ndarray]:
    """Apexes [m] of the flights from the ground that begin between the edges, and which of them are bounces."""
    hops = history.hops(counting.height)
    counted = np.zeros(len(history.apex), dtype=bool)
    counted[history.bounces(counting)] = True
    begun = history.flight_start[hops]
    hops = hops[(begun >= edges[0]) & (begun <= edges[-1])]
    return history.apex[hops], counted[hops]


def _uncounted(apex: Floats, counted: np.ndarray) -> str:
    """A text where most of the highest flights are no bounces, else none."""
    top = np.argsort(apex, kind="stable")[::-1][: math.ceil(HIGHEST * len(apex))]
    missed = int(np.count_nonzero(~counted[top]))
    if 2 * missed <= len(top):
        return ""
    which = "the highest" if len(top) == 1 else f"{missed} of the highest {len(top)}"
    return (
        f"{which} of its {len(apex)} flights, up to {apex.max() * 1e6:.3g} um, follow longer contacts and are not "
        "counted as bounces"
    )


def _low(apex: Floats, counted: np.ndarray, peak: float) -> str:
    """A text where the typical bounce is far below the peak, else none."""
    if not counted.any():
        return ""
    typical = float(np.median(apex[counted]))
    if not typical < LOW * peak:
        return ""
    return f"its median bounce is {typical * 1e6:.3g} um high, its peak {peak * 1e6:.3g} um"
