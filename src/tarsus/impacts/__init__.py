"""Impact laws and forces from records near the ground and in the air."""

from tarsus.impacts.alignment import Alignment, align, residual_gate, subtract
from tarsus.impacts.detection import detect_impacts
from tarsus.impacts.estimates import Spread, common_ratio, spread
from tarsus.impacts.impact_map import FitWindow, ImpactMapEstimate, estimate_impact_map
from tarsus.impacts.shapes import compare_with_modes

__all__ = [
    "Alignment",
    "FitWindow",
    "ImpactMapEstimate",
    "Spread",
    "align",
    "common_ratio",
    "compare_with_modes",
    "detect_impacts",
    "estimate_impact_map",
    "residual_gate",
    "spread",
    "subtract",
]
