"""A user's laws with the formulas of the built-in ones, and a magnet."""

from __future__ import annotations

from tarsus.base.spec import quantity
from tarsus.model.laws import AdhesionLaw, DampingLaw, ImpactLaw, SmoothLaw


class OwnFilm(DampingLaw):
    coefficient: float = quantity("N m^2 s", "film constant", ge=0)
    thickness: float = quantity("m", "film left at contact", gt=0)

    def momentum(gap, coefficient, thickness):
        return 0.5 * coefficient / (gap + thickness) ** 2


class OwnElectrostatic(SmoothLaw):
    uses_rate = False
    coefficient: float = quantity("N m^2/V^2", "half of permittivity times area", ge=0)
    offset: float = quantity("m", "insulator", gt=0)

    def force(gap, gap_rate, volts, time, coefficient, offset):
        return -coefficient * volts * volts / (gap + offset) ** 2


class OwnRebound(ImpactLaw):
    coefficient: float = quantity("1", "speed kept", ge=0, le=1)

    def rebound(speed, coefficient):
        return coefficient * speed


class OwnLatch(AdhesionLaw):
    initial: float = quantity("N", "strength at first", ge=0)
    rate: float = quantity("N/s", "growth", ge=0)

    def strength(age, initial, rate):
        return initial + rate * age


class Drag(SmoothLaw):
    """Air drag that fades with height: a rate-dependent smooth force."""

    coefficient: float = quantity("N s/m", "drag at contact", ge=0)
    height: float = quantity("m", "where it has halved", gt=0)

    def force(gap, gap_rate, volts, time, coefficient, height):
        return -coefficient * gap_rate / (1.0 + gap / height)


class Magnet(SmoothLaw):
    """Attraction with the inverse fourth power, conservative."""

    uses_rate = False
    strength: float = quantity("N m^4", "strength", ge=0)
    depth: float = quantity("m", "depth of the magnet", gt=0)

    def force(gap, gap_rate, volts, time, strength, depth):
        return -strength / (gap + depth) ** 4
