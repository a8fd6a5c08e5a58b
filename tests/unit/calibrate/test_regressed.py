"""Steps down by regressions over visited sets: where they lead, what they leave alone, what they save."""

from __future__ import annotations

import numpy as np
import pytest
from calibrate.toys import cells, problem, unknowns

from tarsus.calibrate.archive import Archive
from tarsus.calibrate.regressed import APART, PATIENCE, STEPS, Valleys, steps
from tarsus.calibrate.search import costs_at, evolve

BOTTOM = np.array([0.3, 0.6, 0.45])
SLOPES = np.array([[3.0, 1.0, 0.0], [0.0, 2.0, -1.0], [1.0, 0.0, 4.0], [1.0, 1.0, 1.0]])


def test_of_a_linear_model_a_step_ends_at_the_bottom_and_bounds_hold():
    rng = np.random.default_rng(1)
    points = np.concatenate([[[0.5, 0.4, 0.5]], rng.random((30, 3))])
    found = steps(points, (points - BOTTOM) @ SLOPES.T, 0, rng)
    assert found.shape == (len(STEPS), 3)
    assert np.linalg.norm(found - BOTTOM, axis=1).min() < 0.02
    points[0, 0] = 1.0
    beyond = steps(points, (points - BOTTOM - 2.0) @ SLOPES.T, 0, rng)
    assert (beyond[:, 0] == 1.0).all() and (beyond[:, 1:] > points[0, 1:]).all() and beyond.max() <= 1.0


def test_steps_begin_apart_and_not_where_they_no_longer_gain():
    points = np.array([[0.5, 0.5], [0.51, 0.5], [0.8, 0.8], [0.1, 0.9]])
    costs = np.array([1.0, 1.1, 2.0, 3.0])
    valleys = Valleys()
    assert valleys.bases(points, costs, 2) == [0, 2]
    for _ in range(PATIENCE):
        assert valleys.bases(points, costs, 1) == [0]
        valleys.tell(points[0], 1.0, 0.999)
    assert APART > 0.02 and valleys.bases(points, costs, 2) == [2, 3]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_search_of_seven_unknowns_is_at_the_bottom_before_evolution_alone_would_be(seed, monkeypatch):
    """A curved valley, of which a count that jumps is a part."""

    def bent(run: int, x: np.ndarray) -> np.ndarray:
        y = x - 0.4
        rows = [*(y[:-1] + y[1:] ** 2 + 0.3 * y[0]), y.sum(), np.round(8.0 * y[0]) / 8.0]
        return 2.0 + np.array(rows)[:, None, None]

    truth = bent(0, np.array([0.55, 0.35, 0.5, 0.3, 0.6, 0.45, 0.4]))[:, :, 0]
    ended = []
    for down in (True, False):
        if not down:
            monkeypatch.setattr("tarsus.calibrate.search.DOWN", 0.0)
            monkeypatch.setattr("tarsus.calibrate.regressed.Valleys.bases", lambda *_: [])
        one = problem(cells(truth), bent, unknowns("abcdefg"))
        archive = Archive(one)
        first = np.random.default_rng(seed).random((64, 7))
        archive.evaluate(0, first)
        evolve(one, archive, 0, first[:16], 15, np.random.default_rng(seed))
        ended.append(costs_at(one, archive, 0)[1].min())
        assert archive.simulated <= 64 + 15 * 16
    assert ended[0] < 0.2 * ended[1]
