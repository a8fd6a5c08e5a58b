"""Electrostatic attraction spread along a leg that turns about its hip."""

from __future__ import annotations

import math
from typing import ClassVar

from tarsus.base.spec import Amount, quantity
from tarsus.model.laws.base import SmoothLaw


class LegElectrostatic(SmoothLaw):
    r"""Attraction along the whole leg: equation (3.25) per length, as a force on the foot.

    A leg that is level when its foot is at ``rest`` and turns about its hip has the distance
    :math:`h(\eta) = g_e + g_r + (g - g_r)\,\eta` from the ground at the fraction :math:`\eta` of its length from the
    hip. The attraction :math:`C_e V^2 / h^2` per unit of :math:`\eta` does the work of a force at the foot

    .. math:: F = -C_e V^2 \int_0^1 \frac{\eta\,d\eta}{h(\eta)^2}
              = -\frac{C_e V^2}{\Delta^2}\left[\ln\Bigl(1 + \frac{\Delta}{H}\Bigr) - \frac{\Delta}{H + \Delta}\right],
              \qquad H = g_e + g_r,\ \Delta = g - g_r .

    At ``g = rest`` that is half of what the same coefficient gives at the foot alone: the hip does not move.
    ``volts`` are those of the drive that the foot names as its electrode.
    """

    slot = "leg_electrostatic"
    title = "electrostatic attraction along the leg"
    small = True
    needs_electrode = True
    uses_rate: ClassVar[bool] = False

    coefficient: Amount = quantity("N m^2/V^2", "electrostatic coefficient C_e of the whole leg", ge=0)
    offset: Amount = quantity("m", "distance between electrode and ground with the leg level on it, g_e", gt=0)
    rest: Amount = quantity("m", "gap of the foot at which the leg is level, g_r", ge=0)

    @staticmethod
    def force(
        gap: float, gap_rate: float, volts: float, time: float, coefficient: float, offset: float, rest: float
    ) -> float:
        """Force [N] along the normal on the foot, at ``gap`` [m] and ``volts`` [V]; never positive."""
        if coefficient == 0.0:
            return 0.0
        height = offset + rest
        x = (gap - rest) / height
        if abs(x) < 0.02:  # series of [ln(1 + x) - x / (1 + x)] / x^2, to 1e-15
            share = 0.0
            for n in range(11, 1, -1):
                share = -x * share + (n - 1.0) / n
        else:
            share = (math.log(1.0 + x) - x / (1.0 + x)) / (x * x)
        return -coefficient * volts * volts * share / (height * height)
