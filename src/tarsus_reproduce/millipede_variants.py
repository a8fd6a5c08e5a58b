"""The named millipedes: readings of what the dissertation does not print, each on the printed reference ground.

``millipede`` rings: its damping is what the words of sections 4.3 and 5.1.4 need, a governing frequency and chatter
(erratum E16). ``millipede-table`` has the damping of Table 4.1 in its place. ``millipede-printed`` lands by (2.13) as
printed. Their unprinted numbers were chosen so that the trends of section 4.4.1 come out, inside the ranges of
`tarsus_reproduce.readings`; how much that says, the distribution of the score over those ranges tells.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from tarsus.model.laws import AdhesiveFriction, Friction, PullAsPrinted, RestituteFirst
from tarsus.model.scene import Provenance, Source
from tarsus_reproduce.millipede_parameters import Derived, MillipedeParameters
from tarsus_reproduce.walker_settings import Setting, assumed

__all__ = ["CHOSEN", "Variant", "millipede_variants"]

CHOSEN = "Chosen within the range of random readings so that the trends of section 4.4.1 come out."


@dataclass(frozen=True)
class Variant:
    """One named millipede: its parameters, and what it walks on."""

    parameters: MillipedeParameters
    setting: Setting


def millipede_variants(parameters: MillipedeParameters) -> Mapping[str, Variant]:
    """The named millipedes from the parameters of Table 4.1's leg, by name."""
    ringing = _ringing_setting()
    return {
        "millipede": Variant(_ringing(parameters), ringing),
        "millipede-table": Variant(parameters, ringing),
        "millipede-printed": Variant(_printed(parameters), _printed_setting()),
    }


def _damped(stiffness: float, mass: float, ratio: float) -> float:
    """Damping [N s/m] of a damping ratio of a mass on one spring, as in (4.3)."""
    return 2.0 * ratio * (stiffness * mass) ** 0.5


def _chosen(value: float, unit: str, why: str) -> Derived:
    return Derived(value, unit, assumed(f"Not printed. {why} {CHOSEN}"))


def _lighter(parameters: MillipedeParameters, mass: float) -> Derived:
    """The body's share on two legs; payloads of Fig. 4.11 take its place in that figure's study."""
    return replace(
        parameters.body_mass,
        value=mass,
        origin=assumed(
            "The nominal body mass is not printed; Fig. 4.11 tries payloads of 0.05 to 0.5 mg, about the 0.2 mg beyond "
            f"which contact gets shorter. {CHOSEN}"
        ),
    )


def _ringing(p: MillipedeParameters) -> MillipedeParameters:
    body = _lighter(p, 0.1e-6)
    lateral = 2.31
    return replace(
        p,
        body_mass=body,
        leg_mass=_chosen(
            1.23e-9, "kg", "Thigh and shin at the foot, 1.03 ug by Table 4.1's lengths, and a foot."
        ),
        damping_v=Derived(
            _damped(p.stiffness_v.value, body.value, 0.0238),
            "N s/m",
            assumed(
                "A damping ratio of (4.3) of 0.0238. Section 4.3.2 takes it from a measurement that is not printed; "
                f"Fig. 4.4 has a governing frequency, which Table 4.1's damping has not (E16). {CHOSEN}"
            ),
        ),
        stiffness_l=_chosen(lateral, "N/m", "Twice the vertical actuator's at the foot."),
        damping_l=_chosen(_damped(lateral, body.value, 0.183), "N s/m", "A damping ratio of 0.183."),
        gain_l=_chosen(0.373 * p.gain_v.value, "N/V", "0.373 N along the way for each newton upward."),
    )


def _ringing_setting() -> Setting:
    return Setting(
        friction=Friction(coefficient=0.432),
        landing=RestituteFirst(speed=0.462e-3),
        film_thickness=0.133e-6,
        offset=16e-6,
        frequency=102.0,
        frequency_note=f"Not printed; section 2.5 drives at 5 to 100 Hz. {CHOSEN}",
        laws={
            "ground.friction.coefficient": assumed(
                f"Not printed: the source's friction is arbitrary. Dry friction of silicon. {CHOSEN}"
            ),
            "ground.landing.speed": assumed(
                f"Not printed: nothing says when a foot that rebounds is held. {CHOSEN}"
            ),
        },
    )


ARM = 500e-6
"""Foot's distance from the joint [m] if hip and thigh turned together: Table 4.1's stiffness and torque over it are
0.31 N/m and 11.4 uN at 14 V, and the damping's critical mass, 0.18 mg, comes near the 0.2 mg of Fig. 4.11."""

HIP_STIFFNESS, HIP_TORQUE = 7.74e-8, 0.0057e-6 / 14.0
"""k_op,v of Table 4.1 [N m/rad], and its torque (E11) per volt [N m/V]."""


def _printed(p: MillipedeParameters) -> MillipedeParameters:
    body = _lighter(p, 0.157e-6)
    stiffness, lateral, gain = HIP_STIFFNESS / ARM**2, 0.169, HIP_TORQUE / ARM
    return replace(
        p,
        body_mass=body,
        leg_mass=_chosen(
            0.687e-9, "kg", "Two thirds of thigh and shin at the foot, 1.03 ug by Table 4.1's lengths."
        ),
        stiffness_v=Derived(stiffness, "N/m", _derived("k_op,v of Table 4.1 at an arm of 500 um.")),
        damping_v=Derived(
            _damped(stiffness, body.value, 0.071),
            "N s/m",
            assumed(
                "A damping ratio of (4.3) of 0.071. By (2.13) as printed a foot with a body's weight on it bounces "
                f"where the damper's c e v exceeds that weight: the ratio decides from which restitution on. {CHOSEN}"
            ),
        ),
        gain_v=Derived(gain, "N/V", _derived("tau_op of Table 4.1 (E11) per volt, at an arm of 500 um.")),
        stiffness_l=_chosen(lateral, "N/m", "Half the vertical one."),
        damping_l=_chosen(_damped(lateral, body.value, 0.136), "N s/m", "A damping ratio of 0.136."),
        gain_l=_chosen(0.945 * gain, "N/V", "0.945 N along the way for each newton upward."),
    )


def _printed_setting() -> Setting:
    return Setting(
        friction=AdhesiveFriction(coefficient=7.96),
        landing=PullAsPrinted(),
        film_thickness=0.784e-6,
        offset=16.1e-6,
        frequency=49.3,
        frequency_note=f"Not printed; section 2.5 drives at 5 to 100 Hz. {CHOSEN}",
        laws={
            "ground.friction.coefficient": assumed(
                "Not printed: friction is 'assumed to be related to adhesion force', here by adhesion alone, "
                "2.2 uN on a foot that has just landed. " + CHOSEN
            )
        },
    )


def _derived(note: str) -> Provenance:
    return Provenance(source=Source.DERIVED, note=note)
