"""What feet do in a whole run from its start, transients included; names begin with max, total or longest."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass

import numpy as np

from tarsus.measure.history import RESOLUTION, Counting, Histories
from tarsus.measure.measure import Definition, Measured, Measures, Moments, Scope, of_feet
from tarsus.measure.segments import Floats, Rows, largest, sums
from tarsus.measure.table import Judged, Judgement, RunTable


@dataclass(frozen=True)
class InWholeRun(Definition):
    """A measure with one value (nh,) for every foot."""

    of: Callable[[Histories, Counting], Floats]


def _number(histories: Histories, flights: Rows) -> Floats:
    return sums(histories.flights.own[flights], len(histories.flights.until))


def _highest(histories: Histories, _: Counting) -> Floats:
    found = largest(histories.tops.own, len(histories.flights.until), histories.tops.value)
    return np.where(np.isfinite(found), found, np.nan)


def _longest(histories: Histories, counting: Counting) -> Floats:
    own, start, end = histories.flights.contacts(counting.height)
    return np.maximum(largest(own, len(histories.flights.until), end - start), 0.0)


WHOLE_RUN = {
    "max_peak": InWholeRun(
        "m", Scope.WORST, "highest gap in the whole run after its start, a flight from its start included",
        _highest,
    ),
    "total_bounces": InWholeRun(
        "1", Scope.MEAN,
        "bounces in the whole run: flights from a touchdown to the next, or cut off by the end, whose apex "
        "clears {height}, after a contact shorter than {dwell}, however they began",
        lambda feet, counting: _number(feet, feet.flights.bounces(counting)),
    ),
    "total_rebounds": InWholeRun(
        "1", Scope.MEAN, "flights in the whole run that begin by restitution and clear {height}",
        lambda feet, counting: _number(feet, feet.flights.rebounds(counting.height)),
    ),
    "total_rebounds_any_height": InWholeRun(
        "1", Scope.MEAN,
        "flights in the whole run that begin by restitution, however low: a simulation has no resolution",
        lambda feet, _: _number(feet, feet.flights.rebounds(0.0)),
    ),
    "longest_contact": InWholeRun(
        "s", Scope.WORST, "longest contact in the whole run, flights below {height} included", _longest
    ),
}  # fmt: skip
"""Measures of a foot in a whole run, by name; likewise."""


def whole_run_statistics(
    run: Judged, period: float | None = None, height: float = RESOLUTION, dwell: float | None = None
) -> Measures:
    """Measures of the feet over a whole run; arguments as for `tarsus.measure.period_statistics`. None has a spread."""
    judgement = Judgement(RunTable.of(run), period, None, height, dwell)
    return Measures({name: one.of(0) for name, one in in_whole_run(judgement).items()})


def in_whole_run(judgement: Judgement, names: Collection[str] | None = None) -> dict[str, Measured]:
    """The measures of `whole_run_statistics` of many runs: all, or those of ``names`` at the cost of these alone."""
    feet, histories, runs = judgement.table.feet, judgement.histories, len(judgement.table)
    number = runs * len(feet)
    return {
        name: of_feet(
            Moments.of(one.of(histories, judgement.by_foot), np.arange(number), number), runs, feet, one,
            counting=judgement.counting,
        )
        for name, one in WHOLE_RUN.items()
        if names is None or name in names
    }  # fmt: skip
