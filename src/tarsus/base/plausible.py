"""Numbers that are allowed but hardly meant: a gap of 70 m is a forgotten unit."""

from __future__ import annotations

from tarsus.base.spec import Description, float_paths
from tarsus.base.units import format_quantity

USUAL: dict[str, tuple[float, float]] = {
    "m": (1e-10, 0.1),  # from an atom to robots ten times as long as those this is for
    "kg": (1e-13, 0.1),  # from a switch's contact to a robot that a hand holds
    "s": (1e-7, 1e4),  # from one sample of a fast recorder to hours of walking
    "Hz": (1e-2, 1e8),
    "V": (1e-4, 5e3),  # from the noise of an amplifier to the breakdown of air over a millimetre
    "N": (1e-14, 10.0),  # from what vibrometry can resolve to a hundred times the heaviest robot's weight
    "N/m": (1e-5, 1e7),
    "m/s": (1e-8, 100.0),
    "m/s^2": (1e-3, 1e3),
    "kg/m^3": (1.0, 3e4),  # from aerogel to the densest metals
    "F": (1e-18, 1e-3),
}
"""Smallest and largest size of a number other than zero that nobody would ask about, by unit; wide on purpose: a remark
is for a forgotten prefix (a factor of a thousand or a million), not for an unusual device."""


def remarks(described: Description) -> list[str]:
    """A sentence for every number of a description that is far from what such robots have.

    Numbers of one list share a sentence. Nothing is refused for it.
    """
    out: dict[str, str] = {}
    for path, info in float_paths(described).items():
        low, high = USUAL.get(info.unit, (0.0, float("inf")))
        if info.value == 0.0 or low <= abs(info.value) <= high:
            continue
        usual = f"{format_quantity(low, info.unit)} to {format_quantity(high, info.unit)}"
        of_list = ".".join(part for part in path.split(".") if not part.isdecimal())
        given = format_quantity(info.value, info.unit)
        said = f"{path}: {given} is far from what such robots have ({usual}); is its unit right?"
        out.setdefault(of_list, said)
    return list(out.values())
