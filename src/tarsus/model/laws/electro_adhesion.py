"""Adhesion that volts switch on and off."""

from __future__ import annotations

from tarsus.base.spec import Amount, quantity
from tarsus.model.laws.base import AdhesionLaw


class ElectroAdhesion(AdhesionLaw):
    r"""Adhesion :math:`f_a = C_0 + K V^2` of a pad that is clamped to the ground under the volts of its electrode.

    A pad of capacitance :math:`C_p` on a dielectric of thickness :math:`d` has :math:`K = C_p / 2d`.  It holds only in
    contact: it has no range, and no work but what a capture takes.  The attraction of a pad above the ground is
    `Electrostatic`'s.
    """

    title = "electro-adhesion"
    force_scale = ("initial",)
    leading = ("age", "volts")
    needs_electrode = True

    initial: Amount = quantity("N", "adhesion without volts C_0", ge=0)
    coefficient: Amount = quantity("N/V^2", "adhesion by the square of the volts K", ge=0)

    @staticmethod
    def strength(age: float, volts: float, initial: float, coefficient: float) -> float:
        """Pull [N] that the contact holds under ``volts`` [V]."""
        return initial + coefficient * volts * volts
