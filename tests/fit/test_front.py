"""Searches of many valleys, and of fronts of costs."""

from __future__ import annotations

import numpy as np
import pytest

from tarsus.fit.front import FrontSearch, crowding, farthest, hypervolume, ranks, search_front, undominated
from tarsus.fit.valleys import Budget, Visited, follow_down, inside, shorter_steps


def test_undominated_keeps_the_first_of_equals_and_leaves_out_what_is_beaten_or_has_no_value():
    costs = np.array([[1.0, 3.0], [2.0, 2.0], [2.0, 2.0], [3.0, 3.0], [0.5, np.inf], [3.0, 1.0]])
    assert np.flatnonzero(undominated(costs)).tolist() == [0, 1, 5]


def test_hypervolume_is_that_of_boxes():
    assert hypervolume(np.array([[0.0, 0.5], [0.5, 0.0]]), np.ones(2)) == pytest.approx(0.75)
    assert hypervolume(np.array([[0.0, 0.0, 0.0], [0.5, -1.0, 0.0]]), np.ones(3)) == pytest.approx(1.5)
    assert hypervolume(np.array([[0.0, 2.0]]), np.ones(2)) == 0.0
    rng = np.random.default_rng(3)
    costs = rng.random((12, 3))
    samples = rng.random((40_000, 3))
    covered = (costs[:, None] <= samples[None]).all(axis=2).any(axis=0).mean()
    assert hypervolume(costs, np.ones(3)) == pytest.approx(covered, abs=0.01)  # 4 standard errors of the sampling


def test_ranks_peel_front_after_front():
    costs = np.array([[0.0, 1.0], [1.0, 0.0], [1.0, 1.0], [2.0, 2.0], [np.inf, 0.0]])
    assert ranks(costs).tolist() == [0, 0, 1, 2, 3]
    assert np.isinf(crowding(costs[:2])).all()


def test_the_search_finds_a_front_that_is_known():
    """Zitzler, Deb and Thiele's first function: f2 = 1 - sqrt(f1) where the other unknowns are 0."""

    def costs(points):
        spread = 1.0 + 9.0 * points[:, 1:].mean(axis=1)
        return np.stack([points[:, 0], spread * (1.0 - np.sqrt(points[:, 0] / spread))], axis=1)

    search = FrontSearch(scan=512, population=64, generations=60)
    points, found = search_front(costs, 4, np.zeros(4, dtype=bool), search, seed=1)
    exact = 0.1 * 1.1 + 1.0 * 0.1 + 2.0 / 3.0  # beyond 1, above 1, and the area over 1 - sqrt(x)
    assert len(points) == search.candidates
    assert hypervolume(found, np.full(2, 1.1)) > 0.98 * exact


def test_the_search_goes_around_where_a_range_closes_on_itself():
    """The best phase is 0, which is 1 too: both sides of it are met, and nothing leaves the unit cube."""
    seen = []

    def costs(points):
        seen.append(points)
        return 1.0 - np.cos(2.0 * np.pi * points[:, :1])

    search_front(costs, 1, np.array([True]), FrontSearch(scan=8, population=16, generations=12), seed=2)
    last = np.concatenate(seen[-3:])[:, 0]
    assert np.concatenate(seen).min() >= 0.0 and np.concatenate(seen).max() <= 1.0
    assert (last < 0.1).any() and (last > 0.9).any()


def test_the_farthest_points_are_spread_and_a_circle_has_no_end():
    line = np.linspace(0.0, 1.0, 101)[:, None]
    assert sorted(farthest(line, np.array([False]), 3).tolist()) == [0, 50, 100]
    assert farthest(line, np.array([True]), 2).tolist() == [0, 50]
    assert farthest(np.zeros((4, 2)), np.array([False, True]), 3).tolist() == [0]


def _bowls(numbers, points):
    return np.where(numbers == 1, 0.0, 0.3) + ((points - 0.7) ** 2).sum(axis=1) * (1.0 + 30.0 * (points[:, 0] > 0.9))


def test_the_search_finds_the_better_of_two_families():
    visited, rng = Visited.empty(4), np.random.default_rng(0)
    follow_down(_bowls, visited, np.arange(6) % 2, rng.random((6, 4)), Budget(45, 8), rng)
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


def test_a_strategy_learns_the_shape_of_a_long_valley():
    """An ellipsoid whose axes differ a hundredfold: a strategy that does not learn them is at 1e-3 after as long."""
    steep = 100.0 ** (np.arange(5) / 4.0)
    visited = Visited.empty(5)
    visited = Visited.empty(5)
    follow_down(
        lambda numbers, points: (((points - 0.6) * steep) ** 2).sum(axis=1),
        visited,
        np.arange(4),
        np.full((4, 5), 0.3),
        Budget(150, 10),
        np.random.default_rng(0),
    )
    assert visited.costs.min() < 1e-4
