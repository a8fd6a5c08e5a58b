"""Friction of two constants: one of a foot at rest, a lower one of a foot that slides."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import model_validator

from tarsus.base.messages import PathErrors
from tarsus.base.spec import Amount, quantity
from tarsus.model.laws.base import FrictionLaw


class StaticKineticFriction(FrictionLaw):
    r"""Friction :math:`|F_t| \le \mu_s\,(N + f_a)` of a foot that sticks, :math:`\mu_k\,(N + f_a)` of one that slides.

    Amontons's and Coulomb's two constants. The bound falls at once as a foot begins to slide; the limit of
    friction that weakens over an ever lower speed.
    """

    slot = "friction"
    title = "friction of two constants"

    kind: Literal["static_kinetic"] = "static_kinetic"
    static: Amount = quantity("1", "coefficient of friction at rest mu_s", ge=0)
    kinetic: Amount = quantity("1", "coefficient of friction of a slip mu_k", ge=0)

    @model_validator(mode="after")
    def _falls(self) -> Self:
        if self.kinetic > self.static:
            text = f"a slip has at most the friction of rest ({self.static:g}), or a foot neither sticks nor slides"
            raise PathErrors([("kinetic", f"{text}; got {self.kinetic:g}")])
        return self

    @staticmethod
    def bound(margin: float, strength: float, slip: float, static: float, kinetic: float) -> float:
        """Largest friction force [N] at the margin ``N + f_a >= 0`` [N], at rest and at any slip speed [m/s]."""
        return (kinetic if slip > 0.0 else static) * margin
