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
from tarsus.measure.origins import event_slopes
from tarsus.measure.periods import (
    PER_WINDOW,
    PerWindow,
    by_period,
    by_window,
    histories_of,
    period_statistics,
    scene_period,
    window_statistics,
)
from tarsus.measure.table import Judged, Judgement, RunTable, periods_used
from tarsus.measure.walking import STANDSTILL, measured, measures_of, walk_statistics
from tarsus.measure.whole import WHOLE_RUN, InWholeRun, whole_run_statistics

__all__ = [
    "COUNTED",
    "DWELL",
    "PER_WINDOW",
    "RESOLUTION",
    "STANDSTILL",
    "WHOLE_RUN",
    "Caution",
    "CautionKind",
    "Counting",
    "EventHistories",
    "Flights",
    "Histories",
    "InWholeRun",
    "Judged",
    "Judgement",
    "Knots",
    "KnownHistories",
    "Measure",
    "Measured",
    "Measures",
    "Moments",
    "PerWindow",
    "Points",
    "RunTable",
    "Scope",
    "by_period",
    "by_window",
    "event_slopes",
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
