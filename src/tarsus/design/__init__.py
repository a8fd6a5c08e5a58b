"""Design: what a description or a signal should be, given what it should do.

`ts.design(scene, free, objective, limits, over, risk)` is the grammar; `gait`, `steady`, `hold`, `landing`, `adapt`,
`learn` and `leg` are designs with names of their own. Settings go as words, as a mapping or as a TOML file
(`settings_text` writes it). A result has ``table()``, ``to_dict()`` and ``write(folder)``.
"""

from tarsus.base.verb import callable_package
from tarsus.design.adaptive import adapt
from tarsus.design.adaptive_gait import AdaptiveGait, Sense
from tarsus.design.free import Symmetry
from tarsus.design.front import Candidate, Design
from tarsus.design.grounds import Grounds
from tarsus.design.headers import drives_header_text, gait_header_text, header_text
from tarsus.design.judge import Risk, cvar
from tarsus.design.landing import landing
from tarsus.design.landing_design import LandingDesign
from tarsus.design.learning import Learning, Sensor, learn
from tarsus.design.legs import LinkDesign, leg
from tarsus.design.measures import DesignLimit, DesignObjective
from tarsus.design.motion import DesignMotion
from tarsus.design.percents import Percent, Percents
from tarsus.design.presets import gait, hold, steady
from tarsus.design.pulse_train import Pulses
from tarsus.design.request import settings_text
from tarsus.design.stance import standing

__all__ = [
    "AdaptiveGait",
    "Candidate",
    "Design",
    "DesignLimit",
    "DesignMotion",
    "DesignObjective",
    "Grounds",
    "LandingDesign",
    "Learning",
    "LinkDesign",
    "Percent",
    "Percents",
    "Pulses",
    "Risk",
    "Sense",
    "Sensor",
    "Symmetry",
    "adapt",
    "cvar",
    "drives_header_text",
    "gait",
    "gait_header_text",
    "header_text",
    "hold",
    "landing",
    "learn",
    "leg",
    "settings_text",
    "standing",
    "steady",
]

callable_package(__name__, "tarsus.design.verb:design")
