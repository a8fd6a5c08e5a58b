"""Parameters of the three-mass millipede follow from the leg, and say how."""

from __future__ import annotations

import pytest

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.base.units import parse_quantity
from tarsus.model.structure.leg import SingleMode
from tarsus_reproduce.legs import millipede_leg
from tarsus_reproduce.millipede_parameters import millipede_parameters, swing_mass


@pytest.fixture(scope="module")
def leg():
    return millipede_leg().leg


def test_parameters_of_the_printed_leg(leg):
    p = millipede_parameters(leg)
    assert p.body_mass.value == 0.2e-6
    assert p.leg_mass.value == pytest.approx(1.03e-9, rel=0.01)
    # One link of 250 um on the hip spring alone, the knee's share left out, within the knee's 3 %.
    assert p.stiffness_v.value == pytest.approx(7.74e-8 / 250e-6**2, rel=0.03)
    assert p.gain_v.value == pytest.approx(0.0057e-6 / 14.0 / 250e-6, rel=0.03)
    lift = p.gain_v.value * p.volts.value / p.stiffness_v.value
    assert lift == pytest.approx(250e-6 * 5.7e-9 / 7.74e-8, rel=1e-3)
    assert p.damping_l.value / p.stiffness_l.value == pytest.approx(3.4e-9 / 1.05e-5)
    assert p.pairs.value == 15.0


def test_every_parameter_has_a_unit_and_a_sentence(leg):
    for name, one in millipede_parameters(leg).rows():
        assert parse_quantity(f"1 {one.unit}", one.unit) == 1.0, name
        assert one.origin.note.endswith("."), name


def test_two_links_turning_as_one_have_the_moment_of_their_parts(leg):
    m_t, m_s = leg.thigh.mass, leg.shin.mass
    assert swing_mass(leg) == pytest.approx(m_t / 3.0 + m_s * (1.0 + 1.0 / 3.0), rel=1e-12)
    with pytest.raises(InputError, match="right below"):
        swing_mass(ts.with_values(leg, {"thigh.angle": 1.5707963267948966, "shin.angle": 1.5707963267948966}))


def test_an_arm_of_hip_and_thigh_would_explain_the_knee_of_the_payload(leg):
    # Critical masses: 0.69 mg as read; 0.18 mg if the hip joint sat at the body, 0.5 mm from the foot.
    assert SingleMode.of(leg).critical_mass == pytest.approx(0.69e-6, abs=0.005e-6)
    at_body = ts.with_values(leg, {"hip.length": 500e-6})
    assert SingleMode.of(at_body).critical_mass == pytest.approx(0.178e-6, abs=0.002e-6)
