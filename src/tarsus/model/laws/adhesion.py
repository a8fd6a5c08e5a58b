"""Adhesion that grows while a foot stays in contact."""

from __future__ import annotations

from tarsus.base.spec import Amount, quantity
from tarsus.model.laws.base import DISSERTATION, AdhesionLaw


class Adhesion(AdhesionLaw):
    r"""Adhesion :math:`f_a(t - t_c) = C_{a0} + C_a (t - t_c)`, equation (2.14).

    A foot in contact leaves when the structure's pull on it exceeds :math:`f_a`.
    """

    slot = "adhesion"
    source = DISSERTATION
    force_scale = ("initial",)

    initial: Amount = quantity("N", "adhesion at first contact C_a0", ge=0)
    rate: Amount = quantity("N/s", "growth of adhesion with contact time C_a", ge=0)

    @staticmethod
    def strength(age: float, initial: float, rate: float) -> float:
        """Pull [N] that the contact holds, ``age`` [s] after it began."""
        return initial + rate * age
