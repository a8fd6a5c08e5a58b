"""Yield: what is drawn, and what is said of runs whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

import tarsus as ts
from tarsus.measure.shares import share_of
from tarsus.study.axes import CUT, Linspace, Normal
from tarsus.study.manufacture import Saltelli, Scattered
from tarsus.study.robots import Robots
from tarsus.study.studyfile import frozen_texts, read_sweep
from tarsus.study.yields import Leader, _curve, _difference, _filled, _group, leader_of
from walking_devices import creeping_millipede

GAIN, STIFF = "robot.drives.*.law.gain", "robot.structure.legs.*.stiffness_v"
FRICTION = "ground.friction.coefficient"


@pytest.fixture(scope="module")
def millipede() -> ts.Scene:
    return ts.load_scene("millipede-30")


def robots(scene: ts.Scene, **words):
    given = {"scatter": {GAIN: "10%", STIFF: "5%"}, "over": {FRICTION: ("0.3", "0.5")}, "dead": (0, 5)}
    return Robots.of(scene, **(given | words))


def test_a_scatter_has_the_quantiles_of_a_normal_one():
    axis = Normal(mean=5.0, deviation=2.0)
    share = (np.arange(4000) + 0.5) / 4000
    assert np.abs(axis.at(share) - stats.truncnorm(-CUT, CUT, 5.0, 2.0).ppf(share)).max() < 1e-9
    assert axis.ends == (-1.0, 11.0)


def test_every_leg_is_drawn_by_itself_and_some_are_dead(millipede):
    sweep = robots(millipede, weak=(1, 2), weakness=0.6).sweep(512, ["mean_speed"])
    points, design = sweep.points(), sweep.design
    assert len(points) == 61 and isinstance(design, Scattered) and len(design.parts) == 30
    left = design.left(sweep.vary, slice(0, 512))
    dead, weak = (left == 0.0).sum(axis=1), (left == 0.6).sum(axis=1)
    assert np.bincount(dead).tolist() == pytest.approx([512 / 6] * 6, abs=3) and set(weak) == {1, 2}
    assert (left == 0.0).sum(axis=0).min() > 20  # every leg dies in some
    gains = np.column_stack([points[name] / sweep.vary[name].mean for name in design.parts])
    assert np.array_equal(gains == 0.0, left == 0.0)
    sound = np.where(left == 1.0, gains, np.nan)
    assert np.nanstd(sound) == pytest.approx(0.1, rel=0.05) and np.nanmean(sound) == pytest.approx(1.0, abs=0.01)
    assert abs(np.corrcoef(points[GAIN.replace("*", "L1")], points[GAIN.replace("*", "R9")])[0, 1]) < 0.12
    assert np.array_equal(sweep.points(slice(77, 99))[FRICTION], points[FRICTION][77:99])


def test_robots_survive_being_written_and_read(tmp_path):
    few = robots(creeping_millipede(), dead=(0, 1))
    for sweep in (few.sweep(8, ["mean_speed"]), few.legs_sweep(2, ["mean_speed"])):
        assert sweep is not None
        for name, text in frozen_texts(sweep).items():
            (tmp_path / name).write_text(text, encoding="utf-8")
        again = read_sweep(tmp_path / "study.toml")
        assert again.design == sweep.design
        for axis, values in sweep.points().items():
            assert np.array_equal(again.points()[axis], values)


def test_groups_are_legs(millipede):
    sweep = robots(millipede).legs_sweep(4, ["mean_speed"])
    assert sweep is not None and isinstance(sweep.design, Saltelli)
    assert sweep.design.names[:3] == ("L1", "R1", "L2") and sweep.design.names[-1] == FRICTION
    assert sweep.runs == 4 * (31 + 2)
    assert robots(millipede, scatter={FRICTION: "1%"}, over=None, dead=(0, 0)).legs_sweep(4, ["mean_speed"]) is None


def test_indices_tell_what_acts_alone_from_what_acts_together():
    """3 a1 + 2 a2 + b: the group of both a makes 13/14 of the variance, alone and in all; a b: nothing alone."""
    design = Saltelli(count=2048, seed=3, groups=("a", "a", "b"))
    axes = {name: Linspace(start=-1.0, stop=1.0) for name in ("a1", "a2", "b")}
    points = design.points(axes, slice(0, design.runs(axes)))
    added = design.indices(3.0 * points["a1"] + 2.0 * points["a2"] + points["b"])
    for word in ("first", "total"):
        assert added["a"][word] == pytest.approx(13 / 14, abs=0.02)
        assert added["b"][word] == pytest.approx(1 / 14, abs=0.02)
    product = design.indices(points["a1"] * points["b"])
    assert abs(product["a"]["first"]) < 0.05 and product["a"]["total"] == pytest.approx(1.0, abs=0.1)


def test_intervals_cover_what_they_say():
    rng, share = np.random.default_rng(5), 0.9
    inside = [low <= share <= high for _, low, high in (share_of(int(n), 200) for n in rng.binomial(200, share, 4000))]
    assert 0.93 < np.mean(inside) < 0.97
    assert share_of(0, 50)[1] == 0.0 and 0.0 < share_of(0, 50)[2] < 0.1


def test_a_curve_counts_failed_robots_as_failing():
    values = np.array([1.0, 2.0, 3.0, np.nan])
    curve = _curve("mean_speed", "m/s", values)
    assert curve.share[0] == 0.75 and curve.share[-1] == 0.25 and not curve.less
    assert (np.diff(curve.share) <= 0.0).all() and (curve.low < curve.share).all()
    less = _curve("cost_of_transport", "1", values)
    assert less.share[-1] == 0.75 and less.less


@pytest.mark.parametrize(("measure", "worst"), [("cost_of_transport", 3.0), ("mean_speed", 1.0)])
def test_a_failed_run_counts_as_the_worst_that_was_seen(measure, worst):
    assert _filled(measure, np.array([2.0, np.nan, 1.0, 3.0])).tolist() == [2.0, worst, 1.0, 3.0]


def test_robots_with_so_many_dead_legs_are_counted_with_those_that_failed():
    found = _group(1, np.array([True, True, True, False]), {"mean_speed": np.array([1.0, np.nan, np.nan, np.nan])})
    assert found == {"dead": 1, "robots": 3, "failed": 2, "mean_speed": None}


def test_a_dead_leg_costs_what_it_costs():
    rng = np.random.default_rng(2)
    dead = rng.random(4000) < 0.2
    cost, error = _difference(5.0 + rng.normal(size=4000) - 0.7 * dead, dead)
    assert abs(cost + 0.7) < 3.0 * error and error == pytest.approx(np.sqrt(1 / 800 + 1 / 3200), rel=0.1)
    assert np.isnan(_difference(np.ones(10), np.zeros(10, bool))[0])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ({"scatter": {"robot.drives.*.law.gian": "5%"}}, r"law\.gian: is not a number in this scene"),
        ({"scatter": {"robot.feet.*.gap": "5%"}}, "5% of 0 is nothing: give the standard deviation as a value"),
        ({"scatter": {GAIN: "2 V"}}, r"law\.gain: .*N/V"),
        ({"scatter": {GAIN: "10"}}, r"times the value itself, .*N/V; .* in percent, such as '10%'"),
        ({"over": {"ground.friction": ("0.3", "0.5")}}, "ground.friction: is not a number"),
        ({"over": {"ground.incline": ("0 deg", "5 deg")}}, "ground.incline: is not set in this scene: set it first"),
        ({"scatter": {}, "over": {}, "dead": (0, 0)}, "nothing is scattered"),
    ],
)
def test_scatter_that_means_nothing_is_refused(millipede, words, said):
    with pytest.raises(ts.InputError, match=said):
        robots(millipede, **words)


def test_every_wrong_requirement_is_named(millipede):
    with pytest.raises(ts.InputError) as caught:
        ts.yield_(millipede, {GAIN: "10%"}, require={"mean_speed": "1 kg", "foot_slip": "2 V"})
    assert [one.split(":")[0] for one in caught.value.problems] == ["mean_speed", "foot_slip"]


def test_more_dead_legs_than_legs_are_refused():
    with pytest.raises(ts.InputError, match=r"at most 5 dead and 0 weak of \d parts is too many"):
        Robots.of(creeping_millipede(), {}, dead=(0, 5)).sweep(8, ["mean_speed"])


def indices(**totals: tuple[float, float]) -> dict[str, dict[str, float]]:
    return {name: {"total": total, "total_error": error} for name, (total, error) in totals.items()}


def test_who_matters_most_is_said_only_where_intervals_are_apart():
    clear = leader_of(indices(L1=(0.2, 0.05), R1=(0.5, 0.1), L2=(0.1, 0.02)), 64)
    assert clear is not None and clear.group == "R1" and clear.resolved and clear.draws is None
    assert clear.sentence("speed") == "scatter of R1 matters most for speed: 0.50 ± 0.10"
    alike = leader_of(indices(L1=(0.40, 0.1), R1=(0.45, 0.1), L2=(0.38, 0.1), R2=(0.1, 0.05)), 64)
    assert alike is not None and not alike.resolved and alike.rivals == ("L1", "L2")
    assert alike.draws == 1024  # 64 (0.2 / 0.05)^2
    assert "is not resolved: R1 0.45 ± 0.10, and the interval of L1 and 1 more overlaps it" in alike.sentence("speed")
    near = leader_of(indices(L1=(0.4999, 0.1), R1=(0.5, 0.1)), 64)  # 64 (0.2 / 1e-4)^2 are too many
    assert near is not None and near.draws is None
    twins = leader_of(indices(L1=(0.5, 0.1), R1=(0.5, 0.1)), 64)
    assert twins is not None and twins.draws is None and "hardly" in twins.sentence("speed")
    assert leader_of({}, 64) is None


def test_as_many_draws_as_are_named_tell_them_apart():
    """Y = a + 0.85 b and eight more: 32 draws do not tell a from b, the number that they name does."""
    names = [f"x{i}" for i in range(10)]
    weights = np.array([1.0, 0.85, *[0.4] * 8])
    axes = {name: Linspace(start=0.0, stop=1.0) for name in names}

    def leader(draws: int) -> Leader:
        design = Saltelli(count=draws, seed=2, groups=tuple(names))
        points = design.points(axes, slice(0, design.runs(axes)))
        values = np.stack([points[name] for name in names], axis=1) @ weights
        found = leader_of(design.indices(values), draws)
        assert found is not None
        return found

    few = leader(32)
    assert not few.resolved and few.draws is not None
    assert (many := leader(2 * few.draws)).resolved and many.group == "x0"


def test_grounds_alone_may_be_scattered() -> None:
    rough = {"kind": "random", "seed": 3, "rms": 1e-6, "correlation_length": 3e-4, "spacing": 4e-5}
    scene = ts.with_values(creeping_millipede(), {"ground.profile": rough})
    found = Robots.of(scene, {}, {"ground.profile.seed": (0, 1000)})
    points = found.sweep(8, ["mean_speed"]).points()
    assert not found.scatter and list(points) == ["ground.profile.seed"] and np.ptp(points["ground.profile.seed"]) > 0.0
