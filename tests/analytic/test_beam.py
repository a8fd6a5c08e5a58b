"""The beam against an independent finite-element beam, and against textbook wave numbers."""

import math

import numpy as np
import pytest
from scipy.linalg import eigh

from tarsus.model.structure import Beam
from tarsus.model.structure.cantilever import RigidTip

ELEMENTS = 60


def finite_elements(
    length: float, stiffness: float, mass_per_length: float, tip: RigidTip
) -> tuple[np.ndarray, np.ndarray]:
    """Mass and stiffness of Hermite elements, (deflection, slope) of each node, clamped node removed."""
    h = length / ELEMENTS
    points, weights = np.polynomial.legendre.leggauss(4)
    s = 0.5 * (points + 1.0)
    shapes = np.array([1 - 3 * s**2 + 2 * s**3, h * (s - 2 * s**2 + s**3), 3 * s**2 - 2 * s**3, h * (s**3 - s**2)])
    bends = np.array([12 * s - 6, h * (6 * s - 4), 6 - 12 * s, h * (6 * s - 2)]) / h**2
    m = mass_per_length * 0.5 * h * (shapes * weights) @ shapes.T
    k = stiffness * 0.5 * h * (bends * weights) @ bends.T
    size = 2 * (ELEMENTS + 1)
    mass, stiff = np.zeros((size, size)), np.zeros((size, size))
    for e in range(ELEMENTS):
        at = slice(2 * e, 2 * e + 4)
        mass[at, at] += m
        stiff[at, at] += k
    arm = np.array([1.0, tip.offset])
    mass[-2:, -2:] += tip.mass * np.outer(arm, arm) + np.diag([0.0, tip.inertia])
    return mass[2:, 2:], stiff[2:, 2:]


@pytest.mark.parametrize("second", [6424.0, 4500.0, 10000.0])
def test_beam_against_finite_elements(second: float) -> None:
    beam = Beam(
        frequencies=(623.0, second),
        damping_ratios=(0.02,) * 4,
        length=750e-6,
        tip_length=150e-6,
        tip_width=100e-6,
        tip_thickness=10e-6,
        tip_density=2330.0,
    )
    stiffness, mass_per_length = beam.section()
    mass, stiff = finite_elements(beam.length, stiffness, mass_per_length, beam.tip)
    values, vectors = eigh(stiff, mass, subset_by_index=[0, 3])
    modes = beam.modes()
    frequencies = np.sqrt(values) / (2 * math.pi)
    np.testing.assert_allclose(frequencies[:2], [623.0, second], rtol=5e-6)
    np.testing.assert_allclose(modes.omega, np.sqrt(values), rtol=1e-5)

    vectors = vectors * math.sqrt(modes.mass)
    arm = np.array([1.0, beam.tip.offset])
    tip = arm @ vectors[-2:]
    vectors = vectors * np.sign(tip)
    np.testing.assert_allclose(beam.row("tip"), np.abs(tip), rtol=1e-4)
    np.testing.assert_allclose(beam.row("center"), vectors[ELEMENTS - 2], rtol=1e-4)
    np.testing.assert_allclose(beam.moment_participation(), vectors[-1], rtol=1e-4)

    nodes = mass_per_length * beam.length / ELEMENTS
    deflections = np.vstack([np.zeros(4), vectors[::2]])
    slopes = np.vstack([np.zeros(4), vectors[1::2]])
    h = beam.length / ELEMENTS
    area = nodes * ((deflections[1:] + deflections[:-1]) / 2 + h * (slopes[:-1] - slopes[1:]) / 12).sum(axis=0)
    weight = area + beam.tip.mass * (arm @ vectors[-2:])
    np.testing.assert_allclose(modes.mass * beam.vertical(), weight, rtol=1e-4)

    load = np.zeros(len(stiff))
    load[-2:] = arm
    compliance = load @ np.linalg.solve(stiff, load)
    assert beam.static_compliance() == pytest.approx(compliance, rel=1e-6)
