"""Block-diagonal form of a structure and the exponential of its blocks."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.core.blocks import split_modes


def check(mass, damping, stiffness):
    n = len(mass)
    blocks, basis = split_modes(mass, damping, stiffness)
    inverse = np.linalg.inv(mass)
    state = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ stiffness, -inverse @ damping]])
    diagonal = np.zeros((2 * n, 2 * n))
    for r, block in enumerate(blocks):
        diagonal[np.ix_([r, n + r], [r, n + r])] = block
    # compared in velocities over the fastest rate and displacements alike
    left, right = state @ basis, basis @ diagonal
    for half in (slice(0, n), slice(n, None)):
        np.testing.assert_allclose(left[half], right[half], rtol=0, atol=1e-10 * max(np.abs(left[half]).max(), 1e-300))
    return blocks


MASS = np.array([[2.0, 0.3, 0.0], [0.3, 1.0, 0.0], [0.0, 0.0, 0.5]])
STIFFNESS = np.array([[300.0, -100.0, 0.0], [-100.0, 250.0, -80.0], [0.0, -80.0, 90.0]])


ANY = np.array([[1.0, -0.4, 0.0], [0.2, 3.0, 0.0], [0.0, 0.0, 0.1]])


@pytest.mark.parametrize("damping", [0.0 * STIFFNESS, 1e-4 * STIFFNESS, 10.0 * STIFFNESS, ANY])
def test_damping_of_any_shape(damping):
    check(MASS, damping, STIFFNESS)


def test_two_slow_rates_beside_a_fast_dashpot_keep_a_block_of_their_own_size():
    """Masses on springs that a weak dashpot alone holds to the ground: rates 0 and -0.3 beside one of -3e7. By the fast
    rate their vectors hardly differ, and a block of the plane they span was 2e4 times their size: events stalled."""
    mass = np.diag([1.1e-6, 1.8e-6, 1.2e-6, 0.9e-6])
    ties = np.eye(4) - np.eye(4, k=-1)
    stiffness = ties.T @ np.diag([0.0, 11.0, 1.3, 9.0]) @ ties
    damping = ties.T @ np.diag([1.6e-6, 4e-8, 5e-4, 17.0]) @ ties
    blocks, basis = split_modes(mass, damping, stiffness)
    rates = [np.linalg.eigvals(block) for block in blocks]
    slow = int(np.argmin([np.abs(rate).max() for rate in rates]))
    total = damping[0, 0] + damping[0, 1] + sum(damping[1:, :].sum(axis=1))
    assert np.sort(rates[slow].real) == pytest.approx([-total / mass.sum(), 0.0], abs=2e-4)
    assert np.abs(blocks[slow]).max() < 2.0 * np.abs(rates[slow]).max()
    inverse = np.linalg.inv(basis)
    apart = basis @ inverse - np.eye(8)
    apart[4:, :4] /= 1e3  # velocities per displacement: by a rate of the springs
    assert np.abs(apart[:, :4]).max() < 1e-13


def test_a_slow_rate_beside_a_fast_one_keeps_its_digits():
    """M = [[1, 1/2], [1/2, 1]], K = diag(1, 1e14): the smaller root of 3/4 s^2 - (K + 1) s + K = 0."""
    stiff = 1e14
    mass = np.array([[1.0, 0.5], [0.5, 1.0]])
    blocks, _ = split_modes(mass, np.zeros((2, 2)), np.diag([1.0, stiff]))
    slow = 2.0 * stiff / (1.0 + stiff + np.sqrt((1.0 + stiff) ** 2 - 3.0 * stiff))
    rates = np.sort(np.linalg.det(blocks))
    assert rates[0] == pytest.approx(slow, rel=1e-13)


@pytest.mark.parametrize("ratio", [0.0, 0.02])
def test_a_held_structure_with_a_stiff_mode_keeps_its_account(ratio):
    """Its stiffnesses mixed lost (fast / slow)^2 of their digits: the account of a pressed foot was open by 4e-7."""
    structure = ts.Modal(
        frequencies=(49.4e6, 136.0, 329.0, 2866.0),
        damping_ratios=(ratio,) * 4,
        modal_masses=(2e-6,) * 4,
        shapes={"foot": (0.22, 0.47, 1.45, 3.02)},
    )
    scene = ts.Scene(
        name="stiff",
        robot=ts.Robot(
            structure=structure,
            feet={"foot": ts.Foot(point="foot", gap=1e-6)},
            drives={"press": ts.Drive(load=ts.PointLoad(weights={"foot": -1.0}), law=ts.LinearForce(gain=1e-4))},
        ),
        ground=ts.Ground(adhesion=ts.Adhesion(initial=1.0, rate=0.0)),
        signals={"press": ts.Sine(amplitude=1.0, offset=1.5, frequency=40.0)},
        duration=0.02,
    )
    run = ts.simulate(scene)
    assert run.events["kind"].tolist() == [2]  # once captured it stays
    assert run.ok and run.ledger.closure < 1e-11


@pytest.mark.parametrize("seed", range(12))
def test_dampers_that_take_from_one_side_alone_leave_a_free_plate_its_rest(seed):
    """It rests anywhere without a force, and what moves elastically pushes it along: the double zero is taken off
    first. Found among all rates it was, in one of eight masses, another motion: 1e-4 of the state matrix off."""
    damping = 1e-4 * np.array(
        [[9.0, -2.0, -4.0, -3.0], [-2.5, 2.5, 0.0, 0.0], [-3.0, 0.0, 3.0, 0.0], [-3.5, 0.0, 0.0, 3.5]]
    )
    stiffness = np.diag([48.0, 15.0, 18.0, 15.0])
    stiffness[0, 1:] = stiffness[1:, 0] = [-15.0, -18.0, -15.0]
    nudge = 1.0 + 1e-9 * np.random.default_rng(seed).normal(size=4)
    blocks = check(1e-6 * np.array([20.0, 1.0, 1.3, 0.8]) * np.eye(4) * nudge, damping, stiffness)
    assert np.sum(np.abs(np.linalg.det(blocks)) == 0.0) == 1
