"""Random interpretations of what is not printed: their draws, and what is kept."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from reproduce.coarse_studies import overdamped, ringing
from tarsus.model.laws import AdhesiveFriction, Friction, PullAsPrinted, RestituteFirst
from tarsus_reproduce import interpretations
from tarsus_reproduce.interpretations import (
    CHOICES,
    UNPRINTED,
    Interpretations,
    drawn,
    interpretation_scene,
    interpretation_values,
    judged_interpretations,
    packaged_interpretations,
)
from tarsus_reproduce.millipede import COUNTS, Coarse, damping_ratio, stands
from tarsus_reproduce.packaged import data_text


@pytest.fixture
def short(monkeypatch):
    """Judged on few values of two periods."""
    monkeypatch.setattr(interpretations, "COARSE", Coarse(4, (0.5,)))
    monkeypatch.setattr(interpretations, "PERIODS", 2)


def test_an_interpretation_is_the_same_whatever_the_count_and_fills_its_ranges():
    assert (drawn(3, 7) == drawn(3, 7)).all() and (drawn(3, 7) != drawn(4, 7)).all()
    scene = overdamped()
    values = [interpretation_values(scene, drawn(1, number)) for number in range(400)]
    for one in UNPRINTED:
        column = np.array([value[one.name] for value in values])
        assert one.low <= column.min() and column.max() <= one.high
        middle, width = np.log(one.low * one.high) / 2.0, np.log(one.high / one.low)
        assert np.median(np.log(column)) == pytest.approx(middle, abs=0.1 * width)
    for one in CHOICES:
        assert {value[one["name"]] for value in values} == set(one["options"])


def test_an_interpretation_becomes_the_scene_it_says():
    base = overdamped()
    words = {"start": "standing", "film reading": "nN m^2 s", "landing": RestituteFirst.title}
    own = interpretation_values(base, drawn(1, 0))
    values = {**own, **words, "vertical damping ratio": 0.07, "friction bound": "µ f_a"}
    scene = interpretation_scene(base, values)
    assert damping_ratio(scene) == pytest.approx(0.07) and stands(scene)
    assert scene.ground.film.coefficient == pytest.approx(1.747e-24)
    assert scene.ground.restitution.coefficient == 0.378  # printed, never drawn
    assert scene.ground.landing == RestituteFirst(speed=values["speed that may be held"])
    assert scene.ground.friction == AdhesiveFriction(coefficient=values["friction by adhesion alone"])
    words = {"landing": PullAsPrinted.title, "friction bound": "µ (N + f_a)", "start": "relaxed"}
    other = interpretation_scene(base, {**values, **words})
    assert other.ground.landing == PullAsPrinted() and not stands(other)
    assert other.ground.friction == Friction(coefficient=values["friction"])
    weights = scene.robot.drives["L1"].load.weights
    assert weights["L1_hip_x"] == pytest.approx(values["lateral over vertical force"]) == -weights["L1_x"]
    with pytest.raises(ts.InputError, match="is a walker"):
        interpretation_scene(ts.load_scene("cantilever"), values)


def test_finished_interpretations_are_kept_and_a_damaged_one_is_judged_again(short, tmp_path, monkeypatch):
    base, judged = overdamped(), []
    judge = interpretations._score
    monkeypatch.setattr(interpretations, "_score", lambda *one: judged.append(1) or judge(*one))
    first = judged_interpretations(base, 3, 1, folder=tmp_path, threads=1)
    assert len(judged) == 3 and all(sum([*score.values()][:4]) == 16 for score in first.judged)
    units = sorted((tmp_path / "interpretations" / "units").rglob("*.npz"))
    assert len(units) == 3
    units[0].write_bytes(units[0].read_bytes()[:100])  # a disk that lost its end
    again = judged_interpretations(base, 4, 1, folder=tmp_path, threads=1)
    assert len(judged) == 3 + 2 and again.scores[:3] == first.scores
    assert judged_interpretations(base, 2, 2, folder=tmp_path, threads=1) != first and len(judged) == 7
    with pytest.raises(ts.InputError, match="holds another"):
        judged_interpretations(ringing(), 1, 1, folder=tmp_path)


def test_counts_become_a_distribution_of_those_that_could_be_judged():
    rows = (1, 2, 3, 10, 0, 11), None, (3, 2, 1, 10, 2, 11), (5, 2, 9, 0, 1, 11)
    scores = tuple(one and dict(zip(COUNTS, one, strict=True)) for one in rows)
    table = Interpretations(7, scores).to_dict()
    assert (table["seed"], table["count"], table["judged"]) == (7, 4, 3)
    assert (table["agree"]["mean"], table["agree"]["histogram"]) == (3.0, [0, 1, 0, 1, 0, 1])
    assert (table["contradict"]["quantile_95"], table["not_determined"]["median"]) == (2.0, 10.0)
    assert "agree" not in Interpretations(7, (None,)).to_dict()


def test_the_packaged_interpretations_are_those_of_the_ranges():
    found = packaged_interpretations()
    assert found.seed == 1 and len(found.judged) == 500
    assert {sum([*score.values()][:4]) for score in found.judged} == {16}
    assert f"of the ranges {interpretations._digest()}" in data_text(interpretations.FILE), "judge them again"


@pytest.mark.slow
def test_a_packaged_interpretation_is_judged_the_same_again():
    (found,) = judged_interpretations(ts.load_scene("millipede"), 1, 1).scores
    assert found == packaged_interpretations().scores[0]
