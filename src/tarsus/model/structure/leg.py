"""A leg of three links under a body that moves up and down: its description and its linearisation."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.linear import inverse, modes_of, product, solve
from tarsus.base.messages import PathErrors
from tarsus.base.spec import Amount, Description, quantity
from tarsus.model.structure.base import Array
from tarsus.model.structure.leg_chain import Chain
from tarsus.model.structure.lumped import Lumped


class Link(Description):
    """A rigid, uniform, straight link of a leg."""

    length: Amount = quantity("m", "length of the link", gt=0)
    density: Amount = quantity("kg/m", "mass per length of the link", gt=0)
    angle: Amount = quantity("rad", "direction at rest, from the end near the foot, above the horizontal")

    @property
    def mass(self) -> float:
        """Mass [kg]."""
        return self.length * self.density


class Joint(Description):
    """A torsion spring and damper between two links, relaxed in the posture at rest."""

    stiffness: Amount = quantity("N m/rad", "torsional stiffness", gt=0)
    damping: Amount = quantity("N m s/rad", "torsional damping coefficient", ge=0)


class Leg(Description):
    """A planar leg on a pinned foot, carrying a point mass that moves only vertically (Fig. 4.3, Table 4.1).

    The source describes the figure in words only: hip, thigh and shin; a simply supported foot; a point mass
    for the body; vertical motion of it without friction; a torque of the vertical actuator at the hip.  Read as::

                                               | guide, no friction
           knee        thigh        hip        |   hip link
             o======================o==========(m) body: point mass
             | knee_joint       hip_joint      |
             | (lateral         (vertical      |
        shin | actuator, out     actuator:     |
             | of plane)         spring, damper, torque)
             |
        _____^_______________________________________ ground
            foot: pinned, turns freely

    Angles of links are directions above the horizontal, from the foot towards the body: at rest 90 deg, 0, 0
    above.  A point mass carries no moment, so the hip link turns freely on it, as the shin does on the
    foot.  Three links, less the two conditions that the body stays on its guide and the foot on its pin, leave
    **two coordinates**: the turn of the hip joint and that of the knee joint [rad], both zero at rest; a positive
    torque at the hip raises the body.  Were the hip link clamped to the body instead, only the stiff knee
    could give way, and the printed torque would lift the body by 0.13 um instead of 18 um.

    With the links at rest as drawn the lift is, to first order,
    ``hip.length * hip turn + (hip.length + thigh.length) * knee turn``.
    """

    hip: Link
    thigh: Link
    shin: Link
    hip_joint: Joint
    knee_joint: Joint
    body_mass: Amount = quantity("kg", "mass that the leg carries: its share of body and payload", gt=0)
    torque: Amount = quantity("N m", "torque of the vertical actuator at the hip, at the rated voltage")
    rated_volts: Amount = quantity("V", "voltage that gives the torque", gt=0)

    def model_post_init(self, context: object) -> None:
        """Refuse a posture at rest from which the body's height does not follow."""
        lengths = [self.shin.length, self.thigh.length, self.hip.length]
        angles = [self.shin.angle, self.thigh.angle, self.hip.angle]
        height = sum(a * math.sin(b) for a, b in zip(lengths, angles, strict=True))
        if height < 1e-3 * sum(lengths):
            text = f"the posture at rest puts the body {height:.3g} m above the foot: it must be above it"
            raise PathErrors([("", text)])

    @property
    def torque_gain(self) -> float:
        """Torque per volt at the hip [N m/V]; linear, as the source takes the gain of (4.3)."""
        return self.torque / self.rated_volts

    def chain(self) -> Chain:
        """The leg as arrays, with its exact kinematics."""
        return Chain.of(
            lengths=[self.shin.length, self.thigh.length, self.hip.length],
            angles=[self.shin.angle, self.thigh.angle, self.hip.angle],
            masses=[self.shin.mass, self.thigh.mass, self.hip.mass],
            body_mass=self.body_mass,
            stiffness=[self.hip_joint.stiffness, self.knee_joint.stiffness],
            damping=[self.hip_joint.damping, self.knee_joint.damping],
        )

    def lever(self) -> Array:
        """Rise (2,) of the body per turn of hip and of knee joint, at rest [m/rad]."""
        chain = self.chain()
        return chain.heights(chain.rest)[0]

    def linearised(self) -> Lumped:
        """The leg near rest, in the heights ``body`` and ``hip`` (of the hip joint) above rest [m].

        Raises
        ------
        InputError
            If the heights do not determine the joints, as with an upright thigh.
        """
        chain = self.chain()
        back = self._joints_of_heights()
        mass = product(back.T, chain.mass(chain.rest), back)
        weight = product(back.T, chain.weight(chain.rest))
        damping, stiffness = (product(back.T * one, back) for one in (chain.damping, chain.stiffness))
        return Lumped(
            coordinates=("body", "hip"),
            mass=(mass + mass.T) / 2.0,  # pyright: ignore[reportArgumentType]
            damping=(damping + damping.T) / 2.0,  # pyright: ignore[reportArgumentType]
            stiffness=(stiffness + stiffness.T) / 2.0,  # pyright: ignore[reportArgumentType]
            upward=solve(mass, weight),  # pyright: ignore[reportArgumentType]
        )

    def torque_load(self) -> Array:
        """Forces (2,) on the heights of `linearised` per torque at the hip [1/m]."""
        return self._joints_of_heights()[0].copy()

    def _joints_of_heights(self) -> Array:
        """Turns of hip and knee joint (rows) per height of body and hip joint (columns) [rad/m]."""
        chain = self.chain()
        heights = chain.heights(chain.rest)
        if abs(np.linalg.det(heights)) < 1e-6 * float(np.sum(chain.lengths)) ** 2:
            raise InputError("at this posture the heights of body and hip joint do not determine the joints")
        return inverse(heights)


@dataclass(frozen=True)
class SingleMode:
    """``m_b y'' + c y' + k y = G_v V``: the body's height on one mode (4.3).

    mass [kg], damping [N s/m], stiffness [N/m], gain [N/V].
    """

    mass: float
    damping: float
    stiffness: float
    gain: float

    @classmethod
    def of(cls, leg: Leg) -> SingleMode:
        """The slow mode of a linearised leg, scaled to one at the body; its damping without the cross terms."""
        linear = leg.linearised()
        matrices = linear.matrices()
        shape = modes_of(matrices.mass, matrices.stiffness)[1][:, 0]
        shape = shape / product(linear.row("body"), shape)
        return cls(
            mass=float(product(shape, matrices.mass, shape)),
            damping=float(product(shape, matrices.damping, shape)),
            stiffness=float(product(shape, matrices.stiffness, shape)),
            gain=float(product(shape, leg.torque_load())) * leg.torque_gain,
        )

    @property
    def frequency(self) -> float:
        """Undamped natural frequency [Hz]."""
        return math.sqrt(self.stiffness / self.mass) / (2.0 * math.pi)

    @property
    def damping_ratio(self) -> float:
        """Damping ratio [1]; above one no peak follows a step."""
        return self.damping / (2.0 * math.sqrt(self.stiffness * self.mass))

    @property
    def critical_mass(self) -> float:
        """Mass [kg] at which spring and damper are critically damped: a heavier body overshoots."""
        return self.damping**2 / (4.0 * self.stiffness)

    def structure(self) -> Lumped:
        """As a structure with the one coordinate ``body``."""
        return Lumped(
            coordinates=("body",), mass=((self.mass,),), damping=((self.damping,),), stiffness=((self.stiffness,),)
        )
