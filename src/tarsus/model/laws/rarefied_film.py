"""Squeeze film of gas so thin that its molecules meet the walls rather than each other."""

from __future__ import annotations

from tarsus.base.spec import Amount, quantity
from tarsus.model.laws.base import DampingLaw

SLIP, POWER = 9.638, 1.159
"""Veijola's effective viscosity is that of a thick film over 1 + 9.638 Kn^1.159."""
PLACES = (
    0.02510321518194258,
    0.08989783446951177,
    0.1887179432366003,
    0.31334838506513,
    0.4534363154922808,
    0.5973459394602494,
    0.7331243910939652,
    0.8494946853436918,
    0.9367939257177504,
    0.9877925250071512,
)
SHARES = (
    0.002721333934090468,
    0.01246255558186071,
    0.02915090106333401,
    0.0498938047226546,
    0.06998930796420859,
    0.08418897802299598,
    0.08806093511492291,
    0.07915481176894945,
    0.05769622628385494,
    0.02668114554312825,
)
"""Gauss's rule for s^(2 / 1.159 - 1) on [0, 1]: the force to 1e-5 of itself up to Kn = 1, to 1 % at 5."""


class RarefiedFilm(DampingLaw):
    r"""Squeeze film :math:`F = -C\,\dot g / h^3 / (1 + 9.638\,Kn^{1.159})` of the thickness :math:`h = g + g_0`.

    The Knudsen number :math:`Kn = \lambda / h` is the mean free path of the gas (68 nm in air at 1 bar) over the
    thickness; Veijola's fit to the linearised Boltzmann equation, within 5 % of it.
    """

    title = "rarefied squeeze film"
    source = (
        "Equivalent-circuit model of the squeezed gas film in a silicon accelerometer, T. Veijola and others, "
        "Sensors and Actuators A 48, 1995"
    )
    length_scale = ("thickness",)

    coefficient: Amount = quantity("N m^2 s", "film coefficient C of thick films", ge=0)
    thickness: Amount = quantity("m", "residual film thickness g_0 at contact", gt=0)
    free_path: Amount = quantity("m", "mean free path lambda of the gas", ge=0)

    @staticmethod
    def momentum(gap: float, coefficient: float, thickness: float, free_path: float) -> float:
        """Momentum [N s] whose rate is the film force, at ``gap`` [m]: C times the integral of u / (1 + b u^1.159) to
        u = 1 / h."""
        film = gap + thickness
        thin = SLIP * (free_path / film) ** POWER
        return coefficient / (film * film) * sum([w / (1.0 + thin * s) for s, w in zip(PLACES, SHARES, strict=True)])
