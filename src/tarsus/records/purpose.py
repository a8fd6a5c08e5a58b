"""What records of a device are made for, and when its ground is out of reach."""

from __future__ import annotations

from enum import Enum

IN_AIR = 0.03
"""Distance of the ground [m] that counts as in the air, that of section 3.4.1."""


class Purpose(Enum):
    """What a record is for."""

    MODAL = "modal"
    LOOPS = "loops"
    RAMPS = "ramps"
    BOUNCES = "bounces"
    AIR = "air"
    CLOSE = "close"
    VALIDATION = "validation"
    WALKING = "walking"
