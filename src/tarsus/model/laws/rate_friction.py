"""Coulomb friction whose coefficient falls with the slip speed: the Stribeck curve, and weakening by rate."""

from __future__ import annotations

import math
from typing import Literal

from tarsus.base.spec import Amount, quantity
from tarsus.model.laws.base import FrictionLaw


class StribeckFriction(FrictionLaw):
    r"""Friction :math:`|F_t| \le \mu(v)\,(N + f_a)` with :math:`\mu(v) = \mu_d + (\mu_s - \mu_d)\,e^{-(v/v_s)^\delta}`.

    The Stribeck curve without its viscous part: from the static coefficient :math:`\mu_s` at the slip speed
    :math:`v = 0` to the dynamic one :math:`\mu_d` well above the Stribeck speed :math:`v_s`.  With
    :math:`\mu_s > \mu_d` a foot that is pulled along by a spring sticks and slips.
    """

    slot = "friction"
    title = "Stribeck friction"
    source = (
        "A survey of models, analysis tools and compensation methods for the control of machines with friction, "
        "B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, Automatica 30, 1994"
    )

    kind: Literal["stribeck"] = "stribeck"
    static: Amount = quantity("1", "coefficient of friction at rest mu_s", ge=0)
    dynamic: Amount = quantity("1", "coefficient of friction of a fast slip mu_d", ge=0)
    speed: float = quantity("m/s", "Stribeck speed v_s, over which friction falls", gt=0)
    exponent: Amount = quantity("1", "exponent delta of the fall", default=2.0, ge=1, le=10)

    @staticmethod
    def bound(
        margin: float, strength: float, slip: float, static: float, dynamic: float, speed: float, exponent: float
    ) -> float:
        """Largest friction force [N] at the margin ``N + f_a >= 0`` [N] and the slip speed [m/s]."""
        fall = math.exp(-((slip / speed) ** exponent))
        return (dynamic + (static - dynamic) * fall) * margin


class RateWeakeningFriction(FrictionLaw):
    r"""Friction :math:`|F_t| \le \mu(v)\,(N + f_a)` with :math:`\mu(v) = \mu_d + (\mu_s - \mu_d)/(1 + v/v_c)`.

    From the static coefficient :math:`\mu_s` at the slip speed :math:`v = 0` towards the dynamic one :math:`\mu_d`,
    half of the way at the speed :math:`v_c`: a fall without an end, which is steepest at rest.
    """

    slot = "friction"
    title = "rate-weakening friction"

    kind: Literal["rate_weakening"] = "rate_weakening"
    static: Amount = quantity("1", "coefficient of friction at rest mu_s", ge=0)
    dynamic: Amount = quantity("1", "coefficient of friction of an endlessly fast slip mu_d", ge=0)
    speed: float = quantity("m/s", "speed v_c at which friction has fallen half of the way", gt=0)

    @staticmethod
    def bound(margin: float, strength: float, slip: float, static: float, dynamic: float, speed: float) -> float:
        """Largest friction force [N] at the margin ``N + f_a >= 0`` [N] and the slip speed [m/s]."""
        return (dynamic + (static - dynamic) / (1.0 + slip / speed)) * margin
