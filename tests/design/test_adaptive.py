"""Adaptive gaits: the rule, what it is judged by, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.design.adaptive import _few, adapt
from tarsus.design.gait_choice import gait_choice
from tarsus.design.runs import Runs

FREE = {"gait.duty": None}
BOX = {"ground.friction.coefficient": (4.0, 12.0)}
SMALL = {"candidates": 64, "from_rest": 0.021, "hidden": 6, "training": 10, "steps": 2, "gaits": 2, "threads": 1}


def test_an_adaptive_gait_is_judged_on_grounds_of_its_own(tmp_path):
    scene = ts.load_scene("millipede-printed")
    found = adapt(scene, FREE, BOX, "charge,slip", **SMALL)
    assert found.senses == ("support", "touchdowns", "slip", "stride") and len(found.gaits) <= 2
    assert found.probe_steps == 2 and set(found.probes) <= set(range(len(found.gaits)))
    assert found.costs.shape == (6, len(found.gaits)) and found.chosen.max() < len(found.gaits)
    # no gait of the few beats the search for each ground, and no choice beats the best of the few
    assert (found.known <= found.costs.min(axis=1)).all()
    assert 0.0 <= found.choice_regret <= min(found.regret, found.fixed_regret)
    low, high = found.regret_interval
    assert low <= found.regret <= high
    friction = found.grounds.values["ground.friction.coefficient"]
    own = ts.with_values(scene, {**found.gaits[0], "ground.friction.coefficient": float(friction[2])})
    assert -found.costs[2, 0] == pytest.approx(ts.simulate(own, 0.021).measures["mean_speed"].value, rel=1e-5)
    table = found.to_dict()
    found.write(tmp_path)
    assert len((tmp_path / "hidden.csv").read_text().splitlines()) == 7
    assert [row["gait"] for row in table["table"]] == [gait for _, gait in found.rule]
    assert np.shape(table["posterior"]["costs"]) == (10, len(found.gaits))
    rows = found.table().rows
    assert sum(int(row[1].split()[0]) for row in rows) == 6 and len(rows) == len(found.gaits) and len(repr(found)) < 120


def test_luck_is_not_taken_for_knowledge_where_walks_ring(monkeypatch):
    """Walks whose speed is 1 for every gait on every ground, but for chance of half that size: nothing is lost by any
    rule, and yet the best of many single walks is half as fast again. Of settled motions every judgement has other
    starts."""

    def ring(self, points, grounds):
        place = 37.0 * grounds["ground.friction.coefficient"] + 1e7 * grounds.get("height", 0.0)
        digits = np.sin(1e5 * points[:, 0] + place) * 43758.5453
        return -(0.5 + np.remainder(digits, 1.0))[:, None]

    monkeypatch.setattr(Runs, "each", ring)
    scene, many = ts.load_scene("millipede-printed"), SMALL | {"hidden": 60}
    once = adapt(scene, FREE, BOX, "nothing", **many)
    often = adapt(scene, FREE, BOX, "nothing", starts=32, **many | {"from_rest": None})
    assert once.regret > 0.3 and "from rest, 21 ms" in str(once)
    (said,) = once.rule
    assert once.probes == () and said[0] == "always" and (once.chosen == said[1]).all()
    assert abs(often.regret) < 0.05 and often.to_dict()["starts"] == 32
    assert "settled motion, runs of 1 s from 32 starts" in str(often)


def felt(rng: np.random.Generator, senses: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Two sets of walks and the noisy second one, of what is sensed but for chance (np, ng, ns)."""
    one, two = (senses + 0.02 * rng.standard_normal(senses.shape) for _ in range(2))
    return one, two, two * (1.0 + 0.02 * rng.standard_normal(senses.shape))


def test_a_sense_that_tells_nothing_is_not_asked():
    """Two gaits of which chance says on every ground which is better: probes that feel something else are not walked,
    one that feels it is."""
    rng = np.random.default_rng(4)
    costs = np.stack([np.full(120, -1.0), -0.9 + 0.4 * rng.standard_normal(120)], axis=1)
    nothing = rng.random((2, 120, 2))
    probes, table = gait_choice(*felt(rng, nothing), costs, 2)
    assert probes == () and (table(np.zeros((5, 0))) == 0).all()
    telling = nothing.copy()
    telling[1, :, 0] = costs[:, 1] < costs[:, 0]
    probes, table = gait_choice(*felt(rng, telling), costs, 1)
    assert probes == (1,) and table.readings.shape == (120, 2)
    likely = np.stack([np.tile([0.0, 1.0], 20), rng.random(40)], axis=1)
    assert (table(likely) == np.tile([0, 1], 20)).mean() > 0.9


def test_a_second_probe_is_walked_where_one_does_not_tell():
    """Four kinds of ground and a gait for each; a probe tells two apart."""
    rng = np.random.default_rng(5)
    kinds = rng.integers(0, 4, 200)
    costs = 1.0 - np.eye(4)[kinds]
    senses = np.zeros((4, 200, 1))
    senses[1, :, 0], senses[2, :, 0] = kinds % 2, kinds // 2
    probes, table = gait_choice(*felt(rng, senses), costs, 4)
    assert set(probes[:2]) == {1, 2} and len(probes) == 2
    sure = np.stack([{1: np.arange(4) % 2, 2: np.arange(4) // 2}[one] for one in probes], axis=1).astype(float)
    assert table(sure).tolist() == [0, 1, 2, 3]
    assert np.abs(table.expected(sure) - (1.0 - np.eye(4))).max() < 1e-6
    assert table.shares.sum() == pytest.approx(1.0)


def test_gaits_are_sought_for_the_grounds_that_they_are_best_for(monkeypatch):
    """A walk is best where the duty is the ground's friction, scaled: two gaits cannot do better than the middles of
    two halves, and each moves there from where the even spread put it."""

    def match(self, rows, grounds):
        (friction,) = grounds.values()
        return np.abs((rows[:, 0] - 0.1) / 0.8 - (friction - 4.0) / 8.0)[:, None] - 1.0

    monkeypatch.setattr(Runs, "each", match)
    scene, few = (ts.load_scene("millipede-printed"), SMALL | {"candidates": 2000, "training": 128, "hidden": 60})
    found = adapt(scene, FREE, BOX, "nothing", **few)
    duty = sorted((gait["gait.duty"] - 0.1) / 0.8 for gait in found.gaits)
    assert duty == pytest.approx([0.25, 0.75], abs=0.06)
    assert found.choice_regret == pytest.approx(0.125, abs=0.03)


def test_a_bad_request_is_refused_whole():
    scene = ts.load_scene("millipede-printed")
    with pytest.raises(InputError) as refused:
        adapt(scene, ["gait.dutty"], BOX, "smell", steps=1, noise=2.0)
    said = " | ".join(refused.value.problems)
    assert len(refused.value.problems) == 3 and all(word in said for word in ("steps", "noise", "'smell'"))
    for given, word in (
        ({"over": None}, "name the grounds"),
        ({"objective": "energy"}, "for one objective that depends on it"),
        ({"sense": "nothing,slip"}, "'nothing' stands alone"),
        ({"free": ["gait.dutty"]}, "gait.dutty: the"),
    ):
        with pytest.raises(InputError, match=word):
            adapt(scene, **{"free": FREE, "over": BOX, **given})


def test_few_gaits_are_those_that_lose_least_together():
    costs = np.array([[0.0, 3.0, 1.0], [3.0, 0.0, 1.0], [0.0, 3.0, 1.0], [3.0, 0.0, 1.0]]) - 4.0
    assert _few(costs, 1) == [2]
    assert _few(costs, 3)[:2] in ([2, 0], [2, 1]) and sorted(_few(costs, 3)) == [0, 1, 2]
    assert _few(np.zeros((4, 3)), 3) == [0]
