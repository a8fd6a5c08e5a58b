"""Measures taken over settled motions are means over the attractors by their shares; over an episode, of that run."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.orbits.motion import FromRest, SettledMotion, motion_asked
from tarsus.orbits.scored import scored
from tarsus.solve.codes import ResultCode
from tarsus.solve.run import Shared
from tarsus.study.sweep import Sweep

SPEED = ("mean_speed", "duty_factor")
GAP = "robot.feet.L1.gap"
GROUND = {"ground.restitution.coefficient": [0.1, 0.2]}


def test_a_mean_over_starts_is_one_over_attractors_by_share():
    """Against `attractors`, which tells motions apart by their states and not by their contacts."""
    scene, starts = ts.load_scene("millipede"), 12
    found = ts.attractors(scene, starts=starts, edges=False)
    assert len(found) > 1 and not found.others
    share = np.array([one.share.count / starts for one in found.found])
    speed = np.array([one.travel / one.period for one in found.found])
    mean = float(share @ speed)
    made = scored(SettledMotion(1.0, starts), scene, {}, SPEED, Shared())
    assert made.code == [ResultCode.DONE] and made.settled == 1.0
    assert made.value[0, 0] == pytest.approx(mean, rel=1e-5)
    assert made.over_starts[0, 0] == pytest.approx(np.sqrt(share @ (speed - mean) ** 2), rel=1e-4)
    assert made.spread[0, 0] < 1e-4 * mean and made.per_foot.shape == (1, 2, len(scene.robot.feet))


def test_an_episode_is_measured_as_the_run():
    scene = ts.load_scene("millipede", duration="50 ms")
    rates = np.array([1e-6, 3e-6])
    made = scored(FromRest(0.05), scene, {"ground.adhesion.rate": rates}, SPEED, Shared())
    batch = ts.simulate_batch(scene, {"ground.adhesion.rate": rates}, 0.05)
    assert made.value[:, 0].tolist() == batch.measure("mean_speed").tolist()
    assert made.over_starts is None and made.settled is None


def test_a_foot_that_reaches_further_down_is_put_down_higher():
    scene = ts.with_values(ts.load_scene("millipede"), {f"robot.feet.{one}.gap": 1e-6 for one in ("L1", "R1")})
    made = scored(SettledMotion(1.0, 2), scene, {GAP: np.array([0.0, 2e-6])}, SPEED, Shared())
    assert made.code == [ResultCode.DONE] * 2 and np.isfinite(made.value).all()


def test_nothing_is_told_of_a_robot_that_fails_from_one_start(monkeypatch):
    import tarsus.orbits.scored as module

    batch = module.simulate_batch

    def stopped(*words, **options):
        made = batch(*words, **options)
        made.__dict__["codes"] = [ResultCode.STEP_LIMIT if i == 1 else one for i, one in enumerate(made.codes)]
        return made

    monkeypatch.setattr(module, "simulate_batch", stopped)
    rates = {"ground.adhesion.rate": np.array([1e-6, 3e-6])}
    made = scored(SettledMotion(1.0, 2), ts.load_scene("millipede"), rates, SPEED, Shared())
    assert made.code == [ResultCode.STEP_LIMIT, ResultCode.DONE]
    assert np.isnan(made.value[0]).all() and np.isnan(made.over_starts[0]).all() and np.isfinite(made.value[1]).all()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"duration": 0.2}, "duration: a settled motion takes runs of 1 s at least, got 200 ms; an episode"),
        ({"from_rest": 0.2, "duration": 1.0}, "duration: an episode is as long as from_rest says"),
        ({"from_rest": 0.2, "starts": 3}, "starts: an episode from rest has the scene's own start alone"),
        ({"measures": ("stride", "max_heave")}, "measures.1: 'max_heave' is of a whole run from its start"),
        ({"scene": ts.with_values(ts.load_scene("millipede"), {"gait": None})}, "no drive is periodic; .*from_rest"),
    ],
)
def test_what_a_settled_motion_has_not_is_refused(given, said):
    table = {"name": "x", "scene": ts.load_scene("millipede"), "vary": GROUND, "measures": ("stride",)}
    with pytest.raises(ts.InputError, match=said):
        Sweep(**(table | given))


def test_an_episode_lasts_a_drive_period():
    with pytest.raises(ts.InputError, match="expected at least a drive period"):
        motion_asked(0.01, from_rest=0.009)


def test_walkers_are_measured_by_their_settled_motion():
    walker = {"name": "x", "scene": ts.load_scene("millipede"), "vary": GROUND, "measures": ("stride",)}
    assert Sweep(**walker).motion == SettledMotion(1.0, 4)
    assert Sweep(**walker, starts=7, duration=2.0).motion == SettledMotion(2.0, 7)
    assert Sweep(**walker, from_rest="0.2 s").motion == FromRest(0.2)
    slow = walker | {"vary": {"gait.frequency": ["10 Hz", "100 Hz"]}}
    assert Sweep(**slow).motion == SettledMotion(2.0, 4)
    tip = ts.load_scene("cantilever", wave="sine", hz=200, duration="20 ms")
    held = {"name": "x", "scene": tip, "vary": GROUND, "measures": ("peak",)}
    assert Sweep(**held).motion == FromRest(0.02)
    assert Sweep(**held, starts=3).motion == SettledMotion(1.0, 3)
