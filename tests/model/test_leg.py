"""The leg: exact kinematics, its linearisation, energies, equilibria and the single mode."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.model.structure.leg import SingleMode
from tarsus.model.structure.leg_motion import equilibrium, free_motion, step_response
from tarsus_reproduce.legs import millipede_leg

BENT = {"hip.angle": 0.3, "thigh.angle": -0.4, "shin.angle": 1.3, "thigh.length": 3.1e-4, "shin.length": 3.9e-4}
UNDAMPED = {"hip_joint.damping": 0.0, "knee_joint.damping": 0.0}
HEAVY = {"hip.density": 1e-3, "thigh.density": 2e-3, "shin.density": 1.5e-3}


@pytest.fixture(scope="module")
def leg():
    return millipede_leg().leg


def test_the_drawn_posture_lifts_by_the_hip_alone(leg):
    assert leg.lever() == pytest.approx([250e-6, 500e-6], rel=1e-12)
    assert leg.torque_load() * leg.hip.length == pytest.approx([1.0, -2.0], rel=1e-12)


@pytest.mark.parametrize("change", [{}, BENT], ids=["flat", "bent"])
def test_static_lift_equals_that_of_the_linearisation(leg, change):
    one = ts.with_values(leg, {**change, "torque": 5.7e-9 * 1e-6})
    turns = equilibrium(one, 14.0, gravity=0.0)
    chain = one.chain()
    lift = chain.height(chain.posture(turns)) - chain.height(chain.rest)
    linear = np.linalg.solve(one.linearised().matrices().stiffness, one.torque_load() * one.torque)[0]
    assert lift == pytest.approx(linear, rel=1e-6)


@pytest.mark.parametrize("change", [HEAVY, {**HEAVY, **BENT}], ids=["flat", "bent"])
def test_small_free_motion_has_the_frequency_of_the_linearisation(leg, change):
    one = ts.with_values(leg, {**change, **UNDAMPED})
    m = one.linearised().matrices()
    squares, shapes = np.linalg.eig(np.linalg.solve(m.mass, m.stiffness))
    slow = np.argmin(squares)
    turns = np.linalg.solve(one.chain().heights(one.chain().rest), shapes[:, slow])
    turns = turns * 1e-7 / np.abs(turns).max()
    period = 2.0 * np.pi / np.sqrt(squares[slow])
    times = np.linspace(0.0, 3.5 * period, 1200)
    motion = free_motion(one, times, turns, np.zeros(2), 0.0, 0.0)
    height = motion.speed
    up = np.flatnonzero((height[1:-1] < 0.0) & (height[2:] >= 0.0)) + 1
    at = [np.interp(0.0, height[i : i + 2], times[i : i + 2]) for i in up]
    assert np.diff(at).mean() == pytest.approx(period, rel=1e-6)


def test_without_dampers_energy_is_conserved(leg):
    one = ts.with_values(leg, {**HEAVY, **BENT, **UNDAMPED})
    motion = step_response(one, np.linspace(0.0, 0.01, 60))
    assert motion.dissipated.max() == 0.0
    assert np.abs(motion.work).max() > 1e-11  # it moved, and not a little
    assert motion.closure < 1e-9


def test_with_dampers_the_balance_closes_and_the_leg_settles(leg):
    motion = step_response(leg, np.linspace(0.0, 0.03, 100))
    assert motion.complete and motion.closure < 1e-8
    assert np.all(np.diff(motion.dissipated) >= -1e-15 * motion.dissipated[-1])  # it rests in the end, to rounding
    assert motion.turns[-1] == pytest.approx(equilibrium(leg, 14.0), rel=1e-5)


def test_the_weight_of_the_linearisation_is_that_of_the_leg(leg):
    linear = leg.linearised()
    sag = np.linalg.solve(linear.matrices().stiffness, -1e-4 * linear.matrices().mass @ linear.vertical())
    chain = leg.chain()
    turns = equilibrium(leg, 0.0, gravity=1e-4)
    assert chain.height(chain.posture(turns)) - chain.height(chain.rest) == pytest.approx(sag[0], rel=1e-5)


def test_a_single_mode_is_nearly_the_leg(leg):
    mode, matrices = SingleMode.of(leg), leg.linearised().matrices()
    exact = np.sqrt(np.linalg.eigvals(np.linalg.solve(matrices.mass, matrices.stiffness)).min()) / (2 * np.pi)
    assert mode.frequency == pytest.approx(exact, rel=1e-9)
    static = np.linalg.solve(matrices.stiffness, leg.torque_load() * leg.torque)[0]
    assert mode.gain * 14.0 / mode.stiffness == pytest.approx(static, rel=1e-4)
    assert mode.critical_mass == pytest.approx(mode.damping_ratio**2 * mode.mass)
    assert mode.structure().matrices().stiffness == pytest.approx(mode.stiffness)


def test_a_leg_that_comes_down_ends_there(leg):
    weak = ts.with_values(leg, {"hip_joint.stiffness": 1e-10, "hip_joint.damping": 1e-13})
    motion = free_motion(weak, np.linspace(0.0, 0.02, 20), np.zeros(2), np.zeros(2), 0.0, 9.81)
    assert not motion.complete
    assert motion.time[-1] < 0.02
