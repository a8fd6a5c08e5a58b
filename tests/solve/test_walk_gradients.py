"""Derivatives of walkers' runs against closed forms and against differences of tight runs."""

from __future__ import annotations

import math

import numpy as np
import pytest

import tarsus as ts
from differences import assert_as_differences, runs_around, slope
from tarsus.model.scene import Foot, Initial, Robot, Standing
from tarsus.model.structure import Walker, WalkerBody, WalkerLeg
from walking_scenes import GRAVITY, block, moving, sticky, trotter

MU, GRAV = "ground.friction.coefficient", "ground.gravity.acceleration"
MASS = 1e-6  # of the block [kg]


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
    assert taken[path] == pytest.approx(MASS * speed, rel=1e-6)
    assert taken[MU] == pytest.approx(0.0, abs=1e-8 * MASS * speed**2)


def falling(height: float, along: float, **changes) -> ts.Scene:
    """The block thrown along from a height."""
    scene = moving(block(**changes), block_x=along)
    return scene.model_copy(
        update={"initial": Initial(displacement=(0.0, 0.0, 0.0, height), velocity=scene.initial.velocity)}
    )


def test_a_block_that_strikes_the_ground_aslant_bounces_in_closed_form():
    height, along, e, mu = 1e-3, 0.2, 0.5, 0.3
    paths = ("ground.restitution.coefficient", MU, GRAV, "initial.displacement.3")
    fall = math.sqrt(2.0 * height / GRAVITY)
    second = fall * (1.0 + 2.0 * e)
    run = ts.simulate(falling(height, along), second * 1.2, gradients=paths)
    assert list(run.events["kind"]) == [1, 1] and not run.flags
    by_e, by_mu, by_g, by_h = (run.event_gradients[path] for path in paths)
    np.testing.assert_allclose(by_e["time"], [0.0, 2.0 * fall], rtol=1e-6, atol=1e-14)
    np.testing.assert_allclose(by_g["time"], [-fall / 2.0 / GRAVITY, -second / 2.0 / GRAVITY], rtol=1e-6)
    np.testing.assert_allclose(by_h["time"], [fall / 2.0 / height, second / 2.0 / height], rtol=1e-6)
    np.testing.assert_allclose(by_mu["time"], 0.0, atol=1e-14)
    # along: v - mu (1 + e) w after the first impact, at w = sqrt(2 g h)
    strike, at = math.sqrt(2.0 * GRAVITY * height), 1.5 * fall
    found = run.state_gradients([at])
    assert found[MU].v[2, 0] == pytest.approx(-(1.0 + e) * strike, rel=1e-6)
    assert found[paths[0]].v[2, 0] == pytest.approx(-mu * strike, rel=1e-6)
    assert found[MU].x[2, 0] == pytest.approx(-(1.0 + e) * strike * (at - fall), rel=1e-6)
    # x = v t - mu (1 + e) w (t - t1), with dt1/dh = t1 / 2h and dw/dh = w / 2h
    by_height = -mu * (1.0 + e) * strike / (2.0 * height) * (at - fall - fall)
    assert found[paths[3]].x[2, 0] == pytest.approx(by_height, rel=1e-6)
    apex = e**2 * height
    np.testing.assert_allclose(by_h["apex"][1], apex / height, rtol=1e-6)
    np.testing.assert_allclose(by_e["apex"][1], 2.0 * e * height, rtol=1e-6)


def test_a_block_begins_to_slide_when_the_drive_says():
    amplitude, frequency, mu = 8e-6, 30.0, 0.3
    paths = (MU, "signals.along.amplitude", "signals.along.frequency")
    scene = block(signals={"along": ts.Sine(amplitude=amplitude, frequency=frequency)})
    run = ts.simulate(scene, 0.012, gradients=paths)
    assert list(run.events["kind"]) == [5, 7]
    share, turn = mu * MASS * GRAVITY / amplitude, 2.0 * math.pi * frequency
    moment, rate = math.asin(share) / turn, amplitude * turn * math.sqrt(1.0 - share**2)
    assert run.events["time"][1] == pytest.approx(moment, rel=1e-6)
    got = [run.event_gradients[path]["time"][1] for path in paths]
    assert got == pytest.approx(
        [MASS * GRAVITY / rate, -amplitude * share / rate / amplitude, -moment / frequency], rel=1e-6
    )


def test_derivatives_by_a_state_at_rest_swing_though_the_run_does_not():
    mass, stiff, damping = 1e-6, 2.0, 1e-4
    leg = WalkerLeg(mass=1e-9, stiffness_v=stiff, damping_v=damping, stiffness_l=1.0, damping_l=0.0)
    walker = Walker(body=WalkerBody(mass=mass), legs={"leg": leg})
    scene = ts.Scene(
        name="standing",
        robot=Robot(structure=walker, drives={}, feet={"leg": Foot(point="leg", gap=0.0)}),
        ground=sticky(adhesion=None),
        initial=Initial(displacement=(0.0, -mass * GRAVITY / stiff, 0.0, 0.0), velocity=(0.0,) * 4),
        duration=0.05,
    )  # fmt: skip
    run = ts.simulate(scene, gradients=["initial.velocity.1"])
    times = np.linspace(0.001, 0.05, 20)
    assert np.ptp(run.states(times).x[1]) < 1e-15
    decay = damping / 2.0 / mass
    turn = math.sqrt(stiff / mass - decay**2)
    heave = run.state_gradients(times)["initial.velocity.1"].x[1]
    np.testing.assert_allclose(heave, np.exp(-decay * times) * np.sin(turn * times) / turn, atol=1e-8 / turn)


def rubbing(tmp_path, coefficient: float, growth: float) -> dict[str, ts.laws.Law]:
    """A friction that grows with the slip speed: margin (coefficient + growth speed)."""
    file = tmp_path / "rubbing.py"
    file.write_text(
        "from tarsus.base.spec import quantity\nfrom tarsus.model.laws import FrictionLaw\n\n\n"
        "class Rubbing(FrictionLaw):\n"
        '    coefficient: float = quantity("1", "at rest", ge=0)\n'
        '    growth: float = quantity("s/m", "with the speed", ge=0)\n\n'
        "    def bound(margin, strength, speed, coefficient, growth):\n"
        "        return margin * (coefficient + growth * speed)\n"
    )
    return {"rubbing": ts.load_laws(file)["rubbing"](coefficient=coefficient, growth=growth)}


def test_friction_that_depends_on_the_slip_speed_in_closed_form(tmp_path):
    """m v' = -m g (mu + c v): v + mu / c falls like exp(-c g t), and the block stops at log(1 + c v / mu) / c g."""
    speed, mu, growth, at = 0.01, 0.3, 25.0, 2e-3
    ground = ts.Ground(gravity=ts.Gravity(acceleration=GRAVITY), laws=rubbing(tmp_path, mu, growth))
    paths = ["ground.laws.rubbing.coefficient", "ground.laws.rubbing.growth", "initial.velocity.2"]
    run = ts.simulate(moving(block(friction=None, ground=ground), block_x=speed), 0.02, gradients=paths)
    assert list(run.events["kind"]) == [5, 8] and not run.flags
    rate, left = growth * GRAVITY, 1.0 + growth * speed / mu
    stopped = [run.event_gradients[path]["time"][1] for path in paths]
    by_growth = speed / (mu * left * rate) - math.log(left) / (rate * growth)
    wanted = [-growth * speed / (mu**2 * left * rate), by_growth, 1.0 / (mu * left * GRAVITY)]
    assert stopped == pytest.approx(wanted, rel=1e-6)
    fall = math.exp(-rate * at)
    slowed = [found.v[2, 0] for found in run.state_gradients([at]).values()]
    by_growth = -(speed + mu / growth) * GRAVITY * at * fall + mu / growth**2 * (1.0 - fall)
    assert slowed == pytest.approx([(fall - 1.0) / growth, by_growth, fall], rel=1e-6)


def test_a_trotter_on_friction_by_speed_differs_as_its_derivatives_say(tmp_path):
    scene = trotter(ground=sticky(friction=None, laws=rubbing(tmp_path, 0.25, 40.0)))
    paths = [
        "ground.laws.rubbing.growth",
        "robot.drives.leg0.law.gain",
        "robot.structure.legs.leg1.stiffness_l",
    ]
    # runs know the time of a stop, where friction has a corner, less well than all else: the rest agrees to 1e-8
    assert_as_differences(scene, paths, 0.008, 1e-4, (1e-3, 3e-4, 1e-4))


def test_a_trotter_differs_as_its_derivatives_say():
    paths = (MU, "signals.leg0.amplitude", "robot.feet.leg1.gap", "ground.restitution.coefficient")
    assert_as_differences(trotter(3), paths, 0.0071, 3e-6, (1e-4, 1e-3))


def test_a_trotter_differs_as_its_derivatives_by_structure_say():
    numbers = ("body.mass", "legs.leg0.x", "legs.leg1.stiffness_v", "legs.leg2.mass")
    paths = [f"robot.structure.{one}" for one in numbers]
    assert_as_differences(trotter(3), paths, 0.0071, 3e-6, (1e-4, 1e-3))


def test_a_standing_robot_sinks_by_its_mass():
    mass, stiff = 1e-6, 2.0
    leg = WalkerLeg(mass=1e-9, stiffness_v=stiff, damping_v=1e-4, stiffness_l=1.0, damping_l=0.0)
    scene = ts.Scene(
        name="standing",
        robot=Robot(
            structure=Walker(body=WalkerBody(mass=mass), legs={"leg": leg}), drives={},
            feet={"leg": Foot(point="leg", gap=0.0)},
        ),
        ground=sticky(adhesion=None), initial=Initial(standing=Standing()), duration=0.05,
    )  # fmt: skip
    by_mass, by_stiffness = "robot.structure.body.mass", "robot.structure.legs.leg.stiffness_v"
    run = ts.simulate(scene, gradients=[by_mass, by_stiffness])
    found = run.state_gradients(np.linspace(0.001, 0.049, 7))
    np.testing.assert_allclose(found[by_mass].x[1], -GRAVITY / stiff, rtol=1e-6)
    np.testing.assert_allclose(found[by_stiffness].x[1], mass * GRAVITY / stiff**2, rtol=1e-6)
    np.testing.assert_allclose(found[by_mass].pull[0], -GRAVITY, rtol=1e-6)


@pytest.mark.slow
def test_a_trotter_with_every_law_differs_as_its_derivatives_say():
    ground = sticky(
        film=ts.Film(coefficient=1e-22, thickness=2e-7),
        electrostatic=ts.Electrostatic(coefficient=1e-15, offset=1e-6),
    )
    paths = (
        "ground.film.coefficient", "ground.film.thickness", "ground.electrostatic.coefficient", MU,
        "signals.leg1.phase", "robot.feet.leg1.gap", "robot.structure.legs.leg0.mass",
    )  # fmt: skip
    assert_as_differences(trotter(3, ground=ground), paths, 0.01, 2e-7, (1e-5, 1e-4, 1e-3))


@pytest.mark.slow
def test_the_packaged_walker_differs_as_its_derivatives_say():
    paths = (
        MU,
        "ground.film.thickness",
        "ground.restitution.coefficient",
        "ground.adhesion.initial",
    )
    walker, steps = ts.load_scene("millipede"), (1e-4, 1e-3, 1e-2)
    # by no step do differences over it tell more: those over steps ten times apart differ by some 1e-6
    assert_as_differences(walker, paths, 0.026, 1e-5, steps)
    # volts of 0.1 % more move events by a thousand times what they are known to: states' own errors say 5e-5
    assert_as_differences(walker, ["gait.high"], 0.026, 2e-4, steps)


def test_measures_and_energies_of_a_walk_as_differences():
    scene, path, duration = trotter(3), MU, 0.0121
    paths = [path, "robot.feet.leg1.gap", "robot.structure.body.mass", "robot.structure.legs.leg1.damping_v"]
    ledger = ("work_in", "damping", "friction", "kinetic", "elastic", "impacts", "adhesion")
    terms = (*(f"ledger.{one}" for one in ledger), "mean_speed", "stride", "foot_slip")
    # the way slid in contact bends more than all else: runs to both sides know it to 3e-5, and say 1e-3
    assert_as_differences(scene, paths, duration, 5e-5, (1e-4,), terms)


def test_a_batch_and_an_objective_have_the_gradients_of_their_runs():
    scene = moving(block(), block_x=0.01)
    batch = ts.simulate_batch(scene, {MU: [0.3, 0.5]}, 0.02, gradients=[GRAV])
    got = batch.gradient("stride")[GRAV]
    assert got.shape == (2,) and np.allclose(got, 0.0)  # the body does not feel the block
    assert ts.gradient(lambda events: events["time"].max(), scene, [MU], 0.02)[MU] == pytest.approx(
        -0.01 / 0.09 / GRAVITY
    )


def test_where_a_walker_has_no_derivative_a_sentence_says_so():
    # a block at rest would be stopped by friction whichever way it began to move
    rest = ts.simulate(moving(block(), block_x=0.0), 0.01, gradients=["initial.velocity.2"])
    assert "otherwise" in rest.flags["initial.velocity.2"][0]
    # one that is lifted by more than its weight and dips to the very ground
    height = 1e-4
    speed = math.sqrt(2.0 * GRAVITY * height) * (1.0 + 1e-12)
    scene = falling(height, 0.0, signals={"upward": ts.Constant(level=2.0 * MASS * GRAVITY)})
    scene = scene.model_copy(
        update={"initial": Initial(displacement=(0.0, 0.0, 0.0, height), velocity=(0.0, 0.0, 0.0, -speed))}
    )
    grazing = ts.simulate(scene, 0.01, gradients=["initial.displacement.3"])
    assert len(grazing.events) and "otherwise" in grazing.flags["initial.displacement.3"][0]


@pytest.mark.parametrize("name", ["max_heave", "vertical_amplitude"])
def test_heights_of_the_body_are_derived_where_it_turned(name):
    path, step, fine = "gait.high", 1e-5, ts.Accuracy(gap=1e-11, drive=1e-11)
    scene = ts.load_scene("millipede-printed")
    size = step * ts.get_value(scene, path)
    wanted = slope([one.measures[name].value for one in runs_around(scene, path, size, 0.03, fine)], size)
    found = ts.simulate(scene, 0.03, fine, gradients=[path]).gradient(name)
    assert not found.flags and found[path] == pytest.approx(wanted, rel=1e-6)


def swinging(gap: float, damping: float = 0.0, **ground) -> ts.Scene:
    """A leg of a body too heavy to feel it swings from 0.5 m/s down, its spring's rest a gap above the ground."""
    leg = WalkerLeg(mass=2e-9, stiffness_v=1.5, damping_v=damping, stiffness_l=1.5, damping_l=damping)
    walker = Walker(body=WalkerBody(mass=1e4), legs={"foot": leg})
    return ts.Scene(
        name="swinging",
        robot=Robot(structure=walker, drives={}, feet={"foot": Foot(point="foot", gap=gap)}),
        ground=ts.Ground(restitution=ts.Restitution(coefficient=0.5), **ground),
        initial=Initial(velocity=tuple(-0.5 * walker.row("foot"))),
        duration=1e-3,
    )


@pytest.mark.parametrize(("part", "near"), [(1e-9, True), (1e-6, False)])
def test_a_near_miss_of_a_walkers_foot_has_no_derivative(part, near):
    path, reach = "robot.feet.foot.gap", 0.5 * math.sqrt(2e-9 / 1.5)
    run = ts.simulate(swinging(reach * (1.0 + part)), gradients=[path])
    assert len(run.events) == 0
    assert near == any("touches or leaves" in said for said in run.flags.get(path, ()))


def test_a_walkers_landing_at_the_threshold_of_the_pull_as_printed_has_no_derivative():
    path, gap, damping = "ground.restitution.coefficient", 1e-6, 2e-4

    def landed(adhesion: float) -> ts.solve.GradientRun:
        held = ts.Adhesion(initial=adhesion, rate=0.0)
        scene = swinging(gap, damping, adhesion=held, landing=ts.laws.PullAsPrinted())
        return ts.simulate(scene, 4e-6, gradients=[path])

    # (2.13): -k g + c e v
    printed = -1.5 * gap + damping * 0.5 * landed(0.0).events["speed_before"][0]
    assert printed > 0.0 and not landed(0.999 * printed).flags
    assert "touches or leaves" in landed(printed * (1.0 + 1e-9)).flags[path][0]
