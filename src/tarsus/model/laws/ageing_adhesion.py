"""Adhesion that a contact gains as it ages, and that fades while the foot is in the air."""

from __future__ import annotations

import math

from tarsus.base.spec import Amount, quantity
from tarsus.model.laws.base import AdhesionLaw


class AgeingAdhesion(AdhesionLaw):
    r"""Adhesion :math:`f_a = C_0 + C_1 (1 - e^{-a/\tau_c})` of a contact of age :math:`a`.

    In contact the age is the time, so that the adhesion comes up to :math:`C_0 + C_1` within some :math:`\tau_c`, as it
    does where a meniscus grows or asperities creep.  In the air it fades, :math:`\dot a = -a/\tau_a`: a foot that comes
    back soon finds most of its adhesion again, one that stays away for some :math:`\tau_a` begins anew.
    """

    title = "ageing adhesion"
    force_scale = ("initial", "gain")

    initial: Amount = quantity("N", "adhesion of a new contact C_0", ge=0)
    gain: Amount = quantity("N", "what an old contact has gained C_1", ge=0)
    ageing: Amount = quantity("s", "time over which a contact ages tau_c", gt=0)
    fading: Amount = quantity("s", "time over which the age fades in the air tau_a", gt=0)

    @staticmethod
    def strength(age: float, initial: float, gain: float, ageing: float, fading: float) -> float:
        """Pull [N] that a contact of that age [s] holds."""
        return initial - gain * math.expm1(-age / ageing)

    @staticmethod
    def remaining(age: float, away: float, initial: float, gain: float, ageing: float, fading: float) -> float:
        """Age [s] that is left of one after a time in the air."""
        return age * math.exp(-away / fading)
