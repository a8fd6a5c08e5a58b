"""Friction along the ground: Coulomb's, borne by the ground's push and by adhesion alike."""

from __future__ import annotations

from tarsus.laws.base import Law
from tarsus.spec import quantity

__all__ = ["Friction"]


class Friction(Law):
    r"""Coulomb friction :math:`|F_t| \le \mu\,(N + f_a)` on a foot in contact.

    The source's friction is "active only when a foot is in contact" and "assumed to be related to adhesion force"
    (4.6): with the ground's push :math:`N` [N] and the adhesion strength :math:`f_a` [N] of (2.14), a foot that is
    pulled off, :math:`N = -f_a`, slides freely, and one without load is held by adhesion alone.  A foot sticks along
    the way while the force needed stays within the bound, and slides against it otherwise.
    """

    function_name = "bound"
    leading = ("margin",)

    coefficient: float = quantity("1", "coefficient of friction mu", ge=0)

    @staticmethod
    def bound(margin: float, coefficient: float) -> float:
        """Largest friction force [N] at the margin ``N + f_a`` [N] by which the contact holds."""
        return coefficient * max(margin, 0.0)
