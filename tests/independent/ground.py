"""Laws between a foot and the ground, from the formulas of docs/conventions.md; the tests' own laws too."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.optimize import brentq

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(40)
SHARES, WEIGHTS = 0.5 * (_POINTS + 1.0), 0.5 * _WEIGHTS


class Laws:
    """What a scene's ground does to each foot."""

    def __init__(self, ground: Any) -> None:
        self.film = ground.film
        self.attraction = ground.electrostatic
        self.restitution, self.adhesion = ground.restitution, ground.adhesion
        self.along_leg, self.friction, self.landing = (ground.leg_electrostatic, ground.friction, ground.landing)
        self.magnet = self.drag = self.pad = None
        for law in ground.laws.values():
            kind = type(law).__name__
            if kind == "OwnFilm":
                self.film = law
            elif kind == "OwnElectrostatic":
                self.attraction = law
            elif kind == "OwnRebound":
                self.restitution = law
            elif kind == "OwnLatch":
                self.adhesion = law
            elif kind == "ElectroAdhesion":
                self.pad = self.adhesion = law
            elif kind == "Magnet":
                self.magnet = law
            elif kind == "Drag":
                self.drag = law
            else:
                raise NotImplementedError(kind)
        self.gravity = 0.0 if ground.gravity is None else ground.gravity.acceleration
        self.incline = ground.incline or 0.0

    def resisting(self, gap: float, rate: float) -> float:
        """Film: F = -C g' / (g + g0)^3, which nothing but motion makes."""
        if self.film is None:
            return 0.0
        return -self.film.coefficient * rate / (gap + self.film.thickness) ** 3

    def smooth(self, gap: float, rate: float, volts: float) -> float:
        """All other forces along the normal [N]."""
        out = 0.0
        if self.attraction is not None:
            out -= self.attraction.coefficient * (volts / (gap + self.attraction.offset)) ** 2
        if self.along_leg is not None:
            out -= self.along_leg.coefficient * volts**2 * leg_share(gap, self.along_leg.offset, self.along_leg.rest)
        if self.magnet is not None:
            out -= self.magnet.strength / (gap + self.magnet.depth) ** 4
        if self.drag is not None:
            out -= self.drag.coefficient * rate / (1.0 + gap / self.drag.height)
        return out

    def rebound(self, speed: float) -> float:
        return 0.0 if self.restitution is None else self.restitution.coefficient * speed

    def strength(self, age: float, volts: float) -> float:
        if self.pad is not None:
            return self.pad.initial + self.pad.coefficient * volts**2
        return 0.0 if self.adhesion is None else self.adhesion.initial + self.adhesion.rate * age

    def bound(self, margin: float, strength: float, speed: float = 0.0) -> float:
        """Most friction [N] at a margin N + f_a, a strength f_a and a slip speed."""
        if self.friction is None:
            return 0.0
        return self.coefficient(speed) * (strength if self.friction.kind == "adhesive" else margin)

    def coefficient(self, speed: float) -> float:
        """mu at a slip speed: of Coulomb, of Stribeck, or weakening by rate."""
        law = self.friction
        if law.kind == "stribeck":
            return law.dynamic + (law.static - law.dynamic) * math.exp(-((speed / law.speed) ** law.exponent))
        if law.kind == "rate_weakening":
            return law.dynamic + (law.static - law.dynamic) * law.speed / (law.speed + speed)
        if law.kind == "static_kinetic":
            return law.kinetic if speed > 0.0 else law.static
        return law.coefficient

    def brakes(self, change: float, speed: float) -> float:
        """Most that an impact which changes the normal velocity by ``change`` takes from the velocity along [m/s],
        which is ``speed`` before."""
        if self.friction is None or self.friction.kind == "adhesive":
            return 0.0
        return self.coefficient(speed) * change


def leg_share(gap: float, offset: float, rest: float) -> float:
    """Attraction along a leg that turns about its hip, per C_e V^2, as felt at its foot.

    At the share s of the leg from the hip the gap is rest + offset + s (gap - rest), and its force has the lever s.
    """
    return float(WEIGHTS @ (SHARES / (offset + rest + SHARES * (gap - rest)) ** 2))


def passive_angle(e: float, skew: float) -> float:
    """The angle of the nearest map that makes no energy: sin (1 - e^2 cos) = (1 + e) skew sqrt(1 - e^2) cos."""
    if e >= 1.0:
        return 0.0
    size = (1.0 + e) * skew * math.sqrt(1.0 - e * e)
    return brentq(
        lambda a: math.sin(a) * (1.0 - e * e * math.cos(a)) - size * math.cos(a), 0.0, 0.5 * math.pi, xtol=1e-15
    )
