"""Design: what a description should be, given what it should do."""

from tarsus.design.links import Landscape, LinkDesign, design_links, landscape
from tarsus.design.step_lift import StepLift, step_lift
from tarsus.model.standing import standing

__all__ = ["Landscape", "LinkDesign", "StepLift", "design_links", "landscape", "standing", "step_lift"]
