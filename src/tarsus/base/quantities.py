"""Quantities that instruments measure and runs report."""

from __future__ import annotations

from enum import Enum


class Quantity(Enum):
    """What a channel measures, of a record or of a run; the value is its SI unit."""

    DISPLACEMENT = "m"
    VELOCITY = "m/s"
    ACCELERATION = "m/s^2"
    VOLTAGE = "V"
    FORCE = "N"
    CHARGE = "C"
    CURRENT = "A"
    ANGLE = "rad"
    ANGULAR_VELOCITY = "rad/s"

    @property
    def unit(self) -> str:
        """SI unit."""
        return self.value
