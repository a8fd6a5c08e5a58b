"""Derivatives of runs in closed form, what they are where numbers are zero or at rest, and where there are none."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import numpy as np
import pytest

import tarsus as ts
from laboratory import LABORATORY
from printed_robots import hexapod
from scene_files import scene as scene_of
from tarsus.base.spec import with_values
from tarsus.model.drive.waveforms import Sampled
from tarsus.model.scene import Foot, Initial, Robot, Standing
from tarsus.model.standing import rest_state
from tarsus.model.structure import Walker, WalkerBody, WalkerLeg
from walking_scenes import GRAVITY, block, moving, sticky

MU, GRAV = "ground.friction.coefficient", "ground.gravity.acceleration"


def test_a_bouncing_ball_in_closed_form():
    height, e, g = 1.0, 0.9, 9.81
    paths = ("robot.feet.ball.gap", "ground.restitution.coefficient", "ground.gravity.acceleration")
    run = ts.simulate(scene_of("ball"), 4.0, gradients=paths)
    count = len(run.events)
    assert count == 6
    fall = np.sqrt(2.0 * height / g)
    powers = e ** np.arange(1, count)
    # t_n = fall (1 + 2 sum_k e^k), v_n = e^(n - 1) sqrt(2 g h)
    times = fall * (1.0 + 2.0 * np.concatenate([[0.0], np.cumsum(powers)]))
    by_e = 2.0 * fall * np.concatenate([[0.0], np.cumsum(np.arange(1, count) * e ** np.arange(count - 1))])
    speeds = np.sqrt(2.0 * g * height) * e ** np.arange(count)
    np.testing.assert_allclose(run.events["time"], times, rtol=1e-12)
    gap, restitution, gravity = (run.event_gradients[path] for path in paths)
    np.testing.assert_allclose(gap["time"], times / (2.0 * height), rtol=1e-6)
    np.testing.assert_allclose(gap["speed_before"], speeds / (2.0 * height), rtol=1e-6)
    np.testing.assert_allclose(gravity["time"], -times / (2.0 * g), rtol=1e-6)
    np.testing.assert_allclose(restitution["time"], by_e, rtol=1e-6, atol=1e-13)
    np.testing.assert_allclose(restitution["speed_after"], speeds * np.arange(1, count + 1), rtol=1e-6)
    apexes = height * e ** (2.0 * np.arange(count))
    np.testing.assert_allclose(gap["apex"][1:], apexes[1:] / height, rtol=1e-6)
    # energy that impacts have taken: m g h (1 - e^2n)
    lost = run.gradient("ledger.impacts")
    assert lost[paths[0]] == pytest.approx(g * (1.0 - e ** (2 * count)), rel=1e-6)
    assert lost[paths[1]] == pytest.approx(-2.0 * count * g * height * e ** (2 * count - 1), rel=1e-6)
    assert not run.flags


def test_a_sliding_block_stopped_by_friction():
    speed, mu = 0.01, 0.3
    path = "initial.velocity.2"
    run = ts.simulate(moving(block(), block_x=speed), 0.02, gradients=[MU, GRAV, path])
    assert list(run.events["kind"]) == [5, 8] and not run.flags
    way = speed**2 / (2.0 * mu * GRAVITY)
    slid = {one: found.x[2, 0] for one, found in run.state_gradients([0.019]).items()}
    assert slid[MU] == pytest.approx(-way / mu, rel=1e-6)
    assert slid[GRAV] == pytest.approx(-way / GRAVITY, rel=1e-6)
    assert slid[path] == pytest.approx(2.0 * way / speed, rel=1e-6)
    stopped = {one: found["time"][1] for one, found in run.event_gradients.items()}
    assert stopped[MU] == pytest.approx(-speed / (mu**2 * GRAVITY), rel=1e-6)
    assert stopped[path] == pytest.approx(1.0 / (mu * GRAVITY), rel=1e-6)
    # friction takes all of m v^2 / 2, whatever it is
    taken = run.gradient("ledger.friction")
    assert taken[path] == pytest.approx(1e-6 * speed, rel=1e-6)
    assert taken[MU] == pytest.approx(0.0, abs=1e-8 * 1e-6 * speed**2)


HEXAPOD = {
    "robot.structure.stiffness.2.3": (
        (-1.3680837116775597e-7, 1.643402096569237e-6, 3.5512199221683482e-6),
        (-0.00022021201356458361, -0.00018316992156298874, -0.00016356273019473369),
    ),
    "robot.structure.damping.1.1": (
        (-0.0020083506418345883, -0.015214460582107986, -0.028315618406742927),
        (-4.6064155291954458, -3.8314849560492329, -1.8076674113230378),
    ),
    "robot.structure.mass.3.3": (
        (107.96262728074134, 95.749526867537202, 81.53610687938052),
        (-6322.9826999484187, -7603.1436540844578, -3130.3778942423436),
    ),
}
"""Derivatives of time [s] and speed [m/s] of the first three impacts of the printed hexapod under a constant force: the
exponential of its state matrix, Newton's method for the impacts and central differences of 1e-15, all in 50 digits."""


def test_numbers_of_a_lumped_hexapod_as_in_fifty_digits():
    """Its stiffnesses nearly cancel: its slowest mode has 2e-3 of the fastest's rate."""
    scene = hexapod(signal=ts.Constant(level=-10.0), gap=4e-6, restitution=0.5)
    run = ts.simulate(scene, 7e-4, gradients=list(HEXAPOD))
    for path, wanted in HEXAPOD.items():
        for name, want in zip(("time", "speed_before"), wanted, strict=True):
            got = run.event_gradients[path][name][:3]
            assert np.abs(got - want).max() <= 1e-7 * np.abs(want).max(), (path, name)


def test_a_stiffness_that_couples_coinciding_modes():
    """Of x'' + w^2 x + k y = 0 and the like for y, from x = 1, y = 0: dy/dk = -t sin(w t) / 2w where k = 0."""
    structure = ts.Lumped(coordinates=("a", "b"), mass=(1.0, 1.0), stiffness=(4.0, 4.0))
    scene = ts.Scene(
        name="two",
        robot=ts.Robot(structure=structure, drives={}, feet={"b": ts.Foot(point="b", gap=10.0)}),
        ground=ts.Ground(restitution=ts.Restitution(coefficient=0.6)),
        initial=ts.Initial(displacement=(1.0, 0.0)),
        duration=20.0,
    )
    coupled = {f"robot.structure.stiffness.{ends}": 1.0 for ends in ("0.1", "1.0")}
    run = ts.simulate(scene, gradients={"coupling": coupled})
    times = np.linspace(0.1, 19.9, 45)
    got = run.state_gradients(times)["coupling"]
    np.testing.assert_allclose(got.x[1], -times * np.sin(2.0 * times) / 4.0, atol=1e-11)
    np.testing.assert_allclose(got.x[0], 0.0, atol=1e-11)


def test_rounding_of_a_state_at_rest_is_no_kink():
    """Speeds at rest are sums of modes that cancel, up to rounding that copies of a run need not share."""
    scene = ts.load_scene(LABORATORY)
    loops = Sampled(times=(0.0, 0.286, 0.857), levels=(0.0, -8.0, 8.0))
    begun = with_values(scene, {"signals": {"pzt": loops}, "initial.displacement": rest_state(scene)})
    path = "robot.structure.damping_ratios.0"
    run = ts.simulate(begun, 0.7, gradients=[path])
    slopes = run.state_gradients(np.linspace(0.0, 0.69, 50))[path]
    assert np.isfinite(slopes.x).all() and np.isfinite(slopes.v).all()
    assert np.abs(slopes.v[:, 0]).max() < 1e-12 < np.abs(slopes.v).max()


def one_legged(mass: float, stiff: float, damping: float, start: Initial) -> ts.Scene:
    leg = WalkerLeg(mass=1e-9, stiffness_v=stiff, damping_v=damping, stiffness_l=1.0, damping_l=0.0)
    walker = Walker(body=WalkerBody(mass=mass), legs={"leg": leg})
    robot = Robot(structure=walker, drives={}, feet={"leg": Foot(point="leg", gap=0.0)})
    return ts.Scene(name="standing", robot=robot, ground=sticky(adhesion=None), initial=start, duration=0.05)


def test_derivatives_by_a_state_at_rest_swing_though_the_run_does_not():
    mass, stiff, damping = 1e-6, 2.0, 1e-4
    start = Initial(displacement=(0.0, -mass * GRAVITY / stiff, 0.0, 0.0), velocity=(0.0,) * 4)
    run = ts.simulate(one_legged(mass, stiff, damping, start), gradients=["initial.velocity.1"])
    times = np.linspace(0.001, 0.05, 20)
    assert np.ptp(run.states(times).x[1]) < 1e-15
    decay = damping / 2.0 / mass
    turn = math.sqrt(stiff / mass - decay**2)
    heave = run.state_gradients(times)["initial.velocity.1"].x[1]
    np.testing.assert_allclose(heave, np.exp(-decay * times) * np.sin(turn * times) / turn, atol=1e-8 / turn)


def test_a_standing_robot_sinks_by_its_mass():
    mass, stiff = 1e-6, 2.0
    scene = one_legged(mass, stiff, 1e-4, Initial(standing=Standing()))
    by_mass, by_stiffness = "robot.structure.body.mass", "robot.structure.legs.leg.stiffness_v"
    run = ts.simulate(scene, gradients=[by_mass, by_stiffness])
    found = run.state_gradients(np.linspace(0.001, 0.049, 7))
    np.testing.assert_allclose(found[by_mass].x[1], -GRAVITY / stiff, rtol=1e-6)
    np.testing.assert_allclose(found[by_stiffness].x[1], mass * GRAVITY / stiff**2, rtol=1e-6)
    np.testing.assert_allclose(found[by_mass].pull[0], -GRAVITY, rtol=1e-6)


def test_a_displacement_of_zero_varies_by_a_length_of_the_scene():
    """Not by one of 1 m, which would put a foot a micrometre above the ground below it; x = x0 cos wt."""
    scene = ts.Scene(
        name="small",
        robot=ts.Robot(
            structure=ts.Lumped(coordinates=("a",), mass=(1.0,), stiffness=(4.0,), weights={"tip": (1e3,)}),
            feet={"tip": ts.Foot(point="tip", gap=1e-6)},
        ),
        ground=ts.Ground(restitution=ts.Restitution(coefficient=0.5)),
        initial=ts.Initial(displacement=(0.0,), velocity=(1e-10,)),
        duration=3.0,
    )
    times = np.linspace(0.1, 2.9, 7)
    run = ts.simulate(scene, gradients=["initial.displacement.0"])
    got = run.state_gradients(times)["initial.displacement.0"].x[0]
    np.testing.assert_allclose(got, np.cos(2.0 * times), atol=1e-11)


def test_a_batch_has_the_gradients_of_its_runs():
    scene, path = scene_of("ball"), "robot.feet.ball.gap"
    batch = ts.simulate_batch(scene, {"ground.restitution.coefficient": [0.5, 0.8]}, 3.0, gradients=[path])
    assert isinstance(batch, ts.solve.GradientBatch)
    found = batch.gradient("hardest_impact")[path]
    assert found.shape == (2,)
    np.testing.assert_allclose(found, np.sqrt(2.0 * 9.81) / 2.0, rtol=1e-6)
    first = ts.gradient(lambda events: events["time"][0], scene, [path], 3.0)[path]
    assert first == pytest.approx(1.0 / np.sqrt(2.0 * 9.81), rel=1e-6)


def test_an_objective_of_events_and_of_states_at_times():
    scene, times = scene_of("p1_n2"), [0.011, 0.0305]
    paths = ["ground.film.coefficient", "signals.pull.duty", "robot.feet.tip.gap"]

    def squares(events, states):
        return float((states.x**2).sum() + states.v[0, 1] + events["time"][3])

    found = ts.gradient(squares, scene, paths, 0.04, times=times)
    run = ts.simulate(scene, 0.04, gradients=paths)
    states, moved = run.states(times), run.state_gradients(times)
    for path in paths:
        wanted = 2.0 * (states.x * moved[path].x).sum() + moved[path].v[0, 1] + run.event_gradients[path]["time"][3]
        assert found[path] == pytest.approx(wanted, rel=1e-6)


def test_threads_may_ask_one_run_for_derivatives_by_its_structure():
    """The runs beside it are made when first asked for, here by all of them at once."""
    path, times = "robot.structure.mass.0.0", np.linspace(1e-3, 0.019, 20)
    wanted = ts.simulate(scene_of("three_feet"), 0.02, gradients=[path]).state_gradients(times)[path].x
    for _ in range(3):
        run, begin = ts.simulate(scene_of("three_feet"), 0.02, gradients=[path]), Barrier(8)

        def ask(run: ts.solve.GradientRun = run, begin: Barrier = begin) -> np.ndarray:
            begin.wait()
            return run.state_gradients(times)[path].x

        with ThreadPoolExecutor(8) as pool:
            found = [one.result() for one in [pool.submit(ask) for _ in range(8)]]
        assert all(np.array_equal(one, wanted) for one in found)


def test_where_there_is_no_derivative_a_sentence_says_so():
    # an edge of the drive at the very start acts only if it comes later
    run = ts.simulate(scene_of("p1_n2"), 0.03, gradients=["signals.pull.phase", "ground.film.coefficient"])
    assert list(run.flags) == ["signals.pull.phase"]
    found = run.gradient("contact_duration")
    assert np.isnan(found["signals.pull.phase"]) and np.isfinite(found["ground.film.coefficient"])
    assert "an edge or a threshold lies there" in found.flags["signals.pull.phase"][0]
    assert np.isfinite(found.one_sided["signals.pull.phase"])
    assert np.isnan(run.event_gradients["signals.pull.phase"]["time"]).all()


def two_balls(**gaps: float) -> ts.Scene:
    """Two masses on a common spring above the ground."""
    structure = ts.Lumped(
        coordinates=("a", "b"),
        mass=((1.0, 0.2), (0.2, 1.0)),
        stiffness=((0.0, 0.0), (0.0, 0.0)),
        damping=((0.0, 0.0), (0.0, 0.0)),
    )
    feet = {name: ts.Foot(point=name, gap=gaps.get(name, 1.0)) for name in ("a", "b")}
    ground = ts.Ground(restitution=ts.Restitution(coefficient=0.6))
    start = ts.Initial(velocity=(-1.0, -1.0))
    return ts.Scene(
        name="two",
        robot=ts.Robot(structure=structure, drives={}, feet=feet),
        ground=ground,
        initial=start,
        duration=1.5,
    )


def test_feet_that_land_together_have_the_derivatives_that_leave_them_together():
    paths = ("robot.feet.a.gap", "ground.restitution.coefficient")
    together = ts.simulate(two_balls(), gradients=paths)
    assert len(together.events) >= 2 and np.ptp(together.events["time"][:2]) < 1e-12
    # one gap alone tears the impacts apart, to each side otherwise; both leave at e times the speed that they come with
    assert list(together.flags) == ["robot.feet.a.gap"]
    np.testing.assert_allclose(together.event_gradients[paths[1]]["speed_after"][:2], 1.0, rtol=1e-6)
    apart = ts.simulate(two_balls(a=1.0, b=1.001), gradients=paths)
    assert not apart.flags


def test_a_landing_at_the_threshold_of_the_pull_as_printed_has_no_derivative():
    mass, stiffness, damping, gap, e = 2e-9, 1.5, 2e-4, 1e-6, 0.5
    robot = ts.Robot(
        structure=ts.Lumped(coordinates=("a",), mass=(mass,), stiffness=(stiffness,), damping=(damping,)),
        drives={},
        feet={"a": ts.Foot(point="a", gap=gap)},
    )

    def landed(adhesion: float) -> ts.solve.GradientRun:
        ground = ts.Ground(
            restitution=ts.Restitution(coefficient=e),
            adhesion=ts.Adhesion(initial=adhesion, rate=0.0),
            landing=ts.laws.PullAsPrinted(),
        )
        scene = ts.Scene(name="hung", robot=robot, ground=ground, initial=ts.Initial(velocity=(-0.5,)), duration=4e-6)
        run = ts.simulate(scene, gradients=["ground.restitution.coefficient"])
        assert isinstance(run, ts.solve.GradientRun)
        return run

    # (2.13): -k g + c e v
    printed = -stiffness * gap + damping * e * landed(0.0).events["speed_before"][0]
    assert not landed(0.999 * printed).flags
    said = landed(printed * (1.0 + 1e-9)).flags["ground.restitution.coefficient"][0]
    assert "touches or leaves the ground otherwise" in said


def test_where_a_walker_has_no_derivative_a_sentence_says_so():
    """A block at rest would be stopped by friction whichever way it began to move; another starts at a corner."""
    rest = ts.simulate(moving(block(), block_x=0.0), 0.01, gradients=["initial.velocity.2"])
    assert "otherwise" in rest.flags["initial.velocity.2"][0]
    stairs = {"kind": "staircase", "tread": 1e-3, "rise": -1e-4, "start": 0.0}
    scene = with_values(block(), {"ground.profile": stairs, "robot.feet.block.gap": 1e-3})
    flags = ts.simulate(scene, 0.02, gradients=["ground.profile.start"]).flags
    assert "otherwise" in flags["ground.profile.start"][0]


def swinging(gap: float) -> ts.Scene:
    """A leg of a body too heavy to feel it swings from 0.5 m/s down, its spring's rest a gap above the ground."""
    leg = WalkerLeg(mass=2e-9, stiffness_v=1.5, damping_v=0.0, stiffness_l=1.5, damping_l=0.0)
    walker = Walker(body=WalkerBody(mass=1e4), legs={"foot": leg})
    return ts.Scene(
        name="swinging",
        robot=Robot(structure=walker, drives={}, feet={"foot": Foot(point="foot", gap=gap)}),
        ground=ts.Ground(restitution=ts.Restitution(coefficient=0.5)),
        initial=Initial(velocity=tuple(-0.5 * walker.row("foot"))),
        duration=1e-3,
    )


def free(gap: float) -> ts.Scene:
    """A mass on a spring that swings by 1 m: no film or drive keeps its steps shorter than several radians."""
    structure = ts.Lumped(coordinates=("a",), mass=(1.0,), stiffness=(1.0,))
    return ts.Scene(
        name="free",
        robot=Robot(structure=structure, feet={"foot": Foot(point="a", gap=gap)}),
        ground=ts.Ground(restitution=ts.Restitution(coefficient=0.5)),
        initial=Initial(displacement=(0.6,), velocity=(0.8,)),
        duration=30.0,
    )


@pytest.mark.parametrize(("make", "reach"), [(swinging, 0.5 * math.sqrt(2e-9 / 1.5)), (free, 1.0)])
@pytest.mark.parametrize("part", [-1e-9, 1e-9, -1e-6, 1e-6])
def test_a_grazing_touchdown_and_a_near_miss_have_no_derivative(make, reach, part):
    """It turns a part of its way above the ground, or would turn below it."""
    path, near = "robot.feet.foot.gap", abs(part) < 1e-7
    run = ts.simulate(make(reach * (1.0 + part)), gradients=[path])
    assert (len(run.events) == 0) == (part > 0.0)
    assert near == any("touches or leaves" in said for said in run.flags.get(path, ()))
    assert np.isnan(run.event_gradients[path]["time"]).all() or not near


def test_motion_in_the_air_has_derivatives_at_every_moment() -> None:
    """Also at the edges of a square wave, and where a derivative is far below the largest that it has later."""
    scene = with_values(ts.load_scene("cantilever", wave="square"), {"robot.feet.tip.gap": 1e-3})
    paths = ["robot.structure.frequencies.0", "robot.structure.frequencies.1", "robot.drives.pzt.law.weights.0"]
    run = ts.simulate(scene, 0.02, gradients=paths)
    assert len(run.events) == 0 and not run.flags
    for found in run.state_gradients(np.linspace(0.0, 0.02, 900)).values():
        assert np.isfinite(found.x).all() and np.isfinite(found.v).all() and found.v.any()
