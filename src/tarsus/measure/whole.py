"""What feet do in a whole run from its start, transients included; names begin with max, total or longest."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass

import numpy as np

from tarsus.measure.history import RESOLUTION, Counting, FootHistory
from tarsus.measure.measure import Measures, Scope, of_feet
from tarsus.measure.periods import Judged, histories_of

__all__ = ["whole_run_statistics"]


@dataclass(frozen=True)
class _Definition:
    unit: str
    scope: Scope
    words: str
    of: Callable[[FootHistory, Counting], float]


def _longest(foot: FootHistory, counting: Counting) -> float:
    start, end = foot.contacts(counting.height)
    return float((end - start).max(initial=0.0))


_DEFINITIONS = {
    "max_peak": _Definition(
        "m", Scope.WORST, "highest gap in the whole run after its start, a flight from its start included",
        lambda foot, _: float(foot.top.max()) if len(foot.top) else np.nan,
    ),
    "total_bounces": _Definition(
        "1", Scope.MEAN,
        "bounces in the whole run: flights from a touchdown to the next, or cut off by the end, whose apex "
        "clears {height}, after a contact shorter than {dwell}, however they began",
        lambda foot, counting: float(len(foot.bounces(counting))),
    ),
    "total_rebounds": _Definition(
        "1", Scope.MEAN, "flights in the whole run that begin by restitution and clear {height}",
        lambda foot, counting: float(len(foot.rebounds(counting.height))),
    ),
    "total_rebounds_any_height": _Definition(
        "1", Scope.MEAN,
        "flights in the whole run that begin by restitution, however low: a simulation has no resolution",
        lambda foot, _: float(len(foot.rebounds(0.0))),
    ),
    "longest_contact": _Definition(
        "s", Scope.WORST, "longest contact in the whole run, flights below {height} included", _longest
    ),
}  # fmt: skip


def whole_run_statistics(
    run: Judged,
    period: float | None = None,
    height: float = RESOLUTION,
    dwell: float | None = None,
    histories: Mapping[str, FootHistory] | None = None,
    names: Collection[str] | None = None,
) -> Measures:
    """Measures of the feet over a whole run; arguments as for `tarsus.measure.period_statistics`. None has a spread."""
    counting = Counting.of(run.period if period is None else period, height, dwell)
    histories = histories_of(run) if histories is None else histories
    words = counting.words()
    found = {}
    for name, one in _DEFINITIONS.items():
        if names is not None and name not in names:
            continue
        rows = np.array([one.of(foot, counting) for foot in histories.values()]).reshape(-1, 1)
        found[name] = of_feet(
            rows, tuple(histories), one.unit, one.words.format(**words), one.scope,
            height=counting.height if "{height}" in one.words else None,
            dwell=counting.dwell if "{dwell}" in one.words else None,
        )  # fmt: skip
    return Measures(found)
