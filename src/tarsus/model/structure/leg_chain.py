"""Exact planar dynamics of a chain of three links between a pinned foot and a body on a vertical guide."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import atan2, cos, sin, sqrt

import numpy as np

from tarsus.model.structure.base import Array

_TURNS = np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
"""How the turns of hip and knee joint (columns) turn shin, thigh and hip link (rows) against the shin."""


@dataclass(frozen=True)
class Chain:
    """Links from the foot up: shin, thigh, hip link; then the body.

    The coordinates are the turns ``q`` (2,) of hip and knee joint [rad], zero at rest.  The directions of the
    links are ``theta = angles + TURNS q + psi``; ``psi``, by which the whole chain turns about the foot, follows
    from the guide: with ``r(q) = sum L_j exp(i (theta_j - psi))`` the vector from foot to body,
    ``Re(exp(i psi) r) = D`` and so the body's height is ``sqrt(|r|^2 - D^2)``.

    ``lengths``, ``angles`` at rest (3,); ``inertia`` (3, 3) [kg m^2] and ``moment`` (3,) [kg m], with which
    kinetic energy is ``1/2 sum inertia_jl cos(theta_j - theta_l) theta_j' theta_l'`` and the height of all mass
    is ``moment @ sin(theta)``; ``stiffness`` and ``damping`` (2,) of hip and knee joint.
    """

    lengths: Array
    angles: Array
    inertia: Array
    moment: Array
    stiffness: Array
    damping: Array

    @classmethod
    def of(
        cls,
        *,
        lengths: Sequence[float],
        angles: Sequence[float],
        masses: Sequence[float],
        body_mass: float,
        stiffness: Sequence[float],
        damping: Sequence[float],
    ) -> Chain:
        """A chain of uniform links (3 values each, shin first) with springs at hip and knee (2 values each)."""
        of_links, mass_of = np.array(lengths), np.array([*masses, body_mass])
        arms = np.tril(np.ones((4, 3)), -1) * of_links  # to the joint below each mass, along each link
        arms[:3] += np.diag(of_links / 2.0)  # and to the middle of its own link
        own = np.diag(mass_of[:3] * of_links**2 / 12.0)
        return cls(
            lengths=of_links,
            angles=np.array(angles),
            inertia=(arms.T * mass_of) @ arms + own,
            moment=mass_of @ arms,
            stiffness=np.array(stiffness),
            damping=np.array(damping),
        )

    @property
    def rest(self) -> Array:
        """Directions (3,) of the links at rest."""
        return self.angles

    def posture(self, q: Array) -> Array:
        """Directions (3,) of the links; NaN if the links cannot reach from foot to guide."""
        theta = self.angles + _TURNS @ q
        reach = float(self.lengths @ np.cos(self.angles))
        x, y = float(self.lengths @ np.cos(theta)), float(self.lengths @ np.sin(theta))
        square = x * x + y * y - reach * reach
        if square <= 0.0:
            return np.full(3, np.nan)
        return theta + (np.arctan2(np.sqrt(square), reach) - np.arctan2(y, x))

    def height(self, theta: Array) -> float:
        """Height of the body above the foot [m]."""
        return float(self.lengths @ np.sin(theta))

    def slopes(self, theta: Array) -> Array:
        """Turn of each link per turn of hip and knee joint (3, 2)."""
        sines = self.lengths * np.sin(theta)
        return _TURNS - (sines @ _TURNS) / float(sines.sum())

    def heights(self, theta: Array) -> Array:
        """Rise of body and hip joint (rows) per turn of hip and knee joint (columns) [m/rad], (2, 2)."""
        rises = (self.lengths * np.cos(theta))[:, None] * self.slopes(theta)
        return np.array([rises.sum(axis=0), rises[:2].sum(axis=0)])

    def mass(self, theta: Array) -> Array:
        """Inertia (2, 2) of the turns of hip and knee joint [kg m^2]."""
        slopes = self.slopes(theta)
        return slopes.T @ (self.inertia * np.cos(theta[:, None] - theta[None, :])) @ slopes

    def weight(self, theta: Array) -> Array:
        """Torque (2,) on hip and knee joint per acceleration of gravity, positive against it [kg m]."""
        return (self.moment * np.cos(theta)) @ self.slopes(theta)

    def equations(self, torque: float, gravity: float) -> Callable[[float, Array], list[float]]:
        """Newton-Euler equations of the constrained chain, as a function of time and state for integrators.

        The state is the turns of hip and knee joint [rad], their rates [rad/s] and the energy that the dampers
        took [J] (5,).  Plain floats: five times as fast as arrays of three.

        Parameters
        ----------
        torque
            Constant torque at the hip [N m], positive lifts.
        gravity
            Acceleration of gravity [m/s^2], positive downward.
        """
        (l0, l1, l2), (a0, a1, a2), (w0, w1, w2) = (one.tolist() for one in (self.lengths, self.angles, self.moment))
        (j00, j01, j02), (_, j11, j12), (_, _, j22) = self.inertia.tolist()
        (k_hip, k_knee), (b_hip, b_knee) = self.stiffness.tolist(), self.damping.tolist()
        reach = l0 * cos(a0) + l1 * cos(a1) + l2 * cos(a2)
        least = (1e-4 * (l0 + l1 + l2)) ** 2

        def slope(_: float, state: Array) -> list[float]:
            hip, knee, hip_rate, knee_rate, _ = state.tolist()
            s, t, h = a0, a1 + knee, a2 + hip + knee
            x, y = l0 * cos(s) + l1 * cos(t) + l2 * cos(h), l0 * sin(s) + l1 * sin(t) + l2 * sin(h)
            square = max(x * x + y * y - reach * reach, least)  # trial states below the ground stay finite
            psi = atan2(sqrt(square), reach) - atan2(y, x)
            s, t, h = s + psi, t + psi, h + psi
            cs, ct, ch, ss, st, sh = cos(s), cos(t), cos(h), sin(s), sin(t), sin(h)
            y = l0 * ss + l1 * st + l2 * sh
            # turns of shin, thigh and hip link per turn of the hip joint (u) and of the knee joint (v)
            u0, v0 = -l2 * sh / y, -(l1 * st + l2 * sh) / y
            u2, v1 = 1.0 + u0, 1.0 + v0
            n0, n1, n2 = (
                u0 * hip_rate + v0 * knee_rate,
                u0 * hip_rate + v1 * knee_rate,
                u2 * hip_rate + v1 * knee_rate,
            )
            guide = -(l0 * cs * n0 * n0 + l1 * ct * n1 * n1 + l2 * ch * n2 * n2) / y
            c01, c02, c12 = j01 * cos(s - t), j02 * cos(s - h), j12 * cos(t - h)
            e01, e02, e12 = j01 * sin(s - t), j02 * sin(s - h), j12 * sin(t - h)
            f0 = (j00 + c01 + c02) * guide + e01 * n1 * n1 + e02 * n2 * n2 + gravity * w0 * cs
            f1 = (c01 + j11 + c12) * guide - e01 * n0 * n0 + e12 * n2 * n2 + gravity * w1 * ct
            f2 = (c02 + c12 + j22) * guide - e02 * n0 * n0 - e12 * n1 * n1 + gravity * w2 * ch
            to_hip = torque - k_hip * hip - b_hip * hip_rate - (u0 * (f0 + f1) + u2 * f2)
            to_knee = -k_knee * knee - b_knee * knee_rate - (v0 * f0 + v1 * (f1 + f2))
            g0, g1, g2 = (
                j00 * u0 + c01 * u0 + c02 * u2,
                c01 * u0 + j11 * u0 + c12 * u2,
                c02 * u0 + c12 * u0 + j22 * u2,
            )
            m_hh, m_hk = u0 * (g0 + g1) + u2 * g2, v0 * g0 + v1 * (g1 + g2)
            g0, g1, g2 = j00 * v0 + (c01 + c02) * v1, c01 * v0 + (j11 + c12) * v1, c02 * v0 + (c12 + j22) * v1
            m_kk = v0 * g0 + v1 * (g1 + g2)
            det = m_hh * m_kk - m_hk * m_hk
            return [
                hip_rate,
                knee_rate,
                (m_kk * to_hip - m_hk * to_knee) / det,
                (m_hh * to_knee - m_hk * to_hip) / det,
                b_hip * hip_rate * hip_rate + b_knee * knee_rate * knee_rate,
            ]

        return slope

    def at_rest(self, q: Array, torque: float, gravity: float) -> Array:
        """Torque (2,) left over on hip and knee joint when nothing moves [N m]."""
        joint = -self.stiffness * q
        joint[0] += torque
        return joint - gravity * self.weight(self.posture(q))

    def kinetic(self, q: Array, rate: Array) -> float:
        """Kinetic energy [J]."""
        return 0.5 * float(rate @ self.mass(self.posture(q)) @ rate)

    def elastic(self, q: Array) -> float:
        """Energy in the springs of the joints [J]."""
        return 0.5 * float(self.stiffness @ q**2)

    def raised(self, q: Array) -> float:
        """Mass times its height above rest [kg m]: energy of gravity per its acceleration."""
        return float(self.moment @ (np.sin(self.posture(q)) - np.sin(self.angles)))
