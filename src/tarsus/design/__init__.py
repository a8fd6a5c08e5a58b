"""Design: what a description or a signal should be, given what it should do. Names are loaded when first used."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tarsus.design.adaptive import AdaptiveGait, Sense, adapt
    from tarsus.design.gait_fronts import GaitFront, GaitPoint, gait
    from tarsus.design.gait_header import gait_header_text
    from tarsus.design.landing_files import header_text, landing_table, write_landing
    from tarsus.design.lifts import StepLift, step_lift
    from tarsus.design.links import Landscape, LinkDesign, design_links, landscape
    from tarsus.design.over import Box, Ensemble
    from tarsus.design.request import Options, Sensor
    from tarsus.design.soft_landing import LandingDesign, landing
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

_HOMES = {
    "tarsus.design.adaptive": "AdaptiveGait Sense adapt",
    "tarsus.design.gait_fronts": "GaitFront GaitPoint gait",
    "tarsus.design.gait_header": "gait_header_text",
    "tarsus.design.landing_files": "header_text landing_table write_landing",
    "tarsus.design.links": "Landscape LinkDesign design_links landscape",
    "tarsus.design.over": "Box Ensemble",
    "tarsus.design.request": "Options Sensor",
    "tarsus.design.soft_landing": "LandingDesign landing",
    "tarsus.design.lifts": "StepLift step_lift",
    "tarsus.design.target": "Objective",
    "tarsus.design.unknowns": "Symmetry",
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
