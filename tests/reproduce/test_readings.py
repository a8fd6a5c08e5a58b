"""Random readings of what is not printed: their draws, what is kept, and devices that scatter."""

from __future__ import annotations

import json

import numpy as np
import pytest

import tarsus as ts
from reproduce.coarse_studies import overdamped, ringing
from tarsus.base.spec import get_value
from tarsus.model.laws import AdhesiveFriction, Friction, PullAsPrinted, RestituteFirst
from tarsus_reproduce import readings, scatter
from tarsus_reproduce.millipede import Coarse, Score, damping_ratio, stands
from tarsus_reproduce.packaged_readings import packaged_readings, parse_readings, readings_text
from tarsus_reproduce.readings import (
    CHOICES,
    RANGES,
    drawn,
    random_readings,
    reading_scene,
)
from tarsus_reproduce.scatter import scatter_scores, scatter_table, scattered


@pytest.fixture
def quick(monkeypatch):
    """Readings that are drawn and built, but scored by their numbers alone; the numbers that were run."""
    ran = []

    def judge(name, scene, **options):
        ran.append(float(scene.robot.structure.body.mass))
        score = Score(len(ran) % 5, 1, 10, 5 - len(ran) % 5, 0, 11)
        return type("Outcome", (), {"score": score})

    monkeypatch.setattr(readings, "judge_scene", judge)
    monkeypatch.setattr(scatter, "judge_scene", judge)
    return ran


def test_a_reading_is_the_same_whatever_the_count_and_fills_its_ranges():
    assert drawn(3, 7) == drawn(3, 7) != drawn(4, 7)
    values = [drawn(1, number) for number in range(400)]
    for one in RANGES:
        column = np.array([value[one.name] for value in values])
        assert one.low <= column.min() and column.max() <= one.high
        assert np.median(np.log(column)) == pytest.approx(
            np.log(one.low * one.high) / 2.0, abs=0.1 * np.log(one.high / one.low)
        )
    for one in CHOICES:
        assert {value[one.name] for value in values} == set(one.options)


def test_a_reading_becomes_the_scene_it_says():
    words = {"start": "standing", "film reading": "nN m^2 s", "landing": RestituteFirst.title}
    values = {**drawn(1, 0), **words, "vertical damping ratio": 0.07, "friction bound": "µ f_a"}
    scene = reading_scene(overdamped(), values)
    assert damping_ratio(scene) == pytest.approx(0.07) and stands(scene)
    assert scene.ground.film.coefficient == pytest.approx(1.747e-24)
    assert scene.ground.restitution.coefficient == 0.378  # printed, never drawn
    assert scene.ground.landing == RestituteFirst(speed=values["speed that may be held"])
    assert scene.ground.friction == AdhesiveFriction(coefficient=values["friction by adhesion alone"])
    other = reading_scene(
        overdamped(), {**values, "landing": PullAsPrinted.title, "friction bound": "µ (N + f_a)"}
    )
    assert other.ground.landing == PullAsPrinted()
    assert other.ground.friction == Friction(coefficient=values["friction"])
    weights = scene.robot.drives["L1"].load.weights
    assert weights["L1_hip_x"] == pytest.approx(values["lateral over vertical force"]) == -weights["L1_x"]
    assert not stands(reading_scene(overdamped(), {**values, "start": "relaxed"}))
    with pytest.raises(ts.InputError, match="which is a walker"):
        reading_scene(ts.load_scene("cantilever"), values)


def test_finished_readings_are_kept_and_a_cut_line_is_run_again(quick, tmp_path):
    file = tmp_path / "readings.jsonl"
    base = overdamped()
    first = random_readings(base, 4, 1, file=file)
    assert len(quick) == 4 and [one.number for one in first.readings] == [0, 1, 2, 3]
    text = file.read_text()
    file.write_text(text[: text.rindex('"number"')])  # killed while it wrote the last line
    again = random_readings(base, 6, 1, file=file)
    assert len(quick) == 7
    kept = {one.number for one in again.readings if one.score in [old.score for old in first.readings]}
    assert len(kept) >= 3 and len(file.read_text().splitlines()) == 6
    random_readings(base, 2, 2, file=file)
    assert len(quick) == 9, "another seed has other readings"
    file.write_text(json.dumps({"other": 1}) + "\n")
    with pytest.raises(ts.InputError, match="no file of readings"):
        random_readings(base, 2, 1, file=file)


def test_counts_become_a_distribution(quick):
    table = random_readings(overdamped(), 10, 1, threads=1).to_dict()
    assert (table["count"], table["judged"]) == (10, 10)
    assert table["agree"]["mean"] == pytest.approx(2.0) and sum(table["agree"]["histogram"]) == 10
    assert table["contradict"]["histogram"] == [0, 10]


def test_a_scattered_device_stays_near_and_stands_again():
    scene = ringing()
    other = scattered(scene, 0.1, 1, 0)
    assert stands(other) and scattered(scene, 0.1, 1, 0) == other != scattered(scene, 0.1, 1, 1)
    for path in ("robot.structure.body.mass", "ground.friction.coefficient", "gait.frequency"):
        ratio = get_value(other, path) / get_value(scene, path)
        assert 0.9 <= ratio <= 1.1 and ratio != 1.0
    legs = other.robot.structure.legs
    assert legs["L1"].stiffness_v == legs["R1"].stiffness_v != scene.robot.structure.legs["L1"].stiffness_v
    for path in (
        "ground.restitution.coefficient",
        "ground.adhesion.rate",
        "ground.film.coefficient",
        "gait.high",
    ):
        assert get_value(other, path) == get_value(scene, path), "printed"


def test_a_reading_is_judged_by_the_judge(monkeypatch):
    monkeypatch.setattr(readings, "COARSE", Coarse(4, (0.5,)))
    monkeypatch.setattr(readings, "PERIODS", 2)
    (one,) = random_readings(overdamped(), 1, 1).readings
    assert one.problem is None and one.score.total == 16


def test_neighbours_give_the_range_of_a_score(quick):
    outcome = type("Outcome", (), {"name": "ringing", "scene": ringing()})
    table = scatter_table(scatter_scores(outcome, 6, 1))
    assert len(set(quick)) == table["judged"] == 6
    assert (table["agree"], table["contradict"]) == ({"least": 0, "most": 4}, {"least": 1, "most": 1})
    assert scatter_table([]) == {"spread": 0.1, "judged": 0}


def test_the_packaged_readings_are_those_of_the_ranges():
    found = packaged_readings()
    assert found.seed == 1 and [one.number for one in found.readings] == list(range(len(found.readings)))
    assert {score.total for score in found.scores} == {16}
    assert parse_readings(readings_text(found)) == found
    with pytest.raises(ts.InputError, match="drawn from other ranges"):
        parse_readings(readings_text(found).replace("ranges ", "ranges 0"))
    with pytest.raises(ts.InputError, match="no file of readings"):
        parse_readings("number,agree\n1,2\n")


@pytest.mark.slow
def test_a_packaged_reading_is_judged_the_same_again():
    wanted = packaged_readings().readings[0]
    (found,) = random_readings(ts.load_scene("millipede"), 1, 1).readings
    assert found.score == wanted.score
