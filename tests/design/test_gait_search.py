"""Fronts of gaits: what walks are worth, grounds that hurt, and the same result after a kill."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.design.energy import RECOVERY
from tarsus.design.free import free_of
from tarsus.design.grounds import Grounds
from tarsus.design.judge import NOMINAL, Judge
from tarsus.design.measures import limits_of, objectives_of
from tarsus.design.presets import gait
from tarsus.design.runs import Runs, without_legs
from tarsus.design.search import along, search_of
from tarsus.files.draws import Reliance
from tarsus.fit.front import undominated
from tarsus_reproduce.walkers import hexapod_walker

SHORT = 0.01
"""One step [s]: enough to tell gaits apart, and a walk costs next to nothing."""
FREE = {"gait.duty": None, "gait.frequency": ("100 Hz", "200 Hz")}
BOX = {"ground.friction.coefficient": (4.0, 12.0)}
SMALL = {"candidates": 64, "from_rest": SHORT, "look": 3, "threads": 1}


@pytest.fixture(scope="module")
def scene() -> ts.Scene:
    return ts.load_scene("millipede-printed")


@pytest.fixture(scope="module")
def robust(scene):
    """A robust front, and the gaits that were put on grounds drawn by chance."""
    looked: list[np.ndarray] = []
    attack = Judge.attack

    def spied(self, rows, look, *, by_chance=False):
        looked.extend([rows] if by_chance else [])
        return attack(self, rows, look, by_chance=by_chance)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Judge, "attack", spied)
        return gait(scene, FREE, over=BOX, **SMALL), looked


def walks_of(scene: ts.Scene, free: object = FREE, objectives: str = "speed,energy") -> Runs:
    return Runs(free_of(scene, free), objectives_of(objectives), SHORT, threads=1)  # type: ignore[arg-type]


def test_costs_are_those_of_single_walks(scene):
    walks = walks_of(scene, objectives="speed,contact,slip")
    points = walks.free.values(np.array([[0.3, 0.2], [0.6, 0.9]]))
    grounds = Grounds({"ground.friction.coefficient": np.array([4.0, 9.0])}, np.full(2, 0.5))
    costs = Judge(walks.each, Grounds.nominal(scene), None, NOMINAL, 0).costs(points, grounds)
    assert costs.shape == (2, 2, 3) and walks.made == 4
    run = ts.simulate(walks.scene_of(points[1], {"ground.friction.coefficient": 9.0}), SHORT)
    own = [run.measures[name].value for name in ("mean_speed", "contact_duration", "foot_slip")]
    assert costs[1, 1] == pytest.approx([-own[0], -own[1], own[2]], rel=1e-5)  # a batch runs at its own accuracy


@pytest.mark.parametrize("recovery", [(None, None), (0.4, 0.4), (0.4, None)])
def test_charge_is_recovered_once_from_what_every_drive_draws(scene, recovery):
    """C dV^2 of every drive, less its own share: of the gait's square wave, and of signals counted rise by rise."""
    given = dict(zip(("L1", "R1"), recovery, strict=True))
    scene = ts.with_values(scene, {f"robot.drives.{name}.recovery": own for name, own in given.items()})
    wave = ts.OnOff(levels=(0.0, 5.0), durations=(5e-3, 5e-3), repeat=True)
    mixed = ts.with_values(scene, {"signals": {"L1": wave}, "gait.frequency": 100.0})
    point, charges = np.array([[0.7, 0.4]]), {name: scene.robot.drives[name].capacitance for name in given}
    for own, free in (
        (scene, {"gait.high": None, "gait.duty": None}),
        (mixed, {"gait.high": None, "signals.L1.levels.1": ("2 V", "9 V")}),
    ):
        walks = walks_of(own, free)
        row = walks.free.values(point)
        made = walks.changes(row[0])
        swings = {"R1": made["gait.high"] - own.gait.low}
        swings["L1"] = made.get("signals.L1.levels.1", swings["R1"])
        plain = {name: charges[name] * swings[name] ** 2 for name in given}
        for unsaid in (0.0, RECOVERY):
            left = sum(plain[name] * (1.0 - (unsaid if r is None else r)) for name, r in given.items())
            assert walks.energies(row, unsaid) == (
                pytest.approx([sum(plain.values())], rel=1e-12),
                pytest.approx([left], rel=1e-12),
            )
        # the objective is the measure: drives that do not say recover nothing
        period = max(one.period for one in walks.scene_of(row[0]).waveforms.values())
        run = ts.simulate(walks.scene_of(row[0]), 3.0 * period)
        drawn = run.measures["electrical_energy"].value
        assert walks.each(row, {})[0, 1] == pytest.approx(drawn, rel=1e-9)
        assert walks.energies(row, 0.0)[1] == pytest.approx([drawn], rel=1e-9)


def test_dead_legs_have_no_drive_and_keep_their_place():
    hexapod = hexapod_walker()
    lame = without_legs(hexapod, ("L2",))
    assert "L2" not in lame.robot.drives and "L2" in lame.robot.feet and lame.robot.feet["L2"].electrode is None
    assert lame.gait == hexapod.gait and len(lame.robot.drives) == 5
    with pytest.raises(InputError, match="the robot has no leg 'L7'"):
        without_legs(hexapod, ("L7",))


def test_a_robust_front_is_judged_on_the_same_grounds_and_says_its_gap(scene, robust, tmp_path):
    found, _ = robust
    assert len(found.grounds) > 1 and found.grounds.values["ground.friction.coefficient"][0] == 7.96
    front = found.front
    assert undominated(front).all() and len(found.members) >= 1
    walks = walks_of(scene)
    for member in (*found.members, found.robust, found.optimum):
        each = Judge(walks.each, found.grounds, None, NOMINAL, 0).costs(member.row[None], found.grounds)[0]
        assert member.risk[0] == member.worst[0] <= -each[:, 0].max() + 1e-12  # the last attack looks further
        assert -each[0, 0] == pytest.approx(member.nominal[0])
        struck = walks.each(member.row[None], {p: np.array([v]) for p, v in member.worst_ground.items()})
        assert -struck[0, 0] == pytest.approx(member.worst[0])
    assert found.gap >= 0.0 and found.rounds[0].grounds == 1
    assert found.certificate is not None and found.certificate.grounds == 4 * SMALL["look"]
    every = (*found.members, found.optimum)
    assert found.robust is found.members[0] and found.robust.risk[0] == max(one.risk[0] for one in every)
    assert found.optimum.nominal[0] == max(one.nominal[0] for one in every)
    stated = np.array([(-one.risk[0], one.risk[1]) for one in every])
    assert undominated(stated[:-1]).all() and not (stated[-1] < stated[:-1]).all(axis=1).any()
    table = found.table()
    named = [name for row in table.rows for name in row[0].split(", ")]
    assert sorted(named) == sorted(name for name, _ in found.named)  # each once, those that are one gait in one row
    assert len(table.rows) == len({tuple(one.values.values()) for _, one in found.named})
    assert "gait.duty" in found._repr_html_() and len(repr(found)) < 120
    axes = ts.plot.front(found)
    assert axes.collections[-1].get_offsets()[0][1] == pytest.approx(found.members[0].risk[0])
    table = found.to_dict()
    found.write(tmp_path)
    assert ts.read_scene(tmp_path / "gaits" / "robust.toml").gait == found.scene_of(found.robust).gait
    assert table["gain"] == pytest.approx(found.gain) and len(table["front"]) == len(found.members)


def test_every_gait_shown_is_put_on_grounds_drawn_by_chance(robust):
    found, looked = robust
    seen = {tuple(point) for points in looked for point in points}
    assert {tuple(one.row) for one in (*found.members, found.robust, found.optimum)} <= seen


def test_a_robust_gait_is_found_beside_a_peak_that_one_ground_has(monkeypatch):
    """Speed on the scene's own ground peaks at a duty of 0.26, where other grounds have none of it; a broad hill at 0.7
    is 5 % lower, the same everywhere, and nothing else moves at all."""

    def hills(self, rows, grounds):
        friction = next(iter(grounds.values()))
        peak = np.where(friction == 7.96, 1.0, 0.1) * np.exp(-(((rows[:, 0] - 0.26) / 0.04) ** 2))
        hill = 0.95 * np.exp(-(((rows[:, 0] - 0.7) / 0.16) ** 2))
        return -np.maximum(peak, hill)[:, None]

    monkeypatch.setattr(Runs, "each", hills)
    options = {**SMALL, "candidates": 256, "from_rest": 0.021}
    found = gait(ts.load_scene("millipede-printed"), {"gait.duty": None}, "speed", BOX, **options)
    assert found.optimum.nominal[0] == pytest.approx(1.0, abs=1e-3) and found.optimum.worst[0] < 0.11
    assert found.robust.worst[0] == pytest.approx(0.95, abs=1e-3) and found.gain > 8.0


def test_a_gait_says_what_its_motion_is_and_what_a_percent_costs(scene):
    found = gait(scene, FREE, "speed", **{**SMALL, "from_rest": 0.03})
    one, run = found.robust, ts.simulate(found.scene_of(found.robust))
    for name in ("duty_factor", "all_feet_up", "heave_span", "slip_ratio"):
        assert one.motion.means[name] == pytest.approx(run.measures[name].value, rel=1e-5)
    told = found.percents
    assert found.to_dict()["front"][0]["motion"] == one.motion.to_dict() and told.own == pytest.approx(one.nominal[0])
    table = found.table()
    assert "all feet up" in [column.name for column in table.columns] and told.words in " ".join(table.notes)


LIMITS = [
    ("heave_span<100um, mean_speed > 2 mm/s", {"heave_span": (True, 1e-4), "mean_speed": (False, 2e-3)}),
    ({"slip ratio": "< 0.2"}, {"slip_ratio": (True, 0.2), "heave_span": (True, 6e-4)}),
    (["heave_span<inf"], {}),
    (None, {"heave_span": (True, 6e-4)}),
]


@pytest.mark.parametrize(("given", "wanted"), LIMITS)
def test_limits_are_measures_by_name_with_a_direction(scene, given, wanted):
    found = {one.measure: (one.most, one.value) for one in limits_of(scene, given)}
    assert found == {name: (most, pytest.approx(value)) for name, (most, value) in wanted.items()}
    (one,) = limits_of(hexapod_walker(), None)  # a body that tilts
    assert one.measure == "tilt" and one.value == 0.3 and one.beyond(np.array([0.2, 0.6])).tolist() == [0.0, 1.0]


SHORTEST = "at least a drive period of the slowest gait, {}, got 0.009 s"
BAD = [
    ({"limits": "heave_spam<1um"}, "did you mean 'heave_span'"),
    ({"limits": "heave_span=1um"}, "expected a measure, < or >"),
    ({"limits": "heave_span<1V"}, "limits: "),
    ({"limits": "turn_rate<1"}, "is of bodies with yaw"),
    ({"limits": "longest_hold>1s"}, "a settled motion has none"),
    ({"candidates": 3}, "candidates"),
    ({"free": FREE, "from_rest": 0.009}, SHORTEST.format("0.01 s")),
    ({"from_rest": 0.009}, SHORTEST.format("0.02028 s")),
    ({"free": ["gait.frequency"], "from_rest": 0.009}, SHORTEST.format("0.04057 s")),
    ({"duration": 0.1}, "takes runs of 1 s at least, got 100 ms; an episode"),
    ({"duration": 1.0, "from_rest": 0.1}, "give one of the two"),
    ({"objectives": "speed,energy,slip,contact"}, "expected one to three, got 4"),
]


@pytest.mark.parametrize(("given", "said"), BAD)
def test_a_bad_request_is_refused_with_a_sentence(scene, given, said):
    asked = {"free": ["gait.duty"], "objectives": "speed", **given}
    with pytest.raises(InputError, match=said):
        gait(scene, asked.pop("free"), asked.pop("objectives"), **asked)


def test_what_goes_beyond_a_limit_is_not_shown_where_anything_keeps_it(scene, monkeypatch):
    """Speed and height both grow with the duty; the fastest that keeps 50 um is at half of the range."""

    def walked(self, rows, grounds, measures, duration=None):
        cube = (rows[:, 0] - 0.1) / 0.8
        made = {"mean_speed": cube, "heave_span": 1e-4 * cube}
        return {name: made.get(name, np.zeros(len(rows))) for name in {*measures, *made}}

    monkeypatch.setattr(Runs, "measured", walked)
    kept = gait(scene, ["gait.duty"], "speed", limits="heave_span<50um", **{**SMALL, "from_rest": 0.021})
    assert 0.48 < kept.robust.nominal[0] <= 0.5 and kept.robust.beyond == 0.0 and kept.costs.max() < 1.0
    none = gait(scene, ["gait.duty"], "speed", limits="heave_span>1mm", **{**SMALL, "from_rest": 0.021})
    assert none.robust.beyond == 1.0 and none.robust.nominal[0] == pytest.approx(1.0, abs=0.05)
    assert any("100 % of its runs go beyond a limit" in said for said in none.remarks)


def test_a_gait_that_leaves_the_range_of_its_model_says_so(scene):
    low = ts.with_values(scene, {f"robot.structure.legs.{leg}.y": y for leg, y in (("L1", 5e-6), ("R1", -5e-6))})
    lifted = gait(low, FREE, "speed", limits="heave_span<inf", **SMALL)
    assert "leaves its model's range: heave span" in str(lifted) and lifted.robust.motion.highest > 3e-6
    assert any(one.startswith("limit: heave span below 3 µm, for hips") for one in gait(low, FREE, **SMALL).remarks)


def two_gaits(monkeypatch):
    """Speeds of 2 from high starts and of 1 from low ones, half as much where friction is above 10; short walks are ten
    times as fast."""

    def walked(self, rows, grounds):
        speed = np.where(grounds["height"] > 0.5 * self.starts.ends["height"][1], 2.0, 1.0)
        friction = grounds.get("ground.friction.coefficient", np.full(len(rows), 5.0))
        speed = np.where(friction > 10.0, 0.5, 1.0) * speed * (1.0 + 0.2 * rows[:, 0])
        return -(speed if self.duration == 1.0 else 10.0 * speed)[:, None]

    monkeypatch.setattr(Runs, "each", walked)
    monkeypatch.setattr("tarsus.design.search.motions_of", lambda walks, points, starts: points)
    none = ts.design.Percents("speed", "m/s", True, 1.0, 1.0, ())
    monkeypatch.setattr("tarsus.design.search.percents_of", lambda runs, row, starts, periodic: none)


def test_a_settled_front_is_a_mean_over_starts_and_says_its_interval(scene, monkeypatch):
    two_gaits(monkeypatch)
    found = gait(scene, ["gait.duty"], "speed", candidates=64, starts=16, threads=1)
    best = found.optimum
    scale = 1.0 + 0.2 * best.row[0]
    assert scale > 1.172 and best.nominal[0] == pytest.approx(1.5 * scale, rel=0.03)  # of 96 fresh starts
    assert best.intervals[0] == pytest.approx((scale, 2.0 * scale))
    assert "settled motion, runs of 1 s from 16 starts" in str(found) and found.better is None


@pytest.mark.parametrize(
    ("reliance", "wider", "said"),
    [
        (Reliance(("feet jump (3, 2.5 at most)",)), np.nan, "an identification in doubt: feet jump (3, 2.5 at most)"),
        (Reliance(("a", "b"), 0.02), 0.02, "an identification in doubt: a, and 1 more"),
    ],
)
def test_what_draws_miss_widens_intervals_and_what_they_doubt_is_said(scene, monkeypatch, reliance, wider, said):
    two_gaits(monkeypatch)
    draws = {"ground.friction.coefficient": np.linspace(5.0, 9.0, 96)}
    found = gait(
        scene, ["gait.duty"], "speed", Grounds(draws, reliance=reliance), "mean", candidates=64, look=24, threads=1
    )
    scale = 1.0 + 0.2 * found.robust.row[0]
    ends = np.array([scale - 2.0 * scale * wider, 2.0 * scale * (1.0 + wider)])
    assert found.robust.intervals[0] == pytest.approx(ends, nan_ok=True)
    assert said in str(found) and any(said in one for one in found.to_dict()["remarks"])


def test_the_worst_is_that_of_grounds_and_starts_together(scene, monkeypatch):
    two_gaits(monkeypatch)
    found = gait(scene, ["gait.duty"], "speed", BOX, candidates=64, starts=4, look=24, threads=1)
    one = found.robust
    scale = 1.0 + 0.2 * one.row[0]
    assert one.worst[0] == pytest.approx(0.5 * scale) and one.intervals[0][1] == pytest.approx(2.0 * scale)
    assert one.worst_ground["ground.friction.coefficient"] > 10.0 and one.worst_ground["height"] < 2e-5
    assert found.better is False and "none was found that is more robust" in found.verdict
    scene_at = found.scene_of(one, worst=True)
    assert scene_at.duration == 1.0 and scene_at.initial is not None and scene_at.initial.standing is None
    words = found.to_dict()
    assert words["better"] is False and words["motion"].startswith("settled motion")


@pytest.mark.slow
def test_stated_speeds_are_those_of_plain_runs_twice_as_long(scene):
    """From starts and on grounds that no search saw; 95 % lie in the interval, less the scatter of
    60 runs (three standard deviations)."""
    found = gait(
        scene,
        ["gait.duty", "gait.frequency"],
        "speed",
        {"ground.friction.coefficient": (4.0, 12.0)},
        candidates=64,
        look=24,
        starts=2,
        threads=1,
    )
    rng, (low, high) = np.random.default_rng(5), found.robust.intervals[0]
    box, inside = found.request.starts, []
    assert box is not None
    for point in rng.random((60, 2)):
        scene_at = ts.with_values(
            ts.with_values(box.scene, {path: float(one[0]) for path, one in box.values(point[None]).items()}),
            {**found.robust.values, "ground.friction.coefficient": 4.0 + 8.0 * float(rng.random())},
        )
        speed = ts.simulate(scene_at, 2.0).measures["mean_speed"].value
        inside.append(low <= speed <= high)
    assert np.mean(inside) >= 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / 60)


def test_a_design_that_is_killed_goes_on_and_ends_the_same(scene, tmp_path, monkeypatch):
    whole = gait(scene, FREE, **SMALL)
    calls = {"left": 2}
    walk = Runs.each

    def dying(self, points, grounds):
        calls["left"] -= 1
        if calls["left"] < 0:
            raise KeyboardInterrupt
        return walk(self, points, grounds)

    monkeypatch.setattr(Runs, "each", dying)
    with pytest.raises(KeyboardInterrupt):
        gait(scene, FREE, output=tmp_path, **SMALL)
    monkeypatch.undo()
    with pytest.raises(InputError, match="holds a design; continue it there with --resume"):
        gait(scene, FREE, output=tmp_path, **SMALL)
    resumed = gait(scene, FREE, output=tmp_path, resume=True, **SMALL)
    assert resumed.reused > 0 and resumed.runs + resumed.reused == whole.runs
    assert np.array_equal(resumed.costs, whole.costs) and np.array_equal(resumed.rows, whole.rows)
    with pytest.raises(InputError, match="holds another design"):
        gait(scene, FREE, output=tmp_path, resume=True, **{**SMALL, "candidates": 65})


def test_a_bad_request_is_refused_whole(scene):
    with pytest.raises(InputError) as refused:
        gait(scene, ["gait.dutty"], "spede,energy", {"ground.friction.coefficient": (0.5, 0.2)}, "bad", dead=("L9",))
    said = " | ".join(refused.value.problems)
    assert len(refused.value.problems) == 5
    for words in ("leg 'L9'", "'spede'", "gait.dutty", " is empty", "risk"):
        assert words in said
    with pytest.raises(InputError, match="'cantilever' does not walk"):
        gait(ts.load_scene("cantilever"), ["gait.duty"])
    bare = ts.with_values(scene, {"robot.drives.L1.capacitance": None})
    with pytest.raises(InputError, match="energy needs the capacitance of drive 'L1'"):
        gait(bare, ["gait.duty"])


def test_a_front_is_shown_by_members_along_it():
    x = np.linspace(0.0, 1.0, 200)
    costs = np.stack([x, 1.0 - np.sqrt(x)], axis=1)
    rows = along(costs, 5)
    assert len(rows) == 5 and rows[0] == 0 and rows[-1] == 199
    way = np.hypot(*np.diff(costs[rows], axis=0).T)
    assert way.max() < 1.5 * way.min()
    assert search_of(2000).candidates == pytest.approx(2000, abs=search_of(2000).population)


def test_presets_are_objectives_with_limits(scene, monkeypatch):
    asked = []
    monkeypatch.setattr("tarsus.design.presets.gait", lambda *given, **named: asked.append((given, named)))
    ts.design.steady(scene, FREE, "2 mm/s", candidates=64)
    ts.design.hold(scene, FREE, "3 s")
    (steady, kept), (hold, lifted) = asked
    assert steady[2] == "least vertical_amplitude" and kept["candidates"] == 64
    assert limits_of(scene, kept["limits"])[0].value == 2e-3
    assert hold[2] == "most longest_hold, least foot_slip" and lifted["from_rest"] == 3.0
    assert limits_of(scene, lifted["limits"]) == ()
