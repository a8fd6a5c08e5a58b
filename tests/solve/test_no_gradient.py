"""Where a run has no derivative by a number, and the sentence that says so."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import tarsus as ts
from scene_files import scene as scene_of
from tarsus.base.spec import with_values
from tarsus.model.scene import Foot, Initial, Robot
from tarsus.model.structure import Walker, WalkerBody, WalkerLeg
from walking_scenes import GRAVITY, block, moving

MASS = 1e-6  # of the block [kg]


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


@pytest.mark.parametrize("part", [-1e-9, 1e-9])
def test_a_grazing_touchdown_and_a_near_miss_have_no_derivative(part):
    scene = scene_of("impact_oscillator")
    path = "robot.feet.stop.gap"
    free = ts.simulate(with_values(scene, {path: 1e3}), 20.0)
    times = np.linspace(0.0, 20.0, 20001)
    x = free.states(times).x[0]
    tops = np.flatnonzero((x[1:-1] > x[:-2]) & (x[1:-1] > x[2:])) + 1
    k = int(tops[np.argmax(x[tops])])
    near = minimize_scalar(
        lambda t: -free.states(np.array([t])).x[0, 0],
        bounds=(times[k - 1], times[k + 1]),
        method="bounded",
        options={"xatol": 1e-12},
    )
    run = ts.simulate(with_values(scene, {path: -near.fun * (1.0 + part)}), 20.0, gradients=[path])
    assert any("touches or leaves the ground otherwise from 19.77" in said for said in run.flags[path])
    late = run.events["time"] > 19.78
    assert np.isnan(run.event_gradients[path]["time"][late]).all()
    clear = ts.simulate(with_values(scene, {path: -near.fun * (1.0 + 1e3 * part)}), 20.0, gradients=[path])
    assert not clear.flags


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


def falling(height: float, **changes) -> ts.Scene:
    """The block let go at a height."""
    scene = moving(block(**changes), block_x=0.0)
    return scene.model_copy(
        update={"initial": Initial(displacement=(0.0, 0.0, 0.0, height), velocity=scene.initial.velocity)}
    )


def test_where_a_walker_has_no_derivative_a_sentence_says_so():
    # a block at rest would be stopped by friction whichever way it began to move
    rest = ts.simulate(moving(block(), block_x=0.0), 0.01, gradients=["initial.velocity.2"])
    assert "otherwise" in rest.flags["initial.velocity.2"][0]
    # one that is lifted by more than its weight and dips to the very ground
    height = 1e-4
    speed = math.sqrt(2.0 * GRAVITY * height) * (1.0 + 1e-12)
    scene = falling(height, signals={"upward": ts.Constant(level=2.0 * MASS * GRAVITY)})
    scene = scene.model_copy(
        update={"initial": Initial(displacement=(0.0, 0.0, 0.0, height), velocity=(0.0, 0.0, 0.0, -speed))}
    )
    grazing = ts.simulate(scene, 0.01, gradients=["initial.displacement.3"])
    assert len(grazing.events) and "otherwise" in grazing.flags["initial.displacement.3"][0]


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
@pytest.mark.parametrize(("part", "near"), [(1e-9, True), (1e-6, False)])
def test_a_near_miss_has_no_derivative(make, reach, part, near):
    """It turns a part of its way above the ground."""
    path = "robot.feet.foot.gap"
    run = ts.simulate(make(reach * (1.0 + part)), gradients=[path])
    assert len(run.events) == 0
    assert near == any("touches or leaves" in said for said in run.flags.get(path, ()))


def test_a_foot_that_starts_at_a_corner_has_no_derivative() -> None:
    stairs = {"kind": "staircase", "tread": 1e-3, "rise": -1e-4, "start": 0.0}
    scene = with_values(block(), {"ground.profile": stairs, "robot.feet.block.gap": 1e-3})
    flags = ts.simulate(scene, 0.02, gradients=["ground.profile.start"]).flags
    assert "otherwise" in flags["ground.profile.start"][0]
