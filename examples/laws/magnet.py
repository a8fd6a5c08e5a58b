"""Attraction between two small magnets, one in the foot and one below the ground (axial dipoles)."""

from tarsus import SmoothLaw, quantity


class Magnet(SmoothLaw):
    """F = -K / (gap + offset)^4, K = 3 mu0 m1 m2 / (2 pi): far-field force of coaxial dipoles."""

    strength: float = quantity("N m^4", "dipole strength K", default=1e-24, ge=0.0)
    offset: float = quantity("m", "distance of the dipoles at contact", default=50e-6, gt=0.0)

    uses_rate = False

    @staticmethod
    def force(gap, gap_rate, volts, time, strength, offset):
        distance = gap + offset
        return -strength / (distance * distance * distance * distance)
