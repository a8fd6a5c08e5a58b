"""Experiments: a synthetic vibrometer, and the processing of records near the ground and in the air."""

from tarsus.experiment.alignment import Alignment, align, subtract
from tarsus.experiment.estimates import Spread, common_ratio, spread
from tarsus.experiment.force import estimate_forces, impact_forces
from tarsus.experiment.gate import Verdict, residual_gate
from tarsus.experiment.impact_map import ImpactMapEstimate, Window, estimate_impact_map
from tarsus.experiment.impacts import detect_impacts, plain_figures
from tarsus.experiment.shapes import compare_with_modes, normalised
from tarsus.experiment.vibrometer import Vibrometer

__all__ = [
    "Alignment",
    "ImpactMapEstimate",
    "Spread",
    "Verdict",
    "Vibrometer",
    "Window",
    "align",
    "common_ratio",
    "compare_with_modes",
    "detect_impacts",
    "estimate_forces",
    "estimate_impact_map",
    "impact_forces",
    "normalised",
    "plain_figures",
    "residual_gate",
    "spread",
    "subtract",
]
