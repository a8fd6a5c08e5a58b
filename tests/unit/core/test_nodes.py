"""Collocation nodes and their constant matrices."""

from __future__ import annotations

import numpy as np
import pytest

from tarsus.core import nodes

POLYNOMIAL = np.polynomial.Polynomial([0.3, -1.0, 2.0, 0.5, -0.7, 0.1, 1.3, -0.4])  # degree 7


def test_nodes_are_symmetric_and_integrate_like_lobatto():
    assert nodes.TAU[0] == 0.0 and nodes.TAU[-1] == 1.0
    np.testing.assert_array_equal(nodes.TAU + nodes.TAU[::-1], 1.0)
    assert np.diff(nodes.TAU).max() == pytest.approx(nodes.SPACING, rel=1e-15)
    # Abramowitz and Stegun, table 25.6, n = 8: 0.2092992179, 0.5917001814, 0.8717401485
    np.testing.assert_allclose(2 * nodes.TAU[4:7] - 1, [0.2092992179, 0.5917001814, 0.8717401485], atol=1e-10)


def test_matrices_are_exact_for_degree_seven():
    values = POLYNOMIAL(nodes.TAU)
    np.testing.assert_allclose(nodes.MONOMIAL @ values, POLYNOMIAL.coef, atol=1e-10)
    np.testing.assert_allclose(nodes.DERIVATIVE @ values, POLYNOMIAL.deriv()(nodes.TAU), atol=1e-10)
    np.testing.assert_allclose(nodes.LEFT @ values, POLYNOMIAL(0.5 * nodes.TAU), atol=1e-14)
    np.testing.assert_allclose(nodes.RIGHT @ values, POLYNOMIAL(0.5 + 0.5 * nodes.TAU), atol=1e-14)
    for t, matrix in zip(nodes.TAU, nodes.PARTIAL, strict=True):
        np.testing.assert_allclose(matrix @ values, POLYNOMIAL(t * nodes.TAU), atol=1e-13)


def test_tail_is_the_highest_legendre_coefficient():
    legendre = np.polynomial.Legendre([1.0, 0, 3.0, 0, 0, 0, 2.0, 0.25], domain=[0.0, 1.0])
    assert nodes.TAIL @ legendre(nodes.TAU) == pytest.approx(0.25, rel=1e-12)


def test_interpolation_at_a_node_is_its_value():
    np.testing.assert_array_equal(nodes.interpolation(nodes.TAU), np.eye(nodes.N))
