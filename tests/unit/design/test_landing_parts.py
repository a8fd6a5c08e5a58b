"""Parts of soft landings: slopes of touchdowns against differences, transfers against runs, lines of designs."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.design.grounds import Grounds
from tarsus.design.landing_request import LandingSettings, landing_request
from tarsus.design.learning import ArrivalLine, by_bits, by_scalars
from tarsus.design.pulses import families
from tarsus.design.target import LandingObjective, Target, touchdown_pieces
from tarsus.design.transfer import Transfer, _Aim, transfers
from tarsus.design.trials import Landings, Trials

GAP = "robot.feet.tip.gap"


@pytest.fixture(scope="module")
def scene():
    return ts.load_scene("cantilever")


def _made(scene, pairs, levels):
    request = landing_request(scene, LandingSettings(foot="tip", pairs=pairs, levels=levels))
    trials = Trials(scene, "pzt", "tip", request.step.period)
    plain = trials.on(request.step.plain(), Grounds.nominal(scene))
    return request.step, families(request.step, pairs), trials, plain


@pytest.mark.parametrize("objective", [LandingObjective.SPEED, LandingObjective.IMPULSE])
@pytest.mark.parametrize("levels", ["-8 V, 8 V", "free=-8V:8V"])
def test_slopes_of_touchdowns_are_those_of_differences(scene, levels, objective):
    step, choices, trials, plain = _made(scene, 1, levels)
    number = next(i for i, one in enumerate(choices) if one.sizes == (2, 0))
    point = np.array([0.3, 0.35, 0.8, 0.4])[: step.unknowns(1)]
    grounds = Grounds({GAP: np.array([70e-6, 72e-6])}, np.full(2, 0.5))
    target = Target(objective, plain)
    found = touchdown_pieces(trials, step, target, choices, (number, point), grounds)
    assert found.complete and set(found.ground.tolist()) <= {0, 1}

    def hardest(points):
        placed = step.place(choices, np.full(len(points), number), points)
        return target.measure(trials.on(placed, grounds))

    for ground in sorted(set(found.ground.tolist())):
        own = np.flatnonzero(found.ground == ground)
        top = own[np.argmax(found.values[own])]
        assert found.values[top] == pytest.approx(hardest(point[None])[0, ground], rel=1e-4)
        far = 2e-4 * np.eye(len(point))
        slopes = (hardest(point + far) - hardest(point - far))[:, ground] / 4e-4
        assert found.slopes[top] == pytest.approx(slopes, rel=2e-2, abs=2e-2 * np.abs(slopes).max())


@pytest.mark.parametrize(
    ("pairs", "levels", "gentle"),
    [
        (2, "-8 V, 8 V", True),
        pytest.param(1, "-8 V, 8 V", False, marks=pytest.mark.slow),
        (1, "free=-8V:8V", True),
    ],
)
def test_four_unknowns_bring_the_structure_to_rest_on_the_ground_and_two_do_not(scene, pairs, levels, gentle):
    step, choices, trials, plain = _made(scene, pairs, levels)
    wanted = 0.02 * float(plain.speed[0, 0])
    transfer = Transfer.of(scene, "pzt", "tip", step, wanted)
    numbers, points = transfers(transfer, step, choices, trials, np.random.default_rng(1))
    found = trials.on(step.place(choices, numbers, points), Grounds.nominal(scene))
    best = int(np.argmin(found.speed[:, 0]))
    if gentle:
        assert found.speed[best, 0] == pytest.approx(wanted, rel=0.2) and found.touchdowns[best, 0] == 1.0
    else:
        assert found.speed[best, 0] > 0.17


@pytest.mark.parametrize("levels", ["-8 V, 8 V", "free=-8V:8V"])
def test_what_a_transfer_leaves_has_exact_slopes(scene, levels):
    step, choices, _, _ = _made(scene, 2, levels)
    transfer = Transfer.of(scene, "pzt", "tip", step, 0.01)
    aim = _Aim(transfer, step, next(one for one in choices if one.sizes == (2, 2)))
    x = np.random.default_rng(2).uniform(0.1, 0.9, (5, 1 + step.unknowns(2)))
    left, slopes = aim.slopes(x)
    np.testing.assert_allclose(left, aim.left(x), rtol=1e-12, atol=1e-12 * np.abs(left).max())
    for i, far in enumerate(1e-6 * np.eye(x.shape[1])):
        told = (aim.left(x + far) - aim.left(x - far)) / 2e-6
        np.testing.assert_allclose(slopes[:, :, i], told, rtol=1e-5, atol=1e-6 * np.abs(slopes).max())


def test_a_structure_that_does_not_rest_by_itself_has_no_transfers(scene):
    step, _, _, _ = _made(scene, 1, "-8 V, 8 V")
    assert Transfer.of(ts.with_values(scene, {}), "pzt", "tip", step, 0.01) is not None
    walker = ts.load_scene("millipede-printed")
    drive, foot = next(iter(walker.robot.drives)), next(iter(walker.robot.feet))
    assert Transfer.of(walker, drive, foot, step, 0.01) is None


def test_halving_a_line_finds_the_place_of_every_ground():
    line = ArrivalLine(np.linspace(1.0, 2.0, 9)[:, None], np.linspace(1e-3, 2e-3, 9))
    grounds = np.random.default_rng(0).uniform(0.05, 0.95, 50)
    played = []

    def step(durations):
        place = durations[:, 0] - 1.0
        played.append(place)
        # a foot that aims too near arrives half a millisecond too late, else in time
        first = 1e-3 * (1.0 + place) + np.where(place < grounds, 5e-4, 0.0)
        speed = np.where(place < grounds, 1.0, place - grounds)
        return Landings(*(speed,) * 3, first, *(speed,) * 3)

    speeds = by_bits(line, step, 50, 12, step(np.full((50, 1), 1.5)))
    assert len(speeds) == 13
    assert (np.abs(played[-1] - grounds) <= 1.0 / 32.0).all() and (speeds[-1] <= 1.0 / 32.0).all()


def test_a_scalar_finds_the_place_of_every_ground_from_both_sides():
    """The softest place of a line, a third as steep on its one side as on the other."""
    line = ArrivalLine(np.linspace(1.0, 2.0, 9)[:, None], np.linspace(1e-3, 2e-3, 9))
    grounds = np.random.default_rng(0).uniform(0.0, 1.0, 50)

    def step(durations):
        far = durations[:, 0] - 1.0 - grounds
        return Landings(*(np.where(far < 0.0, -3.0 * far, far),) * 7)

    target = Target(LandingObjective.SPEED, step(np.full((50, 1), 1.5)))
    speeds, best, softest = by_scalars(line, step, target, 50, 40)
    assert len(speeds) < 20 and (np.abs(best[:, 0] - 1.0 - grounds) < 1.0 / 32.0).all()
    assert np.array_equal(softest, np.min(speeds, axis=0)) and np.array_equal(step(best).speed, softest)
