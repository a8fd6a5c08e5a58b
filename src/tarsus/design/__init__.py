"""Design: what a description or a signal should be, given what it should do."""

from tarsus.design.adaptive import AdaptiveGait, Sense, adapt
from tarsus.design.gait_fronts import GaitFront, GaitPoint, gait
from tarsus.design.gait_header import gait_header_text
from tarsus.design.landing_files import header_text, landing_table, write_landing
from tarsus.design.links import Landscape, LinkDesign, design_links, landscape
from tarsus.design.over import Box, Ensemble
from tarsus.design.request import Options, Sensor
from tarsus.design.soft_landing import LandingDesign, landing
from tarsus.design.step_lift import StepLift, step_lift
from tarsus.design.target import Objective
from tarsus.design.unknowns import Symmetry
from tarsus.model.standing import standing

__all__ = [
    "AdaptiveGait",
    "Box",
    "Ensemble",
    "GaitFront",
    "GaitPoint",
    "LandingDesign",
    "Landscape",
    "LinkDesign",
    "Objective",
    "Options",
    "Sense",
    "Sensor",
    "StepLift",
    "Symmetry",
    "adapt",
    "design_links",
    "gait",
    "gait_header_text",
    "header_text",
    "landing",
    "landing_table",
    "landscape",
    "standing",
    "step_lift",
    "write_landing",
]
