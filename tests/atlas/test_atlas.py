"""Atlases: the grid that is refined where classes change, classes against single runs, closed forms, the folder."""

from __future__ import annotations

import math
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

import numpy as np
import pytest

import tarsus as ts
from scene_files import scene
from tarsus.atlas.cells import CellRuns
from tarsus.atlas.classes import REFUSED, meanings, words
from tarsus.atlas.quadtree import Quadtree
from tarsus.files.settled import settled
from tarsus.model.scene import Initial
from tarsus.orbits.basins import CHAOTIC

GAP, VOLTS = "robot.feet.tip.gap", "signals.pzt.amplitude"
MAP: dict[str, Any] = {"x": (GAP, "80 um", "90 um"), "y": (VOLTS, "4 V", "6.5 V")}


def discs(points, size=64):
    """Classes of points of a grid: a disc, a ring around it, a stripe that is two points wide."""
    x, y = points.T / size
    far = np.hypot(x - 0.6, y - 0.45)
    return np.where(far < 0.15, 1, np.where(far < 0.3, 2, np.where(abs(y - 0.9 * x) < 1.5 / size, 3, 0))).astype(
        np.int16
    )


def test_a_refined_grid_is_the_whole_one_where_classes_are_not_finer_than_it():
    every = np.argwhere(np.ones((65, 65), dtype=bool))
    grid = Quadtree.refined(6, 3, discs)
    assert np.array_equal(grid.code[*every.T], discs(every))
    assert len(grid.points) < 0.6 * len(every) and len(np.unique(grid.points, axis=0)) == len(grid.points)
    x, y = every.T
    of = grid.points[grid.source[x, y]]
    assert np.array_equal(discs(of), grid.code[x, y]), "every point has its class from a run of that class"
    assert (abs(of - every).max(axis=1) < 8).all()
    spiked = (x <= 32) | ((x <= 35) & (y == 33))  # beyond a square whose corners differ, one whose corners do not
    spiked = spiked.astype(np.int16).reshape(65, 65)
    assert np.array_equal(Quadtree.refined(6, 3, lambda points: spiked[*points.T]).code, spiked)
    plain = Quadtree.refined(6, 2, lambda points: np.full(len(points), 7, np.int16))
    assert len(plain.points) == 25 and (plain.code == 7).all() and (plain.source >= 0).all()


def test_classes_are_those_of_single_runs():
    """At the accuracy of single runs, a hundred times finer; away from borders between classes, which it moves."""
    beam = ts.load_scene("cantilever")
    places = np.random.default_rng(4).uniform((82e-6, 4.0), (90e-6, 6.5), (30, 2))
    found = CellRuns(beam, (GAP, VOLTS)).of(places)
    multiples = []
    for (gap, volts), code in zip(places, found["code"], strict=True):
        run = ts.simulate(ts.with_values(beam, {GAP: gap, VOLTS: volts}), 2.0)
        alone = settled(run)
        assert alone is not None and alone.multiple == code // 16, words(int(code))
        late = run.events["kind"][run.events["time"] > 1.0]
        assert ((late == 2).any()) == ("held" in words(int(code)))
        multiples.append(alone.multiple)
    assert len(set(multiples)) >= 2


def test_classes_in_words_have_meanings():
    codes = [16 + 3, 3 * 16 + 5, 2 * 16, CHAOTIC, REFUSED]
    said = meanings(codes)
    for code in codes:
        assert all(word in said for word in words(code).split(", ")), words(code)
    assert said["period 1"] == "the motion repeats after 1 drive period" and "held" in said
    assert "stays on the ground" not in said and all(text and text[0].islower() for text in said.values())


def test_measures_are_those_of_the_settled_motion_and_of_the_period_of_each_own_drive():
    beam = ts.load_scene("cantilever")
    frequency = np.array([40.0, 50.0, 90.0])
    cells = CellRuns(beam, ("ground.restitution.coefficient", "signals.pzt.frequency"))
    e = ts.get_value(beam, "ground.restitution.coefficient")
    found = cells.of(np.column_stack([np.full(3, e), frequency]))
    for hz, code, measures in zip(frequency, found["code"], found["measures"], strict=True):
        orbit, told = ts.periodic(ts.load_scene("cantilever", hz=hz)), dict(zip(cells.names, measures, strict=True))
        own = orbit.events[np.isin(orbit.events["kind"], (1, 2, 4))]
        assert code // 16 == orbit.multiple
        assert told["impacts"] == pytest.approx(orbit.impacts / orbit.multiple)
        assert told["bounces"] == pytest.approx((own["kind"] == 1).sum() / orbit.multiple)
        assert told["touchdown_speed"] == pytest.approx(np.abs(own["speed_before"]).mean(), rel=1e-5)
        assert told["energy"] == pytest.approx(own["energy"].sum() / orbit.multiple, rel=1e-5)


def test_a_number_without_a_slot_makes_plans_of_its_own():
    beam = ts.load_scene("cantilever")
    path = "robot.structure.damping_ratios.0"
    own = ts.get_value(beam, path)
    found = CellRuns(beam, (path, VOLTS)).of(np.array([[own, 8.0], [1.1 * own, 8.0], [-1.0, 8.0]]))
    assert words(int(found["code"][0])) == "period 1, held" and words(int(found["code"][2])) == "refused"
    slot = CellRuns(beam, (GAP, VOLTS)).of(np.array([[70e-6, 8.0]]))
    assert np.array_equal(found["measures"][0], slot["measures"][0])


def test_a_walker_of_several_starts_has_shares_travel_and_slip():
    walker = ts.load_scene("millipede")
    cells = CellRuns(walker, ("ground.film.coefficient", "gait.high"), starts=6)
    volts, film = ts.get_value(walker, "gait.high"), ts.get_value(walker, "ground.film.coefficient")
    found = cells.of(np.array([[film, volts]] * 2))
    measures = dict(zip(cells.names, found["measures"][0], strict=True))
    assert found["codes"].shape == (2, 6) and measures["motions"] >= 2.0
    assert np.array_equal(*found["codes"]) and np.array_equal(*found["measures"])
    assert measures["travel"] == pytest.approx(1.539e-6, rel=1e-3)
    walk = ts.simulate(walker, 1.2)
    assert measures["slip"] == pytest.approx(walk.measures["foot_slip"].value, rel=0.05)


@pytest.mark.slow
def test_lines_of_a_ball_that_does_not_bounce_are_hit_to_a_pixel():
    """A ball of restitution 0 leaves the table where its acceleration exceeds gravity, V = m g; it lands after the next
    departure, and the period doubles, where V cos(phi) = pi m g with sin(phi) = m g / V, V = m g sqrt(1 + pi^2)."""
    ball = scene("vibrating_table", {"ground.restitution.coefficient": 0.0})
    g, volts = ("ground.gravity.acceleration", 0.5, 0.7), ("signals.table.amplitude", 0.3, 2.6)
    found = ts.atlas(ball, x=g, y=volts, depth=5, coarse=3)
    for i, gravity in enumerate(found.x.at(np.arange(33) / 32)):
        said = [words(int(code)) for code in found.grid.code[i]]
        lift, double = (found.y.share(gravity * one) * 32 for one in (1.0, math.hypot(1.0, math.pi)))
        assert set(said[: math.floor(lift)]) == {"period 1, stays on the ground"}
        assert set(said[math.ceil(lift) + 1 : math.floor(double)]) == {"period 1, held"}
        assert "period 1, held" not in said[math.ceil(double) + 1 :]


def test_a_motion_that_closes_in_on_one_of_half_its_period_has_not_settled():
    """Just before the flip, at Gamma = 1.652, every other period is equal to 1e-6 long before every one is."""
    start = Initial(displacement=(0.12,), velocity=(0.0,))
    ball = scene("vibrating_table").model_copy(update={"initial": start})
    found = CellRuns(ball, ("signals.table.amplitude", "ground.restitution.coefficient"), periods=600)
    said = found.of(np.array([[1.625, 0.45], [1.68, 0.45]]))["code"]
    assert [words(int(code)) for code in said] == ["period 1", "period 2"]


@pytest.mark.slow
def test_the_flip_of_a_bouncing_ball_is_hit_to_a_pixel():
    """Gamma^2 = (pi (1 - e) / (1 + e))^2 + (2 (1 + e^2) / (1 + e)^2)^2: both multipliers' product is e^2, one is -1."""
    start = Initial(displacement=(0.12,), velocity=(0.0,))
    ball = scene("vibrating_table").model_copy(update={"initial": start})
    x, y = ("signals.table.amplitude", 1.65, 1.81), ("ground.restitution.coefficient", 0.4, 0.44)
    found = ts.atlas(ball, x=x, y=y, depth=4, coarse=4, periods=1200)
    for j, e in enumerate(found.y.at(np.arange(17) / 16)):
        flip = math.hypot(math.pi * (1 - e) / (1 + e), 2 * (1 + e * e) / (1 + e) ** 2)
        place = float(found.x.share(flip)) * 16
        said = [words(int(code)) for code in found.grid.code[:, j]]
        assert said[math.floor(place) - 1] == "period 1" and said[math.ceil(place) + 1] == "period 2", e


def test_an_atlas_goes_on_where_it_was_killed(tmp_path, monkeypatch):
    whole = ts.atlas("cantilever", **MAP, depth=4, coarse=2, threads=1)
    ran: list[int] = []
    of = CellRuns.of

    def some(self, points, workers=1):
        if len(ran) == 2:
            raise KeyboardInterrupt
        ran.append(len(points))
        return of(self, points, workers)

    monkeypatch.setattr(CellRuns, "of", some)
    with pytest.raises(KeyboardInterrupt):
        ts.atlas("cantilever", **MAP, depth=4, coarse=2, output=tmp_path)
    before = sum(ran)
    ran[:] = []
    monkeypatch.setattr(CellRuns, "of", lambda *words: ran.append(len(words[1])) or of(*words))
    again = ts.atlas("cantilever", **MAP, depth=4, coarse=2, output=tmp_path, resume=True)
    assert before > 0 and sum(ran) == len(whole.code) - before
    assert np.array_equal(again.grid.code, whole.grid.code) and np.array_equal(again.code, whole.code)
    assert all(np.array_equal(again.measures[name], of, equal_nan=True) for name, of in whole.measures.items())
    with pytest.raises(ts.InputError, match=r"atlas-request\.json differs"):
        ts.atlas("cantilever", **MAP, depth=3, output=tmp_path, resume=True)


@pytest.mark.slow
def test_processes_that_share_a_folder_make_one_atlas(tmp_path, monkeypatch):
    """Two at the same time, in units of an order of their own, and one on an executor's processes."""
    whole = ts.atlas("cantilever", **MAP, depth=5, coarse=3, threads=1)
    script = (
        "import sys, tarsus as ts, tarsus.atlas.verb; from importlib import import_module\n"
        "import_module('tarsus.atlas.verb').UNIT = 64\n"
        f"ts.atlas('cantilever', **{MAP!r}, depth=5, coarse=3, output=sys.argv[1], resume=True, threads=1)\n"
    )
    both = [subprocess.Popen([sys.executable, "-c", script, str(tmp_path / "shared")]) for _ in range(2)]
    assert [one.wait() for one in both] == [0, 0]
    monkeypatch.setattr("tarsus.atlas.verb.UNIT", 64)
    computed: list[int] = []
    of = CellRuns.of
    monkeypatch.setattr(CellRuns, "of", lambda *words: computed.append(1) or of(*words))
    shared = ts.atlas("cantilever", **MAP, depth=5, coarse=3, output=tmp_path / "shared", resume=True)
    assert not computed
    monkeypatch.undo()
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        elsewhere = ts.atlas("cantilever", **MAP, depth=5, coarse=3, threads=pool)
    for found in (shared, elsewhere):
        assert np.array_equal(found.grid.code, whole.grid.code)
        assert all(np.array_equal(found.measures[name], one, equal_nan=True) for name, one in whole.measures.items())


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"x": (GAP, "90 um", "80 um")}, "the range from 9e-05 to 8e-05 is empty"),
        ({"x": (VOLTS, 1, 2)}, "is both axes"),
        ({"x": (GAP, "0 um", "80 um", "log")}, "a logarithmic axis begins above 0"),
        ({"x": ("robot.feet.tip.gab", 1, 2)}, "did you mean 'robot.feet.tip.gap'"),
        ({"x": (GAP, "80 um", "90 um", "lgo")}, "expected a:b or a:b:log"),
        ({"x": ("ground.restitution.coefficient", 0.1, 2.0)}, "ground.restitution.coefficient"),
        ({"depth": 13}, "depth: expected 1 to 12"),
        ({"starts": 0}, "starts: expected 1 or more, got 0"),
    ],
)
def test_bad_input_is_one_sentence(given, sentence):
    with pytest.raises(ts.InputError, match=sentence) as caught:
        ts.atlas("cantilever", **(MAP | given))
    assert len(caught.value.problems) == 1
