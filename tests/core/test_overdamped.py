"""Structures damped so strongly that their slow rates lie many orders below their fast ones."""

from __future__ import annotations

import math

import numpy as np
import pytest

import tarsus as ts
from scene_files import one_mode, pushed
from tarsus.core.blocks import split_modes

PUSH = {"kind": "constant", "level": 1e-3}


@pytest.mark.parametrize("zeta", [1e2, 1e4, 1e6])
@pytest.mark.parametrize("spell", [0.01, 1.0, 10.0])
def test_one_mode_creeps_as_its_equation_says(zeta, spell):
    """Under a constant force, to ten slow time constants; those are 4e13 fast ones at most."""
    frequency, mass = 1e4, 1e-6
    rate = 2.0 * math.pi * frequency
    duration = 2.0 * zeta / rate * spell
    run = ts.simulate(pushed(one_mode(frequency, zeta, mass), "A", duration, PUSH))
    root = math.sqrt(zeta * zeta - 1.0)
    slow, fast = -rate / (zeta + root), -rate * (zeta + root)
    ways = -(fast * math.expm1(slow * duration) - slow * math.expm1(fast * duration)) / (fast - slow)
    assert run.ok and run.ledger.closure < 1e-12
    assert run.at(np.array([duration])).state.x[0, -1] == pytest.approx(1e-3 / mass / rate**2 * ways, rel=1e-12)


def chain(zeta: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass, damping, stiffness of three masses of 1 mg, with dashpots between them that are no part of the modes."""
    ties = np.eye(3) - np.eye(3, k=-1)
    rate = 2.0 * math.pi * 1e3
    stiffness = 1e-6 * rate**2 * ties.T @ np.diag([1.0, 2.0, 3.0]) @ ties
    return 1e-6 * np.eye(3), 2e-6 * rate * ties.T @ np.diag([zeta, 0.01, 0.3 * zeta]) @ ties, stiffness


@pytest.mark.parametrize("zeta", [1e2, 1e4])
def test_slow_rates_are_known_to_themselves(zeta):
    """Their product over all modes is det K / det M, fast ones included: what the state matrix loses shows there."""
    mass, damping, stiffness = chain(zeta)
    blocks, _ = split_modes(mass, damping, stiffness)
    product = np.prod([block[0, 0] * block[1, 1] - block[0, 1] * block[1, 0] for block in blocks])
    assert product == pytest.approx(np.linalg.det(stiffness) / np.linalg.det(mass), rel=1e-11)


def test_a_motion_without_stiffness_keeps_its_rates_once_a_foot_is_held():
    """They are 0 and -252.5 /s beside 2e12 /s: Newton's method came from the rounding of the first to another rate, and
    the dampers took 3.6 % more than there was. Numbers by 60 digits."""
    structure = ts.Modal(
        frequencies=(0.0, 0.0, 43.9e6, 52.2e6, 61.9e6),
        damping_ratios=(9670.0, 124.0, 19.3, 4020.0, 2450.0),
        modal_masses=(1.46e-11, 1.24e-11, 5.51e-12, 8.02e-12, 8.28e-12),
        modal_damping=(8.23e-9, 0.0, 0.0, 0.0, 0.0),
        shapes={"foot": (-0.2, 0.166, 0.135, -0.816, 0.943)},
    )
    velocity = (3.66343618, -3.58438694, -0.0805022497, 0.00141885747, -0.00219730676)
    scene = ts.Scene(
        name="captured",
        duration=1.25e-9,
        robot=ts.Robot(structure=structure, feet={"foot": ts.Foot(point="foot", gap=1e-12)}),
        ground={"restitution": {"coefficient": 0.0}, "adhesion": {"initial": 1e3, "rate": 0.0}},
        initial=ts.Initial(velocity=velocity),
    )
    run = ts.simulate(scene)
    held = next(mode for mode in run.motion.engine.tables.modes if mode.mask)
    rates = np.sort(np.abs(np.concatenate([np.linalg.eigvals(block) for block in held.blocks])))
    assert rates[0] < 1e-9 and rates[1] == pytest.approx(252.4562359743402, rel=1e-9)
    # the energy is the impact's, and of the dampers all that the motions without stiffness lose
    assert run.ok and len(run.events) == 1 and run.ledger.closure < 1e-13
    assert run.ledger.damping == pytest.approx(1.7319e-10, rel=1e-3)


def test_a_free_chain_has_a_rate_of_zero():
    """Its stiffness is singular, but for rounding by which a slowest mode was found."""
    ties = np.eye(3) - np.eye(3, k=-1)
    springs = ties.T @ np.diag([0.0, 1532.22456071, 1157.53220434]) @ ties
    blocks, _ = split_modes(np.diag([3.76e-6, 4.97e-6, 6.01e-6]), 1e-6 * springs, springs)
    rates = np.concatenate([np.linalg.eigvals(block) for block in blocks])
    assert np.abs(rates).min() == 0.0 and np.sort(np.abs(rates))[2] > 1e4
