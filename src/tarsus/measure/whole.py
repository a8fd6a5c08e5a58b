"""What feet do in a whole run from its start, transients included; names begin with max, total or longest."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tarsus.measure.history import RESOLUTION, Counting, FootHistory
from tarsus.measure.measure import Measure, Measures, Scope, of_feet
from tarsus.measure.periods import Judged, histories_of

__all__ = ["whole_run_statistics"]


def whole_run_statistics(
    run: Judged,
    period: float | None = None,
    height: float = RESOLUTION,
    dwell: float | None = None,
    histories: Mapping[str, FootHistory] | None = None,
) -> Measures:
    """Measures of the feet over a whole run; arguments as for `tarsus.measure.period_statistics`. None has a spread."""
    counting = Counting.of(run.period if period is None else period, height, dwell)
    histories = histories_of(run) if histories is None else histories
    words = counting.words()

    def measure(values: list[float], unit: str, scope: Scope, definition: str) -> Measure:
        rows = np.array(values, dtype=float).reshape(-1, 1)
        return of_feet(
            rows, tuple(histories), unit, definition.format(**words), scope,
            height=counting.height if "{height}" in definition else None,
            dwell=counting.dwell if "{dwell}" in definition else None,
        )  # fmt: skip

    feet = list(histories.values())
    stays = [one.contacts(height) for one in feet]
    return Measures(
        {
            "max_peak": measure(
                [float(one.top.max()) if len(one.top) else np.nan for one in feet], "m", Scope.WORST,
                "highest gap in the whole run after its start, a flight from its start included",
            ),
            "total_bounces": measure(
                [float(len(one.bounces(counting))) for one in feet], "1", Scope.MEAN,
                "bounces in the whole run: flights from a touchdown to the next, or cut off by the end, whose apex "
                "clears {height}, after a contact shorter than {dwell}, however they began",
            ),
            "total_rebounds": measure(
                [float(len(one.rebounds(height))) for one in feet], "1", Scope.MEAN,
                "flights in the whole run that begin by restitution and clear {height}",
            ),
            "all_rebounds": measure(
                [float(len(one.rebounds(0.0))) for one in feet], "1", Scope.MEAN,
                "flights in the whole run that begin by restitution, however low: a simulation has no resolution",
            ),
            "longest_contact": measure(
                [float((end - start).max(initial=0.0)) for start, end in stays], "s", Scope.WORST,
                "longest contact in the whole run, flights below {height} included",
            ),
        }
    )  # fmt: skip
