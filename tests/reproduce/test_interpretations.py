"""Random interpretations of what is not printed: their draws, the packaged ones, and the script that makes them."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from reproduce.coarse_studies import INTERPRETATIONS, overdamped
from tarsus.model.laws import AdhesiveFriction, Friction, PullAsPrinted, RestituteFirst
from tarsus_reproduce.interpretations import CHOICES, FILE, UNPRINTED, distribution, packaged_interpretations
from tarsus_reproduce.millipede import COUNTS, damping_ratio, stands
from tarsus_reproduce.packaged import data_text

drawn, interpretation_values = INTERPRETATIONS.drawn, INTERPRETATIONS.interpretation_values
interpretation_scene = INTERPRETATIONS.interpretation_scene


def test_an_interpretation_is_the_same_whatever_the_count_and_fills_its_ranges():
    assert (drawn(7, 3) == drawn(7, 3)).all() and (drawn(7, 3) != drawn(7, 4)).all()
    scene = overdamped()
    values = [interpretation_values(scene, drawn(number)) for number in range(400)]
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
    own = interpretation_values(base, drawn(0))
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


def test_counts_become_a_distribution():
    rows = (1, 2, 3, 10, 0, 11), (3, 2, 1, 10, 2, 11), (5, 2, 9, 0, 1, 11)
    found = distribution([dict(zip(COUNTS, one, strict=True)) for one in rows])
    assert found["agree"] == {"mean": 3.0, "quantile_95": pytest.approx(4.8)}
    assert list(found) == list(COUNTS[:-1])


def test_the_packaged_interpretations_are_those_of_the_ranges():
    found = packaged_interpretations()
    assert len(found) == 500 and {sum([*score.values()][:4]) for score in found} == {16}
    assert f"of the ranges {INTERPRETATIONS.digest()}" in data_text(FILE).splitlines()[0], "judge them again"


@pytest.mark.slow
def test_a_packaged_interpretation_is_judged_the_same_again():
    assert INTERPRETATIONS.judged(ts.load_scene("millipede"), 0) == packaged_interpretations()[0]
