"""Periodic orbits: oracles 3 and 4, stability in words, gaits modulo their travel, and what cannot be."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm

import tarsus as ts
from scene_files import scene
from sliding_scenes import cantilever
from tarsus.base.events import EventKind
from tarsus.orbits.follow import Follower
from tarsus.orbits.orbit import Orbit, converge
from tarsus.orbits.sequence import sequence_of
from tarsus.solve.run import Shared

TURN = 2.0 * math.pi


@pytest.fixture(scope="module")
def oscillator() -> Orbit:
    return ts.periodic(scene("impact_oscillator"))


def table(gamma: float) -> ts.Scene:
    """Ball on a table, e = 0.5, started on the period-one orbit of that drive amplitude."""
    phase = math.acos(min(math.pi / 3.0 / gamma, 1.0))
    speed = 0.5 - gamma * math.cos(phase) / TURN
    values = {"signals.table.amplitude": gamma, "signals.table.phase": phase, "initial.velocity": [speed]}
    return scene("vibrating_table", values)


@pytest.mark.parametrize("gamma", [1.06, 1.08, 1.2, 1.3, 1.5])
def test_multipliers_of_the_table_are_those_of_its_exact_map(gamma):
    """The ball starts half a period before its impact, at whatever phase of the table: where that is the end of a piece
    of the drive, the impact has a moment of its own all the same. The determinant is e^2, the trace in closed form."""
    found = ts.periodic(table(gamma))
    assert found.kind == "stable, period 1, 1 impact" and found.determinant == pytest.approx(0.25, abs=1e-9)
    sine = math.sqrt(1.0 - (math.pi / 3.0 / gamma) ** 2)
    assert np.sum(found.multipliers).real == pytest.approx(2.25 * (1.0 - gamma * sine) - 1.0, abs=1e-7)


def test_the_impact_oscillator_has_its_published_orbit(oscillator):
    assert oscillator.kind == "stable, period 1, 1 impact"
    (impact,) = oscillator.events
    phase = (oscillator.start + impact["time"]) % TURN
    assert phase == pytest.approx(0.0759521649, abs=1e-9)
    assert impact["speed_before"] == pytest.approx(1.6957329376, abs=1e-9)
    assert impact["speed_after"] == pytest.approx(1.3565863501, abs=1e-9)


def test_its_multipliers_are_those_of_flow_and_saltation(oscillator):
    """x'' = cos t - 0.1 x' - x: the flow over a period, and at the stop x = 1 d(x, v) after an impact by before."""
    phase, before, e = 0.0759521649, 1.6957329376, 0.8
    flow = expm(TURN * np.array([[0.0, 1.0], [-1.0, -0.1]]))
    push = math.cos(phase) - 1.0
    jump = (push + 0.1 * e * before + e * (push - 0.1 * before)) / before
    exact = np.linalg.eigvals(flow @ np.array([[-e, 0.0], [jump, -e]]))
    found = oscillator.multipliers
    assert oscillator.stable and oscillator.determinant == pytest.approx(e**2 * math.exp(-0.1 * TURN), abs=1e-9)
    assert np.sort_complex(found) == pytest.approx(np.sort_complex(exact), abs=1e-9)


def test_behind_its_doubling_the_ball_repeats_after_two_periods():
    """One of a given period is there as well, and unstable."""
    orbit = ts.periodic(table(1.002 * 1.5268237005))
    assert orbit.multiple == 2 and orbit.kind == "stable, period 2, 2 impacts"
    flights = np.diff(orbit.events["time"])
    assert min(flights[0], 2.0 - flights[0]) == pytest.approx(0.97375, abs=1e-5)
    once = ts.periodic(table(1.002 * 1.5268237005), multiple=1)
    assert once.kind == "unstable, period 1, 1 impact" and once.multipliers[0].real < -1.0


@pytest.mark.slow
def test_the_branch_of_the_table_is_born_in_a_fold_and_doubles_in_a_flip():
    up = ts.branch(table(1.5), {"signals.table.amplitude": (1.52, 1.54)}, starts=12)
    (bouncing,) = [one for one in up if one.points[0].orbit.kind == "stable, period 1, 1 impact"]
    flips = [point for point in bouncing.special if point.kind == "flip"]
    assert [point.at for point in flips] == [pytest.approx(math.hypot(math.pi / 3.0, 10.0 / 9.0), abs=1e-9)]
    (doubled,) = [one for one in up if one.points[0] is flips[0]]
    assert doubled.ended == "end of the range" and doubled.points[1].orbit.multiple == 2
    last, alone = doubled.points[-1], ts.periodic(table(1.54))
    assert last.at == 1.54 and last.orbit.kind == alone.kind == "stable, period 2, 2 impacts"
    assert last.orbit.multipliers == pytest.approx(alone.multipliers, abs=1e-9)
    down = ts.branch(table(1.08), {"signals.table.amplitude": (1.08, 1.0)}, starts=0)
    folds = [point for point in down.special if point.kind == "fold"]
    assert folds[0].at == pytest.approx(math.pi / 3.0, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("ends", [(0.099, 0.102), (0.102, 0.099)], ids=["up", "down"])
def test_where_motions_coexist_is_known_from_both_sides(ends):
    """The oscillator's impacts begin in a grazing at 0.1 V upwards, and end in a fold below it downwards: there a plain
    run that is carried down keeps them, where one from rest has none."""
    path, own = "signals.shaker.amplitude", scene("impact_oscillator")
    found = ts.branch(own, {path: ends}, starts=4)
    (both,) = found.coexisting
    assert both.high == pytest.approx(0.1, abs=1e-8) and sorted(both.branches) == [0, 1] and len(found) == 2
    inside, below = 0.5 * (both.low + both.high), both.low - 1e-6
    assert ts.periodic(own, values={path: inside}).impacts == 0
    orbit = ts.periodic(own, values={path: 0.102})
    state, kept = orbit.state, []
    for at in (*np.linspace(0.102, inside, 12).tolist(), both.low + 1e-6, below):
        returns = orbit.map.at_values(own, orbit.start / orbit.map.period, {path: at}, Shared())
        for _ in range(60):
            state = returns(state, 8).state
        kept.append(len(returns(state, 8).events))
    assert min(kept[:-1]) == 8 and kept[-1] < 8


def test_the_oscillator_grazes_at_its_published_amplitude():
    found = ts.branch(scene("impact_oscillator"), {"signals.shaker.amplitude": (0.099, 0.102)}, starts=0)
    assert found.coexisting == () and found.alone == "the scene's own motion alone was followed"
    (grazing,) = [point for point in found.special if point.kind == "grazing"]
    assert grazing.at == pytest.approx(0.1, abs=1e-8)
    assert found[0].points[0].orbit.impacts == 0 and found[-1].points[-1].orbit.impacts == 1


@pytest.mark.slow
@pytest.mark.parametrize(
    ("ends", "changes"),
    [
        # a bounce is captured, the next capture ends in a grazing, and the bounce comes back
        (("60.5 um", "60.3 um"), [("capture", 60.41163), ("grazing", 60.35818), ("capture", 60.33877)]),
        # an impact goes as another comes, of the same events; then a bounce is captured and comes back
        (("60.11 um", "60.06 um"), [("grazing", 60.09325), ("capture", 60.07710), ("capture", 60.07054)]),
    ],
    ids=["apart", "a jump, and a pair that undoes itself"],
)
def test_of_several_changes_close_together_each_is_found(ends, changes):
    """Of a cantilever on which they lie so."""
    linear, cubic, weights = -744.687e-9, 2.99899e-9, (0.0, 0.0, 0.0, -101.518e-9, 0.0, -452.889e-9)
    law = {"constant": -1.23584e-6, "linear": linear, "cubic": cubic, "weights": weights}
    beam = ts.with_values(
        ts.load_scene("cantilever"),
        {
            "robot.structure.damping_ratios": (0.0159319, 0.0651926),
            "robot.drives.pzt.load.participation": (0.0835293, 3.16128),
            "ground.restitution.coefficient": 0.418033,
            "ground.adhesion": {"initial": 314.715e-9, "rate": 1.61306e-6},
            **{f"robot.drives.pzt.law.{name}": value for name, value in law.items()},
        },
    )
    found = ts.branch(beam, {"robot.feet.tip.gap": ends}, starts=0)
    assert [(point.kind, 1e6 * point.at) for point in found.special] == [
        (kind, pytest.approx(at, abs=1e-5)) for kind, at in changes
    ]


def test_a_robot_that_slides_has_orbits_where_all_its_feet_leave_the_ground():
    """The orbit's impacts are those of the run that has settled, slips and sticks in between; a deviation that is no
    direction of its derivative returns as that says."""
    orbit = ts.periodic(cantilever())
    assert orbit.kind == "stable, period 1, 2 impacts, 2 of them held"
    run = ts.simulate(cantilever(), 60 * orbit.period)
    last = run.events[run.events["time"] > 59 * orbit.period]
    assert EventKind.STICK_BEGINS in last["kind"]
    assert list(last["kind"]) == list(orbit.events["kind"])
    np.testing.assert_allclose(last["speed_before"], orbit.events["speed_before"], atol=1e-8)
    free, sizes = orbit.map.free, orbit.map.sizes(orbit.state)
    along = np.array([0.3, -0.7, 0.2, 0.5, -0.1, 0.4])
    back = [orbit.map(orbit.state + step * free @ (sizes * along)).state for step in (-1e-5, 1e-5)]
    slope = (back[1] - back[0]) / 2e-5
    scale = orbit.map.scales(orbit.state)
    np.testing.assert_allclose(slope / scale, orbit.derivative @ (sizes * along) / scale, atol=1e-5)


def test_requests_that_cannot_be_met_get_a_sentence():
    with pytest.raises(ts.InputError, match="no drive is periodic"):
        ts.periodic(scene("ball"))
    with pytest.raises(ts.InputError, match="always on the ground"):
        adhesion = ts.Adhesion(initial=1e-3, rate=0.0)
        ts.periodic(cantilever(restitution=ts.Restitution(coefficient=0.0), adhesion=adhesion))
    with pytest.raises(ts.InputError, match="on level ground alone"):
        stairs = {"kind": "staircase", "tread": 1e-3, "rise": 1e-5}
        ts.periodic(ts.with_values(ts.load_scene("millipede"), {"ground.profile": stairs}))
    with pytest.raises(ts.InputError, match="empty"):
        ts.branch(scene("impact_oscillator"), {"signals.shaker.amplitude": (1.0, 1.0)})
    with pytest.raises(ts.InputError, match="starts: expected 0 or more"):
        ts.branch(scene("impact_oscillator"), {"signals.shaker.amplitude": (0.1, 0.2)}, starts=-1)
    with pytest.raises(ts.InputError, match=r"signals\.shaker\.amplitud"):
        ts.branch(scene("impact_oscillator"), {"signals.shaker.amplitud": (0.5, 1.0)})


@pytest.fixture(scope="module")
def gait() -> Orbit:
    return ts.periodic(ts.load_scene("millipede"))


def test_the_packaged_walker_has_a_stable_gait(gait):
    assert gait.kind.startswith("stable, period 1, 8 impacts, 2 of them held, travels ")
    assert gait.mismatch <= 1e-10 and np.abs(gait.multipliers).max() < 1.0
    run = ts.simulate(gait.scene, 45 * gait.period)
    assert gait.travel == pytest.approx(np.diff(run.marks["body"][:, 0])[-1], rel=1e-7)
    # its events are those of the run, a period on
    start = gait.start
    later = run.events[(run.events["time"] > start) & (run.events["time"] < start + gait.period)]
    assert list(later["kind"]) == list(gait.events["kind"]) and list(later["foot"]) == list(gait.events["foot"])
    np.testing.assert_allclose(later["time"] - start, gait.events["time"], rtol=0, atol=1e-8 * gait.period)


def test_a_gait_goes_on_at_a_higher_voltage_and_at_a_later_section(gait):
    follower = Follower.of(gait, "gait.high", 1.0)
    higher = converge(gait.scene, follower.map(14.2), gait.state, 1)
    assert higher is not None and higher.kind[:28] == gait.kind[:28] and higher.travel > gait.travel
    later, state = gait.map.later(gait.state, gait.events, 1)
    again = converge(gait.scene, later, state, 1)
    assert again is not None and list(later.contacts.held) != list(gait.map.contacts.held)
    assert again.travel == pytest.approx(gait.travel, rel=1e-8)
    np.testing.assert_allclose(np.abs(again.multipliers[0]), np.abs(gait.multipliers[0]), rtol=1e-6)


def test_bounces_that_end_in_a_rest_are_none_of_their_own():
    """Of foot 0 the bounce before its capture stays; foot 1 rests after bounces alone, which lie between those of 0."""
    bounce, capture, release, rest = EventKind.BOUNCE, EventKind.CAPTURE, EventKind.RELEASE, EventKind.REST
    happened = [(0, bounce), (1, bounce), (0, capture), (0, release), (0, bounce), (1, bounce), (0, rest), (1, rest)]
    found = sequence_of(np.array(happened, dtype=[("foot", int), ("kind", int)]))
    assert found == ((0, bounce), (0, capture), (0, release), (0, rest), (1, rest))
