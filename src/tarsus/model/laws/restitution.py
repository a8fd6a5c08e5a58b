"""Newton's impact law."""

from __future__ import annotations

from tarsus.base.spec import Amount, quantity
from tarsus.model.laws.base import ImpactLaw


class Restitution(ImpactLaw):
    r"""Newton's impact law :math:`\dot g^+ = -e\,\dot g^-`, equation (2.12).

    The source changes the sign of its coefficient between places (erratum E6); here :math:`0 \le e \le 1`.
    """

    slot = "restitution"

    coefficient: Amount = quantity("1", "coefficient of restitution e", ge=0, le=1)

    @staticmethod
    def rebound(speed: float, coefficient: float) -> float:
        """Departing speed [m/s] after an impact at approach ``speed`` [m/s]."""
        return coefficient * speed
