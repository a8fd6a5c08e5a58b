"""Contact modes and their step tables against the plain equations of motion."""

from __future__ import annotations

import numpy as np

from divergence import moved
from random_scenes import wide_scene
from tarsus.core.modes import LinearSystem, contact_mode
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


def test_an_impulse_displaces_no_foot_at_once():
    """Displacements and velocities were eliminated together in SI: an impulse of 1 N s displaced feet by 1e-10 m, and
    under a thin film a foot at rest moved."""
    system = lower_scene(moved(wide_scene(2), 1e-15, 2)).system
    mode = contact_mode(system, 0)
    at_once, slowest = np.abs(mode.outputs[: len(mode.mobility)] @ mode.beta.T), 5e4
    assert at_once.max() <= 1e-15 * mode.mobility.max() / slowest
