"""Design: what a description or a signal should be, given what it should do.

A verb is one function, with its settings as words, as a mapping or as a TOML file (`settings_text` writes it):
`landing`, `gait` and its presets `steady` and `hold`, `adapt`, `learn`, `leg`. Each but the last two returns a result
with ``table()``, ``to_dict()`` and ``write(folder)``.
"""

from tarsus.design.adaptive import adapt
from tarsus.design.adaptive_gait import AdaptiveGait
from tarsus.design.gait_front import GaitFront, GaitPoint
from tarsus.design.gait_motion import GaitMotion
from tarsus.design.gait_request import Sense
from tarsus.design.gait_search import gait
from tarsus.design.gait_unknowns import Symmetry
from tarsus.design.grounds import Grounds
from tarsus.design.headers import drives_header_text, gait_header_text, header_text
from tarsus.design.landing_design import LandingDesign
from tarsus.design.landing_request import Sensor
from tarsus.design.learning import Learning
from tarsus.design.legs import Landscape, LinkDesign, StepLift, landscape, leg, step_lift
from tarsus.design.percents import Percent, Percents
from tarsus.design.presets import hold, steady
from tarsus.design.request import settings_text
from tarsus.design.soft_landing import landing, learn
from tarsus.design.stance import standing
from tarsus.design.target import LandingObjective

__all__ = [
    "AdaptiveGait", "GaitFront", "GaitMotion", "GaitPoint", "Grounds", "LandingDesign", "LandingObjective",
    "Landscape", "Learning", "LinkDesign", "Percent", "Percents", "Sense", "Sensor", "StepLift", "Symmetry",
    "adapt", "drives_header_text", "gait", "gait_header_text", "header_text", "hold", "landing",
    "landscape", "learn", "leg", "settings_text", "standing", "steady", "step_lift",
]  # fmt: skip
