"""What a run is judged by: one definition of every measure, used by every table."""

from tarsus.measure.history import FootHistory, foot_history
from tarsus.measure.periods import RESOLUTION, Measure, Measures, period_statistics, scene_period
from tarsus.measure.walking import STANDSTILL, measures_of, walk_statistics

__all__ = [
    "RESOLUTION",
    "STANDSTILL",
    "FootHistory",
    "Measure",
    "Measures",
    "foot_history",
    "measures_of",
    "period_statistics",
    "scene_period",
    "walk_statistics",
]
