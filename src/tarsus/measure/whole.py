"""What feet do in a whole run from its start, transients included; names begin with max, total or longest."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass

import numpy as np

from tarsus.measure.history import RESOLUTION, Counting, Histories
from tarsus.measure.measure import Definition, Measured, Measures, Moments, Scope, of_feet
from tarsus.measure.segments import Floats
from tarsus.measure.table import HasMeasures, Judgement, RunTable


@dataclass(frozen=True)
class InWholeRun(Definition):
    """A measure with one value (nh,) for every foot. of: what gives them of one that is added; those of the engine's
    measures have none."""

    of: Callable[[Histories, Counting], Floats] | None = None


WHOLE_RUN = {
    "max_peak": InWholeRun(
        "m", Scope.WORST, "highest gap in the whole run after its start, a flight from its start included"
    ),
    "total_bounces": InWholeRun(
        "1",
        Scope.MEAN,
        "bounces in the whole run: flights from a touchdown to the next, or cut off by the end, whose apex "
        "clears {height}, after a contact shorter than {dwell}, however they began",
    ),
    "total_rebounds": InWholeRun(
        "1", Scope.MEAN, "flights in the whole run that begin by restitution and clear {height}"
    ),
    "total_rebounds_any_height": InWholeRun(
        "1",
        Scope.MEAN,
        "flights in the whole run that begin by restitution, however low: a simulation has no resolution",
    ),
    "longest_contact": InWholeRun(
        "s", Scope.WORST, "longest contact in the whole run, flights below {height} included"
    ),
}
"""Measures of a foot in a whole run, by name; likewise."""


def value_of(name: str, histories: Histories, counting: Counting) -> Floats:
    """Value (nh,) of a measure of every foot in a whole run."""
    if (of := WHOLE_RUN[name].of) is not None:
        return of(histories, counting)
    return histories.native.in_whole_run(name, counting.height, histories.dwell(counting))


def whole_run_statistics(
    run: HasMeasures, period: float | None = None, height: float = RESOLUTION, dwell: float | None = None
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
            Moments.of(value_of(name, histories, judgement.by_foot), np.arange(number), number),
            runs,
            feet,
            one,
            counting=judgement.counting,
        )
        for name, one in WHOLE_RUN.items()
        if names is None or name in names
    }
