"""Collocation nodes and their constant matrices."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest

from tarsus.core import nodes


def test_every_matrix_is_the_exact_one_of_its_nodes_to_the_last_bit():
    """No library's kernels: each entry is the double nearest to what rational numbers make of the nodes."""
    tau = [Fraction(t) for t in nodes.TAU]
    lagrange = []
    for j, own in enumerate(tau):
        line = [Fraction(1)]
        for other in tau[:j] + tau[j + 1 :]:
            line = [(a - other * b) / (own - other) for a, b in zip([0, *line], [*line, 0], strict=True)]
        lagrange.append(line)

    def values(places: list[Fraction], weights: list[Fraction] | None = None, shift: int = 0) -> np.ndarray:
        weights = weights or [Fraction(1)] * nodes.N
        terms = range(max(-shift, 0), nodes.N)
        return np.array(
            [[float(sum(p[n] * weights[n] * s ** (n + shift) for n in terms)) for p in lagrange] for s in places]
        )

    def equal(found: np.ndarray, exact: np.ndarray) -> None:
        np.testing.assert_array_equal(found, exact)

    powers = range(nodes.N)
    equal(nodes.MONOMIAL.T, [[float(c) for c in p] for p in lagrange])
    equal(nodes.TAIL, [float(p[-1] / 3432) for p in lagrange])  # 14 over 7
    equal(nodes.DERIVATIVE, values(tau, [Fraction(n) for n in powers], -1))
    equal(nodes.ONCE.T, values(tau, [Fraction(1, n + 1) for n in powers], 1))
    equal(nodes.TWICE.T, values(tau, [Fraction(1, (n + 1) * (n + 2)) for n in powers], 2))
    equal(nodes.LEFT, values([t / 2 for t in tau]))
    equal(nodes.RIGHT, values([(t + 1) / 2 for t in tau]))
    for t, partial in zip(tau, nodes.PARTIAL, strict=True):
        equal(partial, values([t * s for s in tau]))
    equal(nodes.interpolation(nodes.TAU), np.eye(nodes.N))
    assert pytest.approx(max(float(b - a) for a, b in pairwise(tau)), rel=1e-15) == nodes.SPACING
    equal(nodes.AT_GAUSS, values([Fraction(p) for p in nodes.GAUSS]))


def _nearest(points: np.ndarray, polynomial: Callable[[Fraction], Fraction]) -> bool:
    """Whether a polynomial changes sign within half a unit in the last place of doubles in [0.5, 1)."""
    half = Fraction(1, 2**54)
    return all(polynomial(Fraction(p) - half) * polynomial(Fraction(p) + half) <= 0 for p in points)


def test_nodes_and_gauss_points_are_the_doubles_nearest_to_the_zeros():
    def slope_of_p7(s: Fraction) -> Fraction:  # times 16 / 7
        x = (2 * s - 1) ** 2
        return ((429 * x - 495) * x + 135) * x - 5

    def p16(s: Fraction) -> Fraction:
        x, before, value = 2 * s - 1, Fraction(1), 2 * s - 1
        for d in range(2, 17):
            before, value = value, ((2 * d - 1) * x * value - (d - 1) * before) / d
        return value

    assert nodes.TAU[0] == 0.0 and not (nodes.TAU + nodes.TAU[::-1] - 1.0).any()
    assert _nearest(nodes.TAU[4:-1], slope_of_p7) and _nearest(nodes.GAUSS[8:], p16)
    np.testing.assert_allclose(nodes.GAUSS + nodes.GAUSS[::-1], 1.0, rtol=0, atol=1e-16)
    for power in range(32):
        assert nodes.GAUSS_WEIGHTS @ nodes.GAUSS**power == pytest.approx(1.0 / (power + 1.0), rel=1e-14)
