"""A law of the ground to begin with: a magnet below the ground pulls the foot (axial dipoles).

    tarsus simulate DEVICE --law THIS_FILE --set ground.laws.magnet.strength="3e-24 N m^4"

What laws may be, and what they promise: the page "Add a law" of the documentation.
"""

from tarsus import SmoothLaw, quantity


class Magnet(SmoothLaw):
    """F = -K / (gap + offset)^4, K = 3 mu0 m1 m2 / (2 pi)."""

    strength: float = quantity("N m^4", "dipole strength K", default=1e-24, ge=0.0)
    offset: float = quantity("m", "distance of the dipoles at contact", default=50e-6, gt=0.0)

    uses_rate = False

    @staticmethod
    def force(gap, gap_rate, volts, time, strength, offset):
        distance = gap + offset
        return -strength / (distance * distance * distance * distance)
