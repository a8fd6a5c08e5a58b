"""Parameters of the walking millipede (4.4)-(4.6), which the source does not print, from Table 4.1."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from tarsus.base.errors import InputError
from tarsus.model.scene import Provenance, Source
from tarsus.model.structure.leg import Leg, SingleMode

__all__ = ["LEGS", "PAYLOAD_KNEE", "Derived", "MillipedeParameters", "millipede_parameters", "swing_mass"]

LEGS = 30
"""Legs of the prototype (section 4.1)."""

PAYLOAD_KNEE = 0.2e-6
"""Body mass beyond which contact gets shorter (section 4.4.1, Fig. 4.11) [kg]; the only one the text names."""


@dataclass(frozen=True)
class Derived:
    """One parameter: value in SI, its unit, and where it comes from."""

    value: float
    unit: str
    origin: Provenance


@dataclass(frozen=True)
class MillipedeParameters:
    """The body's share and one leg of each of the two alternating groups (Fig. 4.5).

    The three masses stand for two legs and what they carry, so that laws of the ground keep their meaning for
    one foot; a robot of 30 legs is ``pairs`` of them moving alike.  Vertical (v): a spring, a damper and a pair
    of forces ``gain * V`` between body and each leg, that on the body upward; lateral (l): the same along the way.
    """

    body_mass: Derived
    leg_mass: Derived
    stiffness_v: Derived
    damping_v: Derived
    gain_v: Derived
    stiffness_l: Derived
    damping_l: Derived
    gain_l: Derived
    foot_gap: Derived
    volts: Derived
    pairs: Derived

    def rows(self) -> list[tuple[str, Derived]]:
        """Names and parameters, in order."""
        return [(one.name, getattr(self, one.name)) for one in fields(self)]


def swing_mass(leg: Leg) -> float:
    """Mass [kg] that thigh and shin put on a lifted foot's vertical motion, turning about the hip joint as one.

    Their moment of inertia about the hip joint over the square of the foot's horizontal distance from it.

    Raises
    ------
    InputError
        If the foot is right below the hip joint: turning does not lift it.
    """
    thigh, shin = (
        one.length * np.array([np.cos(one.angle), np.sin(one.angle)]) for one in (leg.thigh, leg.shin)
    )
    foot = thigh + shin
    if abs(foot[0]) < 1e-6 * (leg.thigh.length + leg.shin.length):
        raise InputError("the foot is right below the hip joint: turning the joint does not lift it")
    middle = thigh + shin / 2.0
    inertia = leg.thigh.mass * (thigh @ thigh) / 3.0
    inertia += leg.shin.mass * (middle @ middle + shin @ shin / 12.0)
    return float(inertia / foot[0] ** 2)


def millipede_parameters(leg: Leg) -> MillipedeParameters:
    """Parameters of the three-mass millipede from a leg; each says how.

    Raises
    ------
    InputError
        If the leg has no linearisation, or its foot is right below its hip joint.
    """
    mode = SingleMode.of(leg)
    arm = abs(leg.thigh.length * np.cos(leg.thigh.angle) + leg.shin.length * np.cos(leg.shin.angle))
    lateral = leg.hip_joint.stiffness / arm**2
    return MillipedeParameters(
        body_mass=_assumed(
            PAYLOAD_KNEE,
            "kg",
            "The nominal body mass is not printed. The one mass that the text names is 0.2 mg, beyond which "
            "contact gets shorter (Fig. 4.11), within payloads of 0.05 to 0.5 mg; as the share of two legs it "
            "makes a body of 3 mg.",
            (0.05e-6, 0.5e-6),
        ),
        leg_mass=_derived(
            swing_mass(leg),
            "kg",
            "Thigh and shin turning about the hip joint, as felt at the foot: moment of inertia over the square of the "
            "foot's horizontal distance. As good as the assumed sections of the links.",
        ),
        stiffness_v=_derived(
            mode.stiffness,
            "N/m",
            "k_b,v of (4.3): hip and knee spring of Table 4.1 in the slow mode of the linearised leg, per metre "
            "at the body.",
        ),
        damping_v=_derived(
            mode.damping,
            "N s/m",
            "c_b,v of (4.3): both dampers of Table 4.1 in the same mode. A body of less than "
            f"{mode.critical_mass * 1e6:.2f} mg on one leg creeps without a peak, and a foot in the air loses its "
            "speed within microseconds.",
        ),
        gain_v=_derived(
            mode.gain,
            "N/V",
            "G_v of (4.3): the torque of Table 4.1 (E11) per volt through the leg's Jacobian, in the same mode; "
            "linear in the voltage, as the source takes it.",
        ),
        stiffness_l=_assumed(
            lateral,
            "N/m",
            "The in-plane stiffness is not printed; the source calls its own a rough calculation. Taken as the "
            "torsional stiffness of the vertical actuator, made of the same film, at the foot's horizontal "
            "distance from the joint.",
        ),
        damping_l=_assumed(
            lateral * leg.knee_joint.damping / leg.knee_joint.stiffness,
            "N s/m",
            "Not printed. The lateral actuator's own ratio of damping to stiffness, b_op,l / k_op,l of Table 4.1, "
            "on the assumed stiffness.",
        ),
        gain_l=_assumed(
            leg.torque_gain / arm,
            "N/V",
            "Not printed. The torque per volt of the vertical actuator at the same distance; the actuators are "
            "electrically coupled (section 4.1), so one voltage drives both.",
        ),
        foot_gap=_assumed(
            0.0,
            "m",
            "Not printed. All feet stand on the ground with springs relaxed at 0 V; gravity then lets the body sag by "
            f"{PAYLOAD_KNEE * 9.81 / (2.0 * mode.stiffness) * 1e6:.2f} um on both legs.",
        ),
        volts=Derived(
            leg.rated_volts,
            "V",
            Provenance(source=Source.PRINTED, note="Height of the steps in section 4.3.1."),
        ),
        pairs=_derived(LEGS / 2.0, "1", "30 legs (section 4.1) in two alternating groups."),
    )


def _derived(value: float, unit: str, note: str) -> Derived:
    return Derived(value, unit, Provenance(source=Source.DERIVED, note=note))


def _assumed(value: float, unit: str, note: str, interval: tuple[float, float] | None = None) -> Derived:
    bounds = None if interval is None else (interval,)
    return Derived(value, unit, Provenance(source=Source.ASSUMED, note=note, interval=bounds))
