"""Link-length design: the answer of a step, the landscape, and the optimiser on it."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.design import leg as design_leg
from tarsus.model.structure.leg import SingleMode
from tarsus.model.structure.leg_motion import equilibrium, standing_load, step_response
from tarsus.model.structure.leg_step import step_lift
from tarsus_reproduce.legs import millipede_leg

BOUNDS = (100e-6, 500e-6)


@pytest.fixture(scope="module")
def leg():
    return millipede_leg().leg


@pytest.fixture(scope="module")
def design(leg):
    return design_leg(leg, *BOUNDS)


def test_a_small_step_of_the_nonlinear_leg_peaks_as_the_linearised_one(leg):
    small = ts.with_values(leg, {"torque": 5.7e-9 * 1e-5})
    lift = step_lift(small)
    times = np.linspace(0.0, 2.0 * lift.peak_time, 201)
    motion = step_response(small, times, gravity=0.0)
    assert motion.lift[100] == pytest.approx(lift.peak, rel=1e-6)
    speed = np.interp(lift.peak_time, motion.time, motion.speed)
    assert abs(speed) < 1e-5 * motion.speed.max()
    assert np.all(motion.speed[1:100] > 0.0)  # the first peak


def test_a_leg_with_one_mode_peaks_as_the_closed_form(leg):
    stiff = ts.with_values(leg, {"knee_joint.stiffness": 1e-2, "knee_joint.damping": 1e-6})
    lift, mode = step_lift(stiff), SingleMode.of(stiff)
    root = np.sqrt(1.0 - mode.damping_ratio**2)
    assert lift.peak_time == pytest.approx(0.5 / (mode.frequency * root), rel=1e-3)
    over = np.exp(-np.pi * mode.damping_ratio / root)
    assert lift.peak == pytest.approx(lift.static * (1.0 + over), rel=1e-3)


def test_an_overdamped_leg_has_no_peak_and_no_speed(leg):
    lift = step_lift(ts.with_values(leg, {"body_mass": 0.5e-6}))
    assert lift.peak_time == np.inf and lift.mean_speed == 0.0 and lift.peak == lift.static


def test_at_its_capacity_the_leg_is_as_high_as_without_load(leg):
    chain, small = leg.chain(), ts.with_values(leg, {"torque": 5.7e-9 * 1e-4})
    # a body of that weight, at a small torque, where the linearisation holds
    mass = step_lift(small).lifted / 9.81
    turns = equilibrium(ts.with_values(small, {"body_mass": mass}), 14.0)
    links = 9.81 * (leg.hip.mass + leg.thigh.mass + leg.shin.mass) / step_lift(small).lifted
    lift = chain.height(chain.posture(turns)) - chain.height(chain.rest)
    assert abs(lift) < (links + 1e-4) * step_lift(small).static


def test_the_shin_sets_no_speed_but_must_not_let_the_leg_fold(leg, design):
    shins = [ts.with_values(design.leg, {"shin.length": one}) for one in np.linspace(*BOUNDS, 9)]
    speeds = [step_lift(ts.with_values(one, {"thigh.length": 100e-6})).mean_speed for one in shins]
    assert np.ptp(speeds) < 1e-3 * max(speeds)
    assert step_lift(ts.with_values(shins[0], {"thigh.length": 100e-6})).capacity < design.load
    short = ts.with_values(design.leg, {"shin.length": 100e-6})
    with pytest.raises(InputError, match="folds"):
        equilibrium(short)


def test_the_load_decides_the_length_of_the_hip(leg, design):
    assert design.lift.lifted == pytest.approx(design.load, rel=1e-6)
    assert design.at_bound == ("thigh.length",)


@pytest.mark.parametrize("shin", [150e-6, 250e-6])
def test_the_leg_stands_up_to_its_standing_load(leg, shin):
    one = ts.with_values(leg, {"shin.length": shin})
    mass = standing_load(one) / 9.81
    equilibrium(ts.with_values(one, {"body_mass": 0.99 * mass}))
    with pytest.raises(InputError, match="folds"):
        equilibrium(ts.with_values(one, {"body_mass": 1.01 * mass}))


def test_what_cannot_be_designed_is_said(leg, tmp_path):
    with pytest.raises(InputError, match="carries"):
        design_leg(leg, *BOUNDS, load=1e-3)
    with pytest.raises(InputError, match="shortest < longest"):
        design_leg(leg, 5e-4, 1e-4)
