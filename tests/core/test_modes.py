"""Contact modes and their step tables against the plain equations of motion."""

from __future__ import annotations

import sys
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import numpy as np
import pytest
from scipy.linalg import expm

from divergence import moved
from random_scenes import wide_scene
from tarsus.core.modes import LinearSystem, ModeBook, contact_mode
from tarsus.core.nodes import TAU, N
from tarsus.plan.lowering import lower_scene

MASS = np.array([[2.0, 0.3, 0.0], [0.3, 1.0, 0.0], [0.0, 0.0, 0.5]])
STIFFNESS = np.array([[300.0, -100.0, 0.0], [-100.0, 250.0, -80.0], [0.0, -80.0, 90.0]])
SYSTEM = LinearSystem(
    mass=MASS,
    damping=0.01 * STIFFNESS + 0.2 * np.diag([1.0, 0.0, 2.0]),
    stiffness=STIFFNESS,
    normals=np.array([[1.0, 0.0], [0.0, 0.6], [0.0, 1.0]]),
    rest_gap=np.array([0.02, 0.05]),
    loads=np.array([[0.5], [1.0], [0.0]]),
    weight=np.array([[-1.0, 0.0], [0.0, 0.0], [-0.5, 0.0]]),
)


def test_free_mode_is_the_structure():
    mode = contact_mode(SYSTEM, 0)
    z = np.array([0.1, -0.2, 0.05, 1.0, 2.0, -1.0])
    y = mode.from_physical @ z
    np.testing.assert_allclose(mode.to_physical @ y, z, rtol=1e-12)
    gap = SYSTEM.rest_gap + SYSTEM.normals.T @ z[:3]
    np.testing.assert_allclose(mode.outputs[:2] @ y + mode.feed[:2, -1], gap, rtol=1e-12)
    np.testing.assert_allclose(mode.outputs[2:] @ y, SYSTEM.normals.T @ z[3:], rtol=1e-12)
    inverse = SYSTEM.normals.T @ np.linalg.solve(MASS, SYSTEM.normals)
    np.testing.assert_allclose(mode.mobility, np.diag(inverse), rtol=1e-12)


@pytest.mark.parametrize("mask", [1, 2, 3])
def test_held_feet_stay_on_the_ground_and_take_the_momentum(mask):
    mode = contact_mode(SYSTEM, mask)
    held = [i for i in range(2) if mask >> i & 1]
    z = np.array([0.1, -0.2, 0.05, 1.0, 2.0, -1.0])
    after = mode.to_physical @ (mode.from_physical @ (z - mode.offset)) + mode.offset
    np.testing.assert_allclose((SYSTEM.rest_gap + SYSTEM.normals.T @ after[:3])[held], 0.0, atol=1e-14)
    np.testing.assert_allclose((SYSTEM.normals.T @ after[3:])[held], 0.0, atol=1e-14)
    impact = MASS @ (after[3:] - z[3:])  # only impulses along the held normals
    impulse, *_ = np.linalg.lstsq(SYSTEM.normals[:, held], impact, rcond=None)
    np.testing.assert_allclose(SYSTEM.normals[:, held] @ impulse, impact, atol=1e-12)


def test_pull_balances_the_held_foot():
    """M a = u - C v - K x - n pull, with a along the constraint."""
    mode = contact_mode(SYSTEM, 1)
    y = np.array([0.3, -0.1, 0.2, 0.5])
    values = np.zeros(6)
    values[4], values[5] = 2.0, 1.0  # drive, constant
    z = mode.to_physical @ y + mode.offset
    nb = len(mode.blocks)
    rate = (
        np.concatenate(
            [
                mode.blocks[:, 0, 0] * y[:nb] + mode.blocks[:, 0, 1] * y[nb:],
                mode.blocks[:, 1, 0] * y[:nb] + mode.blocks[:, 1, 1] * y[nb:],
            ]
        )
        + values @ mode.inputs
    )
    acceleration = (mode.to_physical @ rate)[3:]
    pull = mode.outputs[0] @ y + mode.feed[0] @ values
    force = SYSTEM.loads[:, 0] * 2.0 + SYSTEM.constant - SYSTEM.damping @ z[3:] - STIFFNESS @ z[:3]
    np.testing.assert_allclose(MASS @ acceleration, force - SYSTEM.normals[:, 0] * pull, atol=1e-11)


def test_step_tables_flow_exactly_over_long_and_short_steps():
    """Against the exponential of the augmented matrix: a drive t^3 on the structure, steps 0.5 us to 8 s."""
    lengths = 8.0 * 0.5 ** np.arange(24)
    book = ModeBook(SYSTEM, lengths)
    number = book.require(0)
    mode = book.modes[number]
    n, inverse = 3, np.linalg.inv(MASS)
    for k in (0, 4, 10, 23):
        h = lengths[k]
        big = np.zeros((2 * n + 5, 2 * n + 5))  # x, v, (1, s, s^2, s^3) and the constant
        big[:n, n : 2 * n] = np.eye(n)
        big[n : 2 * n, :n], big[n : 2 * n, n : 2 * n] = -inverse @ STIFFNESS, -inverse @ SYSTEM.damping
        big[n : 2 * n, 2 * n + 3] = inverse @ SYSTEM.loads[:, 0]
        big[n : 2 * n, 2 * n + 4] = inverse @ SYSTEM.constant
        for c in range(3):
            big[2 * n + 1 + c, 2 * n + c] = (c + 1) / h
        z = np.array([0.1, -0.2, 0.05, 1.0, 2.0, -1.0])
        exact = (expm(big * h) @ np.concatenate([z, [1.0, 0, 0, 0, 1.0]]))[: 2 * n]
        y = mode.from_physical @ z
        nb = len(mode.blocks)
        tables = book.native.step(number, k)
        e = tables["exponential"].reshape(4, -1)[:, :nb]
        end = np.concatenate([e[0] * y[:nb] + e[1] * y[nb:], e[2] * y[:nb] + e[3] * y[nb:]])
        pushed = TAU**3 @ tables["state_input"].reshape(6, N, -1)[4]
        pushed += SYSTEM.sources @ tables["state_bias"].reshape(4, -1)
        end += pushed.reshape(2, -1)[:, :nb].ravel()
        np.testing.assert_allclose(mode.to_physical @ end, exact, rtol=0, atol=1e-11 * np.abs(exact).max())
        state = tables["node_state"].reshape(4, -1, 2, N)[0, :nb]
        constant = SYSTEM.sources @ tables["node_bias"].reshape(4, 4, N)[:, 0]
        gap = y[:nb] @ state[:, 0] + y[nb:] @ state[:, 1] + constant
        gap = gap + TAU**3 @ tables["node_input"].reshape(4, 6, N, N)[0, 4]
        assert gap.shape == (N,)
        assert gap[0] == pytest.approx(0.02 + 0.1, rel=1e-11)
        assert gap[-1] == pytest.approx(0.02 + exact[0], rel=1e-10)


def test_feet_beyond_the_coordinates_follow_those_that_lead():
    """Of 24 feet on three coordinates, at any places and two of them at one, three lead; with one held two."""
    rng = np.random.default_rng(5)
    normals = rng.normal(size=(3, 24))
    normals[:, 7] = normals[:, 3]
    system = LinearSystem(
        MASS, SYSTEM.damping, STIFFNESS, normals, rng.uniform(0.0, 1e-3, 24), SYSTEM.loads, SYSTEM.weight
    )
    for mask, count in ((0, 3), (1 << 5, 2), (0b1011, 0)):
        mode = contact_mode(system, mask)
        free = [i for i in range(24) if not mask >> i & 1]
        assert len(mode.leading) == count
        assert set(mode.leading) <= set(free)
        moves = mode.outputs[free]  # gaps and what impulses on feet do, by those of the leading ones
        shares = mode.spanned[free]
        np.testing.assert_allclose(shares @ mode.outputs[mode.leading], moves, rtol=0, atol=1e-13)
        np.testing.assert_allclose(shares @ mode.beta[mode.leading], mode.beta[free], rtol=0, atol=1e-12)
        assert np.abs(shares).max(initial=0.0) < 10.0
    # none follows where all move by themselves
    assert list(contact_mode(SYSTEM, 0).leading) == list(range(len(SYSTEM.rest_gap)))


def test_contact_modes_are_listed_once_whoever_asks():
    """Eight threads ask at once for modes that none has listed yet."""
    rng, m = np.random.default_rng(5), 6
    system = LinearSystem(
        mass=np.eye(m),
        damping=np.zeros((m, m)),
        stiffness=np.diag(np.arange(1.0, m + 1.0)),
        normals=np.eye(m),
        rest_gap=np.ones(m),
        loads=np.zeros((m, 0)),
        weight=np.zeros((m, 2)),
    )
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        for _ in range(5):
            book = ModeBook(system, 2.0 ** -np.arange(8.0))
            masks = [int(mask) for mask in rng.permutation(2**m)]
            for mask in masks:
                book.require(mask)
            begin = Barrier(8)

            def listed(book: ModeBook = book, begin: Barrier = begin) -> list[int]:
                begin.wait()
                return [mode.mask for mode in book.modes]

            with ThreadPoolExecutor(8) as pool:
                found = [one.result() for one in [pool.submit(listed) for _ in range(8)]]
            assert all(one == masks for one in found)
            assert [mode.mask for mode in book.modes] == masks
    finally:
        sys.setswitchinterval(interval)


def test_an_impulse_displaces_no_foot_at_once():
    """Displacements and velocities were eliminated together in SI: an impulse of 1 N s displaced feet by 1e-10 m, and
    under a thin film a foot at rest moved."""
    system = lower_scene(moved(wide_scene(2), 1e-15, 2)).system
    mode = contact_mode(system, 0)
    at_once, slowest = np.abs(mode.outputs[: len(mode.mobility)] @ mode.beta.T), 5e4
    assert at_once.max() <= 1e-15 * mode.mobility.max() / slowest
