"""A walker to begin with: so many legs under so much mass, as a scene file with comments."""

from __future__ import annotations

import math
from importlib.resources import files
from string import Template

from tarsus.base.errors import InputError
from tarsus.base.units import format_quantity, parse_quantity

MOST_LEGS = 40
"""More legs than any robot of this size has."""

SHARE = 25e-6
"""Mass of the body [kg] that one leg carries, such as of four legs and 0.1 g."""

UPWARD, ALONG = 4e5, 2e5
"""Stiffness of a leg over the mass that it carries [1/s^2]: it bounces at 100 Hz and swings at 70 Hz, well above the
gait, and sags by 25 um."""

RATIO = 0.3
"""Damping ratio of the body on its legs: it has come to rest when the next step begins."""

LIFT, SWING = 0.4, 0.1
"""Force of a drive over the mass that the leg carries [N/kg], a volt: at 100 V four times the weight, which takes other
feet off the ground, and a swing of 50 um, which dry friction bears."""

CAPACITANCE = 1e-9
"""Of a drive [F], for its energy: piezo of 5 by 1 mm, 100 um thick, of relative permittivity 2000, has 0.9 nF."""

FOOT = 0.04
"""Mass of a foot over the mass that its leg carries."""

PITCH, HALF_WIDTH = 5e-3, 4e-3
"""Distance of neighbouring legs along the body, and of legs from its middle [m]."""


def walker_text(legs: int, mass: float | str | None = None) -> str:
    """A scene file of a walker. mass: of its body, with a unit; 25 mg a leg without.

    Raises InputError for a number of legs below 1 or above 40, and for a mass that is none.
    """
    problems = [] if 1 <= legs <= MOST_LEGS else [f"--legs: expected a number from 1 to {MOST_LEGS}, got {legs}"]
    body = SHARE * legs
    if mass is not None:
        try:
            body = parse_quantity(mass, "kg")
            problems += [] if body > 0.0 else [f"--mass: expected a mass (kg) above 0, got '{mass}'"]
        except InputError as error:
            problems += [f"--mass: {one}" for one in error.problems]
    if problems:
        raise InputError(problems)
    hips, share = _hips(legs), body / legs
    springs = [
        f'stiffness_{way} = "{_said(rate * share, "N/m")}", damping_{way} = "{_said(damping * share, "N s/m")}"'
        for way, rate in (("v", UPWARD), ("l", ALONG))
        for damping in [2.0 * RATIO * math.sqrt(rate)]
    ]
    parts = ", ".join([f'mass = "{_said(FOOT * share, "kg")}"', *springs])
    lines = {
        "legs": [
            f'{leg} = {{ x = "{_said(x, "m")}", y = "{_said(y, "m")}", {parts} }}' for leg, (x, y) in hips.items()
        ],
        "drives": [
            line
            for leg in hips
            for line in (_drive(leg, "lift", "", LIFT * share), _drive(leg, "swing", "_x", SWING * share))
        ],
        "feet": [f'{leg} = {{ point = "{leg}", gap = "0 m" }}' for leg in hips],
    }
    template = (files("tarsus.inspection") / "templates" / "walker.toml").read_text(encoding="utf-8")
    return Template(template).substitute(
        {name: "\n".join(rows) for name, rows in lines.items()},
        count="one leg" if legs == 1 else f"{legs} legs",
        mass=_said(body, "kg"),
        length=_said(PITCH * (legs + 1) / 2.0, "m"),
    )


def _drive(leg: str, name: str, way: str, gain: float) -> str:
    """A drive that pushes foot and hip apart, upward or along the way."""
    law = f'{{ kind = "linear", gain = "{_said(gain, "N/V")}" }}'
    load = f'{{ kind = "point", weights = {{ {leg}{way} = -1.0, {leg}_hip{way} = 1.0 }} }}'
    return f'{leg}_{name} = {{ law = {law}, load = {load}, capacitance = "{_said(CAPACITANCE, "F")}" }}'


def _hips(legs: int) -> dict[str, tuple[float, float]]:
    """Where legs stand [m]: pairs from front to back, and an odd one in the middle behind them."""
    rows = (legs + 1) // 2
    places = {}
    for row in range(legs // 2):
        x = PITCH * ((rows - 1) / 2.0 - row)
        places |= {f"L{row + 1}": (x, HALF_WIDTH), f"R{row + 1}": (x, -HALF_WIDTH)}
    return places | ({"M": (-PITCH * (rows - 1) / 2.0, 0.0)} if legs % 2 else {})


def _said(value: float, unit: str) -> str:
    return format_quantity(float(f"{value:.4g}"), unit)
