"""Searches of many valleys: strategies side by side, steps that get shorter."""

from __future__ import annotations

import numpy as np
import pytest

from tarsus.fit.valleys import Budget, Visited, follow_down, inside, shorter_steps


def _bowls(numbers, points):
    return np.where(numbers == 1, 0.0, 0.3) + ((points - 0.7) ** 2).sum(axis=1) * (1.0 + 30.0 * (points[:, 0] > 0.9))


def test_the_search_finds_the_better_of_two_families():
    visited, rng = Visited.empty(4), np.random.default_rng(0)
    follow_down(_bowls, visited, np.arange(6) % 2, rng.random((6, 4)), Budget(40, 8), rng)
    best = visited.best(3)
    assert visited.numbers[best[0]] == 1 and visited.costs[best[0]] < 1e-6
    assert np.allclose(visited.points[best[0]], 0.7, atol=1e-3)
    assert (
        len({(int(n), *np.round(x, 1)) for n, x in zip(visited.numbers[best], visited.points[best], strict=True)}) == 3
    )


def test_visited_points_are_kept_valley_by_valley():
    visited = Visited.empty(1)
    points = np.array([[0.1], [0.11], [0.5], [0.9]])
    visited.add(np.zeros(4, dtype=int), points, np.array([1.0, 0.9, 3.0, 2.0]))
    assert visited.best(3).tolist() == [1, 3, 2]


def test_steps_that_get_shorter_find_the_bottom_beside_every_start():
    starts = np.array([[0.3, 0.3], [0.9, 0.1]])
    bottoms = np.array([[0.35, 0.2], [0.02, 0.1]])

    def cost(points):
        off = np.abs(points - bottoms[:, None])
        return (np.where([False, True], off, np.minimum(off, 1.0 - off)) ** 2).sum(axis=2)

    circular = np.array([True, False])
    first = cost(starts[:, None])[:, 0]
    steps = [0.15 * 0.7**i for i in range(20)]
    found, costs = shorter_steps(cost, starts, first, steps, 8, np.random.default_rng(0), circular)
    assert found == pytest.approx(bottoms, abs=2e-3) and (costs < first).all()
    assert inside(np.array([[-0.1, 1.2]]), circular).tolist() == [[pytest.approx(0.9), pytest.approx(0.8)]]
