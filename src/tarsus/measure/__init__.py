"""What a run is judged by: one definition of every measure, of one run and of many."""

from tarsus.measure.history import COUNTED, DWELL, RESOLUTION, Counting, Flights
from tarsus.measure.landmarks import departure, flight, point_speed, touchdown, touchdown_times, volts_at
from tarsus.measure.measure import Caution, CautionKind, Measure, Measured, Measures, Scope
from tarsus.measure.periods import histories_of, period_statistics, scene_period, window_statistics
from tarsus.measure.table import Judgement, RunTable
from tarsus.measure.walking import STANDSTILL, measured, measures_of, walk_statistics
from tarsus.measure.whole import whole_run_statistics

__all__ = [
    "COUNTED",
    "DWELL",
    "RESOLUTION",
    "STANDSTILL",
    "Caution",
    "CautionKind",
    "Counting",
    "Flights",
    "Judgement",
    "Measure",
    "Measured",
    "Measures",
    "RunTable",
    "Scope",
    "departure",
    "flight",
    "histories_of",
    "measured",
    "measures_of",
    "period_statistics",
    "point_speed",
    "scene_period",
    "touchdown",
    "touchdown_times",
    "volts_at",
    "walk_statistics",
    "whole_run_statistics",
    "window_statistics",
]
