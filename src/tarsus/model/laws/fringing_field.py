"""Attraction by the field beyond the edges of an electrode that is a strip."""

from __future__ import annotations

import math
from typing import ClassVar

from tarsus.base.spec import Amount, quantity
from tarsus.model.laws.base import SmoothLaw


class FringingField(SmoothLaw):
    r"""Attraction :math:`F = -C_e V^2 / \pi t (g + g_e)` of the fringes along a strip of height :math:`t`.

    It adds to `Electrostatic` of the same coefficient and offset: by Palmer's capacitance of a strip across a gap
    :math:`h`, :math:`\varepsilon [t/h + (1 + \ln(2 \pi t/h))/\pi]` per length, the attraction is
    :math:`1 + h / \pi t` times that of figures without edges. ``volts`` are those of the foot's electrode.
    """

    title = "attraction of the fringes"
    source = (
        "The capacitance of a parallel-plate capacitor by the Schwartz-Christoffel transformation, H. B. Palmer, "
        "Electrical Engineering 56, 1937"
    )
    needs_electrode = True
    uses_rate: ClassVar[bool] = False

    coefficient: Amount = quantity("N m^2/V^2", "electrostatic coefficient C_e of the figures", ge=0)
    offset: Amount = quantity("m", "electrode distance in contact g_e", gt=0)
    height: Amount = quantity("m", "height t of the strip", gt=0)

    @staticmethod
    def force(
        gap: float, gap_rate: float, volts: float, time: float, coefficient: float, offset: float, height: float
    ) -> float:
        """Force [N] along the normal at ``gap`` [m] and ``volts`` [V]; never positive."""
        return -coefficient * volts * volts / (math.pi * height * (gap + offset))
