"""Every example runs, and a number from it is right."""

from __future__ import annotations

import math

import numpy as np
import pytest

import tarsus as ts
from example_files import EXAMPLES, load


def test_bouncing_ball():
    example = load("bouncing_ball")
    assert example.impact_times(0.9)[1] == pytest.approx(1.264266194760045, rel=1e-14)
    assert example.largest_error() < 1e-10
    fall = math.sqrt(2.0 / 9.81)
    assert example.time_of_rest(0.7) == pytest.approx(fall * (1.0 + 0.7) / (1.0 - 0.7), rel=1e-6)


def test_the_least_clearance_is_the_deepest_swing_less_what_the_film_takes():
    example = load("clearance")
    assert 0.998 < example.least_clearance(halvings=18) / example.deepest_swing() < 1.0


def test_a_weak_magnet_does_the_work_of_its_potential():
    """While the foot is in flight, the work is K/3 (1/(g + d)^3) between the ends: no history in it."""
    example = load("own_law")
    run = example.run_with_magnet(1e-24, duration=0.004)
    magnet = run.scene.ground.laws["magnet"]
    gap = run.to_dataset()["gap"].values[0]

    def potential(g: float) -> float:
        return -magnet.strength / (3.0 * (g + magnet.offset) ** 3)

    assert run.ok and run.ledger.closure < 1e-8
    assert example.run_with_magnet(0.0, duration=0.004).ledger.laws["magnet"] == 0.0
    assert run.ledger.laws["magnet"] == pytest.approx(potential(gap[0]) - potential(gap[-1]), rel=1e-6)
    assert ts.get_value(run.scene, "ground.laws.magnet.strength") == 1e-24


def test_film_sweep():
    example = load("film_sweep")
    counts = example.impacts_over_film(np.array([0.1, 1.0, 1e7]))
    assert counts.shape == (3,)
    assert counts[2] == 0  # a film that thick keeps the foot off the ground

    alone = ts.simulate(ts.load_scene("cantilever", volts=8, hz=50, wave="square"), duration=0.1)
    assert counts[1] == np.count_nonzero(np.isin(alone.events["kind"], (1, 2)))


@pytest.mark.full
def test_own_data_and_an_own_measure_are_fitted():
    result = load("own_fit").result
    assert result.values["robot.feet.tip.gap"] == pytest.approx(71e-6, rel=1e-5)
    linear = "robot.drives.pzt.law.linear"
    assert result.values[linear] == pytest.approx(ts.get_value(ts.load_scene("cantilever"), linear), rel=1e-4)
    assert result.ranges[0].verdict == "determined"
    assert "71" in str(result) and abs(result.correlations[0, 1]) > 0.5


def test_every_example_is_in_a_test():
    tests = "".join(path.read_text(encoding="utf-8") for path in EXAMPLES.parent.glob("tests/**/test_*.py"))
    for path in EXAMPLES.glob("*.py"):
        assert f'load("{path.stem}")' in tests or path.name in tests, f"{path.name} has no test"


def test_a_policy_that_feels_nothing_is_the_gait_of_the_device():
    """In steps of a hundredth of a second it gets as far as the run in one piece."""
    example = load("learn_gait")
    gaits = example.Gaits(1, 2)
    world = gaits.world()
    (ways,) = gaits.ways(world, example.open_loop()[None], seed=4)
    grounds = gaits.drawn(np.random.default_rng(4), 2)
    vary = {path: of.tolist() for path, of in grounds.items()}
    whole = ts.simulate_batch("hexapod-walker", vary, example.PERIODS * example.PERIOD)
    for way, run in zip(ways, range(2), strict=True):
        assert way == pytest.approx(1e6 * whole.run(run).marks["body"][-1, 0], rel=1e-4)
        assert 5.0 < way < 40.0


@pytest.mark.full
def test_a_gait_is_learnt_on_grounds_that_are_not_known():
    example = load("learn_gait")
    wave = example.best_wave(grounds=2)
    learnt, _, straight, own = example.judged(example.trained(5, grounds=2, policies=10), wave, grounds=10)
    assert learnt.mean() > 3.0 * own.mean() and straight.mean() > 3.0 * own.mean()
    assert np.mean(learnt > own) > 0.9
