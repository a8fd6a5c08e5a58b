"""Friction along the ground, as laws by kind: borne by push and adhesion alike, or by adhesion alone."""

from __future__ import annotations

from typing import Literal

from tarsus.base.spec import Amount, quantity
from tarsus.model.laws.base import FrictionLaw


class Friction(FrictionLaw):
    r"""Coulomb friction :math:`|F_t| \le \mu\,(N + f_a)` on a foot in contact.

    The source's friction is "active only when a foot is in contact" and "assumed to be related to adhesion force"
    (4.6): with the ground's push :math:`N` [N] and the adhesion strength :math:`f_a` [N] of (2.14), a foot that is
    pulled off, :math:`N = -f_a`, slides freely, and one without load is held by adhesion alone.  A foot sticks along
    the way while the force needed stays within the bound, and slides against it otherwise.
    """

    leading = ("margin", "strength")
    slot = "friction"
    title = "Coulomb friction"
    slot_note = "along the ground, on feet that know their way along it; absent: frictionless"
    slot_default = True

    kind: Literal["coulomb"] = "coulomb"
    coefficient: Amount = quantity("1", "coefficient of friction mu", ge=0)

    @staticmethod
    def bound(margin: float, strength: float, coefficient: float) -> float:
        """Largest friction force [N] at the margin ``N + f_a >= 0`` [N] by which a contact of that strength holds."""
        return coefficient * margin


class AdhesiveFriction(FrictionLaw):
    r"""Friction by adhesion alone, :math:`|F_t| \le \mu_a\,f_a(t - t_c)`, on a foot in contact.

    The narrow reading of "assumed to be related to adhesion force" (4.6): the strength :math:`f_a` [N] of (2.14) that
    this contact has reached bounds friction, whatever the ground's push, until the foot is pulled off.  The bound is a
    force, so an impact, which lasts no time, takes nothing from the motion along the ground.
    """

    leading = ("margin", "strength")
    slot = "friction"
    title = "adhesive friction"
    needs_strength = True

    kind: Literal["adhesive"] = "adhesive"
    coefficient: Amount = quantity("1", "friction per adhesion strength mu_a", ge=0)

    @staticmethod
    def bound(margin: float, strength: float, coefficient: float) -> float:
        """Largest friction force [N] of a contact of that adhesion strength ``f_a`` [N]."""
        return coefficient * strength


AnyFriction = FrictionLaw
"""A law of friction; Coulomb's where no ``kind`` is given."""
