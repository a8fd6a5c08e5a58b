"""Weight of the structure."""

from __future__ import annotations

from tarsus.base.spec import Amount, quantity
from tarsus.model.laws.base import Law


class Gravity(Law):
    """Uniform gravity; the generalised force is ``-acceleration * M @ structure.vertical()``.

    The source leaves it out of (4.4)-(4.5), although a payload of 0.2 mg weighs 2 uN.
    """

    slot = "gravity"

    acceleration: Amount = quantity("m/s^2", "acceleration of gravity, downward", default=9.81, ge=0)
