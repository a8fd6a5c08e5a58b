"""Restitution that falls with the speed of the impact."""

from __future__ import annotations

from tarsus.base.spec import Amount, quantity
from tarsus.model.laws.base import ImpactLaw


class PowerRestitution(ImpactLaw):
    r"""Restitution :math:`e(v) = \min(e_0\,(v/v_0)^{-p},\,e_{max})` at the approach speed :math:`v`.

    A fully plastic sphere has :math:`p = 1/4`; below the speed at which it begins to yield nothing but
    :math:`e_{max}` is lost.
    """

    title = "restitution that falls with speed"
    source = "Contact Mechanics, K. L. Johnson, section 11.5, Cambridge University Press, 1985"

    coefficient: Amount = quantity("1", "coefficient of restitution e_0 at the speed v_0", ge=0, le=1)
    speed: Amount = quantity("m/s", "approach speed v_0", gt=0)
    power: Amount = quantity("1", "power p of the fall", default=0.25, ge=0, le=1)
    most: Amount = quantity("1", "coefficient e_max of slow impacts", default=1.0, ge=0, le=1)

    @staticmethod
    def rebound(approach: float, coefficient: float, speed: float, power: float, most: float) -> float:
        """Departing speed [m/s] after an impact at ``approach`` [m/s]."""
        return min(coefficient * speed**power * approach ** (1.0 - power), most * approach)
