"""The descent by slopes to the lowest point of a cost of many smooth pieces."""

from __future__ import annotations

import numpy as np
import pytest

from tarsus.fit.minimax import CostPieces, descend_pieces


def _kinked(point):
    """Pieces of max(|x - 0.4|, |y - 0.7| + 0.1, 0.3 (x + y)) about a point, on two grounds."""
    x, y = point
    values = np.array([x - 0.4, 0.4 - x, y - 0.6, 0.8 - y, 0.3 * (x + y)])
    slopes = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0], [0.3, 0.3]])
    return CostPieces(values, slopes, np.array([0, 0, 0, 0, 1]))


def _cost_of_kinks(points):
    return np.array([_kinked(one).values.max() for one in points])


def test_polishing_ends_in_the_kink_where_the_pieces_meet():
    # the lowest point of the largest piece: 0.4 - x = 0.8 - y = 0.3 (x + y) gives x = 0.4 - 0.36 / 1.6, y = x + 0.4
    point, least, asked = descend_pieces(_cost_of_kinks, _kinked, np.array([0.9, 0.2]), 30)
    x = 0.4 - 0.36 / 1.6
    assert least == pytest.approx(0.225, abs=1e-6) and asked < 30
    assert point == pytest.approx([x, x + 0.4], abs=1e-5)


def test_polishing_by_a_mean_over_grounds_is_not_that_by_the_worst():
    weights = np.array([0.9, 0.1])

    def cost(points):
        pieces = [_kinked(one).values for one in points]
        return np.array([0.9 * one[:4].max() + 0.1 * one[4] for one in pieces])

    point, least, _ = descend_pieces(cost, _kinked, np.array([0.9, 0.2]), 40, 1.0, weights)
    xs = np.linspace(0.0, 1.0, 101)
    grid = np.array([[x, y] for x in xs for y in xs])
    assert least <= cost(grid).min() + 1e-6 and cost(point[None])[0] == least


def test_polishing_never_ends_above_its_start_whatever_the_slopes_are():
    def wrong(point):
        right = _kinked(point)
        return CostPieces(right.values, -right.slopes, right.ground)

    start = np.array([0.3, 0.6])
    point, least, _ = descend_pieces(_cost_of_kinks, wrong, start, 10)
    assert least <= _cost_of_kinks(start[None])[0] and _cost_of_kinks(point[None])[0] == least
    nothing = CostPieces(np.zeros(0), np.zeros((0, 2)), np.zeros(0, dtype=np.int64), False)
    assert descend_pieces(_cost_of_kinks, lambda _: nothing, start, 10)[2] == 1
