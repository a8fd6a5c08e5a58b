"""Rules from senses to actions lose as little as they can."""

from __future__ import annotations

import numpy as np

from tarsus.design.rules import Rule, grown


def test_a_rule_finds_the_threshold_that_decides():
    rng = np.random.default_rng(1)
    senses = rng.random((400, 2))
    right = (senses[:, 1] >= 0.5).astype(int)
    costs = np.ones((400, 3))
    costs[np.arange(400), right] = 0.0
    rule = grown(senses, costs, 2)
    assert costs[np.arange(400), rule(senses)].mean() < 0.06  # thresholds lie on sixteenths of the values
    assert rule.sense == 1 and abs(rule.threshold - 0.5) < 0.06
    (low, below), (high, above) = rule.lines(("one", "two"))[0], rule.lines(("one", "two"))[-1]
    assert low.startswith("two < ") and high.startswith("two >= ") and (below, above) == (0, 1)


def test_a_rule_asks_nothing_where_nothing_tells():
    rng = np.random.default_rng(2)
    costs = np.tile([1.0, 0.9], (300, 1))
    assert grown(rng.random((300, 2)), costs, 3) == Rule(1)
    assert grown(np.zeros((300, 0)), costs, 3) == Rule(1)
