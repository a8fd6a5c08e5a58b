"""Numbers that carry derivatives: what numpy makes of them against differences."""

from __future__ import annotations

import numpy as np
import pytest

from differences import AROUND, slope
from tarsus.base.dual import Dual, alike, columns, dot, slope_of, value_of

BASE = np.random.default_rng(1).uniform(0.5, 2.0, (4, 3))
WAYS = np.random.default_rng(2).uniform(-1.0, 1.0, (4, 3, 2))
FUNCTIONS = {
    "sums and products": lambda a: 3.0 - a * a + a / (1.0 + a[:, :1]) - 2.0 * -a,
    "roots and sines": lambda a: np.sqrt(a) * np.sin(2.0 * a) + np.square(a),
    "larger, smaller, size": lambda a: np.maximum(a, 1.1) + np.minimum(a, a[:, ::-1]) * np.abs(a - 1.3),
    "turns": lambda a: np.remainder(7.0 * a, 2.0),
    "choices": lambda a: np.where(a > 1.0, a * a, 0.5 * a) + np.where(BASE > 1.2, 1.0, a),
    "put together": lambda a: np.concatenate([a, np.ones((4, 1)), np.roll(a, 1, axis=1)], axis=1),
    "side by side": lambda a: (
        np.stack([a[:, 0], np.zeros(4), a[:, 2]], axis=-1) * columns([a[:, 1], 2.0, 3.0])
    ),
    "summed up": lambda a: np.cumsum(a, axis=1) + dot(a, a[:, ::-1])[:, None],
    "repeated": lambda a: np.repeat(a[:, 0], [1, 2, 0, 3]) * np.broadcast_to(a[0, 1], 6),
    "pieces": lambda a: a[np.array([2, 0]), np.array([1, 1])] + a[BASE > 0.0].reshape(4, 3)[..., 0][:2],
    "of every run": lambda a: np.stack(alike(a[:, 0], 2.0, a[:, 1])),
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_derivatives_follow(name):
    function = FUNCTIONS[name]
    found = function(Dual(BASE, WAYS))
    np.testing.assert_array_equal(value_of(found), function(BASE))
    for p in range(2):
        step = 1e-4 * WAYS[..., p]
        wanted = slope([function(BASE + k * step) for k in AROUND], 1e-4)
        np.testing.assert_allclose(slope_of(found, 2)[..., p], wanted, rtol=1e-8, atol=1e-9)


def test_orders_are_those_of_values_and_equal_is_what_moves_alike():
    still, moves = Dual(np.ones(2), np.zeros((2, 1))), Dual(np.ones(2), np.array([[0.0], [1.0]]))
    assert (still == moves).tolist() == [True, False] and (still != 1.0).tolist() == [False, False]
    assert (moves != 1.0).tolist() == [False, True] and not (moves < still).any()
    assert np.sign(moves - 2.0).tolist() == [-1.0, -1.0]


def test_what_is_not_chosen_has_no_part_even_where_it_is_infinite():
    with np.errstate(divide="ignore", invalid="ignore"):
        zero = Dual(np.zeros(2), np.array([[1.0], [0.0]]))
        found = np.where(zero == 0.0, 2.0, np.sqrt(zero) / zero)
    assert value_of(found)[1] == 2.0 and slope_of(found, 1)[1, 0] == 0.0
