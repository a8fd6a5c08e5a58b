"""Design: what a description or a signal should be, given what it should do. Names are loaded when first used.

A verb is one function, with its settings as words, as a mapping or as a TOML file (`settings_text` writes it):
`landing`, `gait`, `adapt`, `learn`, `leg`. Each returns a result with ``table()`` and ``write(folder)``.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tarsus.design.adaptive import AdaptiveGait, Sense, adapt
    from tarsus.design.gait_fronts import GaitFront, GaitPoint, gait
    from tarsus.design.gait_unknowns import Symmetry
    from tarsus.design.grounds import Grounds
    from tarsus.design.headers import gait_header_text, header_text
    from tarsus.design.landing_request import Sensor
    from tarsus.design.learning import Learning
    from tarsus.design.lifts import StepLift, step_lift
    from tarsus.design.links import Landscape, LinkDesign, landscape, leg
    from tarsus.design.request import settings_text
    from tarsus.design.soft_landing import LandingDesign, landing, learn
    from tarsus.design.target import LandingObjective
    from tarsus.model.standing import standing

__all__ = [
    "AdaptiveGait",
    "GaitFront",
    "GaitPoint",
    "Grounds",
    "LandingDesign",
    "LandingObjective",
    "Landscape",
    "Learning",
    "LinkDesign",
    "Sense",
    "Sensor",
    "StepLift",
    "Symmetry",
    "adapt",
    "gait",
    "gait_header_text",
    "header_text",
    "landing",
    "landscape",
    "learn",
    "leg",
    "settings_text",
    "standing",
    "step_lift",
]

_HOMES = {
    "tarsus.design.adaptive": "AdaptiveGait Sense adapt",
    "tarsus.design.gait_fronts": "GaitFront GaitPoint gait",
    "tarsus.design.gait_unknowns": "Symmetry",
    "tarsus.design.grounds": "Grounds",
    "tarsus.design.headers": "gait_header_text header_text",
    "tarsus.design.landing_request": "Sensor",
    "tarsus.design.learning": "Learning",
    "tarsus.design.lifts": "StepLift step_lift",
    "tarsus.design.links": "Landscape LinkDesign landscape leg",
    "tarsus.design.request": "settings_text",
    "tarsus.design.soft_landing": "LandingDesign landing learn",
    "tarsus.design.target": "LandingObjective",
    "tarsus.model.standing": "standing",
}
_HOME = {name: module for module, names in _HOMES.items() for name in names.split()}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        from tarsus.base.messages import nearest

        raise AttributeError(f"module 'tarsus.design' has no attribute '{name}'{nearest(name, __all__)}")
    value = getattr(import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
