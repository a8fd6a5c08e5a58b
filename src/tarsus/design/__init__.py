"""Design: what a description or a signal should be, given what it should do."""

from tarsus.design.links import Landscape, LinkDesign, design_links, landscape
from tarsus.design.over import Box, Ensemble
from tarsus.design.soft_landing import LandingDesign, landing
from tarsus.design.step_lift import StepLift, step_lift
from tarsus.model.standing import standing

__all__ = [
    "Box",
    "Ensemble",
    "LandingDesign",
    "Landscape",
    "LinkDesign",
    "StepLift",
    "design_links",
    "landing",
    "landscape",
    "standing",
    "step_lift",
]
