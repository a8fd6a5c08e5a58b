"""What a run is judged by: one definition of every measure, of one run and of many."""

from tarsus.measure.history import (
    COUNTED,
    DWELL,
    RESOLUTION,
    Counting,
    EventHistories,
    Flights,
    Histories,
    Knots,
    KnownHistories,
    Points,
)
from tarsus.measure.measure import (
    Caution,
    CautionKind,
    Measure,
    Measured,
    Measures,
    Moments,
    Scope,
    no_measure,
)
from tarsus.measure.periods import (
    PER_WINDOW,
    by_period,
    by_window,
    histories_of,
    period_statistics,
    scene_period,
    window_statistics,
)
from tarsus.measure.table import Judged, Judgement, RunTable, periods_used
from tarsus.measure.walking import STANDSTILL, measured, measures_of, walk_statistics
from tarsus.measure.whole import whole_run_statistics

__all__ = [
    "COUNTED",
    "DWELL",
    "PER_WINDOW",
    "RESOLUTION",
    "STANDSTILL",
    "Caution",
    "CautionKind",
    "Counting",
    "EventHistories",
    "Flights",
    "Histories",
    "Judged",
    "Judgement",
    "Knots",
    "KnownHistories",
    "Measure",
    "Measured",
    "Measures",
    "Moments",
    "Points",
    "RunTable",
    "Scope",
    "by_period",
    "by_window",
    "histories_of",
    "measured",
    "measures_of",
    "no_measure",
    "period_statistics",
    "periods_used",
    "scene_period",
    "walk_statistics",
    "whole_run_statistics",
    "window_statistics",
]
