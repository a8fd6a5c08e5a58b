"""Adaptive gaits: the rule, what it is judged by, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.design.adaptive import Sense, _Adapter, _few, adapt, senses_of
from tarsus.design.gait_files import adapt_table, write_adapt
from tarsus.design.rules import Rule, grown
from tarsus.design.walks import Walks

FREE = {"gait.duty": None}
BOX = {"ground.friction.coefficient": (4.0, 12.0)}
SMALL = {
    "candidates": 64,
    "duration": 0.02,
    "hidden": 6,
    "training": 10,
    "steps": 2,
    "gaits": 2,
    "threads": 1,
}


def test_an_adaptive_gait_is_judged_on_grounds_of_its_own(tmp_path):
    scene = ts.load_scene("millipede-printed")
    found = adapt(scene, FREE, BOX, "charge,slip", **SMALL)
    assert (
        found.senses == ("support", "touchdowns", "slip", "stride")
        and 0 <= found.probe < len(found.gaits) <= 2
    )
    assert found.costs.shape == (6, len(found.gaits)) and found.chosen.max() < len(found.gaits)
    # no gait of the few beats the search for each ground, and no choice beats the best of the few
    assert (found.known <= found.costs.min(axis=1)).all()
    assert 0.0 <= found.choice_regret <= min(found.regret, found.fixed_regret)
    friction = found.grounds["ground.friction.coefficient"]
    own = ts.with_values(scene, {**found.gaits[0], "ground.friction.coefficient": float(friction[2])})
    assert -found.costs[2, 0] == pytest.approx(ts.simulate(own, 0.02).measures["mean_speed"].value, rel=1e-5)
    table = adapt_table(found)
    write_adapt(found, tmp_path)
    assert len((tmp_path / "hidden.csv").read_text().splitlines()) == 7
    assert [row["gait"] for row in table["table"]] == [gait for _, gait in found.table]
    page = found._repr_html_()
    assert page.count("<tr>") == 1 + len(found.gaits) and "of 6</td>" in page and len(repr(found)) < 120


def test_without_senses_there_is_one_gait():
    found = adapt(ts.load_scene("millipede-printed"), FREE, BOX, "nothing", **SMALL)
    assert found.rule.leaves == 1 and found.table == [("always", found.probe)]


def test_luck_is_not_taken_for_knowledge_where_walks_ring(monkeypatch):
    """Walks whose speed is 1 for every gait on every ground, but for chance of half that size: nothing is lost by any
    rule, and yet the best of many single walks is twice as fast."""

    def ring(self, points, grounds):
        (friction,) = grounds.values()
        digits = np.sin(1e5 * points[:, 0] + 37.0 * friction) * 43758.5453
        return -(0.5 + np.remainder(digits, 1.0))[:, None]

    monkeypatch.setattr(Walks, "each", ring)
    scene, many = ts.load_scene("millipede-printed"), SMALL | {"hidden": 60}
    once = adapt(scene, FREE, BOX, "nothing", **many)
    often = adapt(scene, FREE, BOX, "nothing", repeats=32, **many)
    assert once.regret > 0.3
    assert abs(often.regret) < 0.05 and often.repeats == 32
    assert adapt_table(often)["repeats"] == 32


def test_a_sense_that_tells_nothing_is_not_asked():
    """Two gaits that differ by chance from ground to ground: a rule fits the training grounds and nothing else."""
    scene = ts.load_scene("millipede-printed")
    request = adapt(scene, FREE, BOX, "slip", **SMALL).request
    adapter = _Adapter(request, (Sense.SLIP,), 0.02, 1, lambda done, total, what: None)
    rng = np.random.default_rng(4)
    costs = np.stack([-1.0 + 0.0 * rng.random(60), -0.9 + 0.4 * rng.standard_normal(60)], axis=1)
    telling = np.where(costs[:, 1] < costs[:, 0], 2.0, 1.0)[:, None]
    nothing = [rng.random((60, 2)), rng.random((60, 2))]
    assert grown(nothing[0], costs, 3).leaves > 1
    assert adapter._rule(nothing, costs)[1] == Rule(0)
    probe, rule = adapter._rule([nothing[0], np.hstack([nothing[1], telling])], costs)
    assert probe == 1 and rule.leaves >= 2 and rule.sense == 2


def test_few_gaits_are_those_that_lose_least_together():
    costs = np.array([[0.0, 3.0, 1.0], [3.0, 0.0, 1.0], [0.0, 3.0, 1.0], [3.0, 0.0, 1.0]]) - 4.0
    assert _few(costs, 1) == [2]
    assert _few(costs, 3)[:2] in ([2, 0], [2, 1]) and sorted(_few(costs, 3)) == [0, 1, 2]
    assert _few(np.zeros((4, 3)), 3) == [0]


def test_a_bad_request_is_told_whole():
    scene = ts.load_scene("millipede-printed")
    with pytest.raises(InputError) as told:
        adapt(scene, ["gait.dutty"], BOX, "smell", steps=1, noise=2.0)
    said = " | ".join(told.value.problems)
    assert len(told.value.problems) == 4
    for words in (
        "steps: expected at least 2",
        "noise: expected a share",
        "sense: there is none called 'smell'",
        "gait.dutty: is no",
    ):
        assert words in said
    with pytest.raises(InputError, match="say the grounds"):
        adapt(scene, FREE, None)
    with pytest.raises(InputError, match="for one objective that depends on it"):
        adapt(scene, FREE, BOX, objective="energy")
    with pytest.raises(InputError, match="'nothing' stands alone"):
        senses_of("nothing,slip")
    assert senses_of("slip") == (Sense.SLIP,)
