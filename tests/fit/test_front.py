"""Fronts of costs: which are on them, what they dominate, and that the search finds a known one."""

from __future__ import annotations

import numpy as np
import pytest

from tarsus.fit.front import FrontSearch, crowding, farthest, hypervolume, ranks, search_front, undominated


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
