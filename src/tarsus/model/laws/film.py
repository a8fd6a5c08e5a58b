"""Squeeze-film damping of the air between a foot and the ground."""

from __future__ import annotations

from tarsus.base.spec import Amount, quantity
from tarsus.model.laws.base import DISSERTATION, DampingLaw


class Film(DampingLaw):
    r"""Squeeze film: :math:`F = -C\,\dot g / (g + g_0)^3`, equations (2.10) and (3.26).

    The force is the time derivative of :math:`C / 2 (g + g_0)^2`.  Equation (2.10) is printed with the sign
    of negative damping; (3.26) has it right (erratum E2).  The residual thickness :math:`g_0` is what
    the printed effective gap means (erratum E3): the film is finite in contact.
    """

    slot = "film"
    title = "squeeze film"
    source = DISSERTATION
    small = True
    length_scale = ("thickness",)

    coefficient: Amount = quantity("N m^2 s", "film coefficient C", ge=0)
    thickness: Amount = quantity("m", "residual film thickness at contact; at zero a foot never lands", gt=0)

    @staticmethod
    def momentum(gap: float, coefficient: float, thickness: float) -> float:
        """Momentum [N s] whose rate is the film force, at ``gap`` [m]."""
        return 0.5 * coefficient / ((gap + thickness) * (gap + thickness))
