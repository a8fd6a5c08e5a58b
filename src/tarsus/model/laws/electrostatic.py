"""Electrostatic attraction between an electrode on a foot and the ground."""

from __future__ import annotations

from typing import ClassVar

from tarsus.base.spec import Amount, quantity
from tarsus.model.laws.base import DISSERTATION, SmoothLaw


class Electrostatic(SmoothLaw):
    r"""Attraction :math:`F = -C_e V^2 / (g + g_e)^2`, equation (3.25) with the sign of attraction.

    ``volts`` are those of the drive that the foot names as its electrode.
    """

    slot = "electrostatic"
    title = "electrostatic attraction"
    source = DISSERTATION
    small = True
    needs_electrode = True
    uses_rate: ClassVar[bool] = False

    coefficient: Amount = quantity("N m^2/V^2", "electrostatic coefficient C_e", ge=0)
    offset: Amount = quantity("m", "effective electrode distance in contact g_e", gt=0)

    @staticmethod
    def force(gap: float, gap_rate: float, volts: float, time: float, coefficient: float, offset: float) -> float:
        """Force [N] along the normal at ``gap`` [m] and ``volts`` [V]; never positive."""
        distance = gap + offset
        return -coefficient * volts * volts / (distance * distance)
