"""Up to where the model of a robot holds: a bound on a measure of its runs, and what is said of a run beyond it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tarsus.measure.walking import WALK
from tarsus.model.structure import Walker
from tarsus.model.structure.walker import SMALL, TILTS
from tarsus.tables.numbers import amount, spaced

if TYPE_CHECKING:
    from tarsus.model.scene import Scene


@dataclass(frozen=True)
class ModelRange:
    """The most of a measure [SI] at which a model holds, and why."""

    measure: str
    most: float
    reason: str

    def left(self, value: float) -> str:
        """What is said of a run whose measure has this value; nothing of one within the range, or without a value."""
        if not value > self.most:
            return ""
        name, unit = spaced(self.measure), WALK[self.measure].unit
        holds = f"the model holds for a {name} below {amount(self.most, unit)} ({self.reason})"
        return f"leaves its model's range: {name} {amount(value, unit)}, and {holds}"


def model_range(scene: Scene) -> ModelRange | None:
    """The bound of the model that a walker is simulated by; None of a robot that has none.

    A walker is linear in small angles. Where its body tilts the angle is bounded. Where it cannot, hips that rise one
    after the other by a height h would turn it by h over the distance between them, and that is bounded by the height.
    """
    structure = scene.robot.structure
    if not isinstance(structure, Walker):
        return None
    legs = structure.legs.values()
    if set(TILTS) & set(structure.body_coordinates):
        return ModelRange("tilt", SMALL, f"a walker is linear in small angles, up to {SMALL:g} rad")
    wide = float(max(np.ptp([leg.x for leg in legs]), np.ptp([leg.y for leg in legs])))
    if not wide > 0.0:
        return None
    reason = (
        f"hips {amount(wide, 'm')} apart that rise one after the other would turn the body by {SMALL:g} rad, and here "
        "it cannot turn"
    )
    return ModelRange("heave_span", SMALL * wide, reason)
