"""What a run is judged by: one definition of every measure, used by every table."""

from tarsus.measure.history import COUNTED, DWELL, RESOLUTION, Counting, FootHistory, foot_history
from tarsus.measure.measure import Caution, CautionKind, Measure, Measures, Scope, no_measure
from tarsus.measure.periods import (
    by_window,
    histories_of,
    period_edges,
    period_statistics,
    scene_period,
    window_statistics,
)
from tarsus.measure.walking import STANDSTILL, measures_of, walk_statistics
from tarsus.measure.whole import whole_run_statistics

__all__ = [
    "COUNTED",
    "DWELL",
    "RESOLUTION",
    "STANDSTILL",
    "Caution",
    "CautionKind",
    "Counting",
    "FootHistory",
    "Measure",
    "Measures",
    "Scope",
    "by_window",
    "foot_history",
    "histories_of",
    "measures_of",
    "no_measure",
    "period_edges",
    "period_statistics",
    "scene_period",
    "walk_statistics",
    "whole_run_statistics",
    "window_statistics",
]
