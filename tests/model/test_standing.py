"""Standing still: forces balance at the start, and what cannot stand is told."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.design import standing
from tarsus.files.toml import parse_scene, scene_text
from tarsus.model.structure import Walker
from tarsus_reproduce.walkers import many_legs

G, K, WEIGHT = 9.81, 1.25, 9.81e-6
LEG = {"mass": "1 ug", "stiffness_v": K, "damping_v": 0.0, "stiffness_l": 0.5, "damping_l": 0.0}
CORNERS = {"LF": (1e-3, 1e-3), "RF": (1e-3, -1e-3), "LH": (-1e-3, 1e-3), "RH": (-1e-3, -1e-3)}
TURNS = {"roll_inertia": 1e-13, "pitch_inertia": 1e-13}
PAIR = {"a": {}, "b": {}}


def scene(legs, body=None, *, gap=0.0, push=None, volts=0.0) -> ts.Scene:
    """A body of 1 mg on legs; ``push``: weights of a drive of 1 uN/V at constant volts."""
    structure = Walker(body={"mass": "1 mg", **(body or {})}, legs={name: {**LEG, **leg} for name, leg in legs.items()})
    law = ts.LinearForce(gain="1 uN/V")
    return ts.Scene(
        name="stand",
        robot=ts.Robot(
            structure=structure,
            drives={"push": ts.Drive(load=ts.PointLoad(weights=push), law=law)} if push else {},
            feet={name: ts.Foot(point=name, gap=gap) for name in legs},
        ),
        ground=ts.Ground(gravity=ts.Gravity(acceleration=G), adhesion=ts.Adhesion(initial=0.0, rate=0.0)),
        signals={"push": ts.Constant(level=volts)} if push else {},
        duration=0.1,
    )


def corners(**changes):
    return {name: {"x": x, "y": y, **changes.get(name, {})} for name, (x, y) in CORNERS.items()}


def refusals(it: ts.Scene, **how: bool) -> list[str]:
    with pytest.raises(InputError) as caught:
        standing(it, **how)
    return caught.value.problems


def test_forces_balance_on_uneven_legs():
    whole = many_legs(scatter=0.3, dead=("L4", "R9"), seed=2)
    it = standing(whole)
    walker, x = it.robot.structure, np.array(it.initial.displacement)
    matrices = walker.matrices()
    push = matrices.stiffness @ x + G * matrices.mass @ walker.vertical()
    weight = G * (walker.body.mass + sum(leg.mass for leg in walker.legs.values()))
    np.testing.assert_allclose(push[: walker.body_size], 0.0, atol=1e-12 * weight)
    np.testing.assert_allclose(push[walker.body_size :: 2], 0.0, atol=1e-12 * weight)
    feet = push[walker.body_size + 1 :: 2]
    assert feet.min() > 0.0 and feet.sum() == pytest.approx(weight, rel=1e-12)
    hips = np.array([(leg.x, leg.y) for leg in walker.legs.values()])
    np.testing.assert_allclose(feet @ hips, 0.0, atol=1e-12 * weight * 5e-3)
    assert parse_scene(scene_text(it)) == it


def test_volts_at_the_start_lift_the_body_where_both_legs_push():
    it = scene(PAIR, push={"body": 1.0, "a": -0.5, "b": -0.5}, volts=20.0)
    sag = WEIGHT / (2 * K)
    assert standing(it).initial.displacement[1] == pytest.approx(-sag)
    assert standing(it, driven=True).initial.displacement[1] == pytest.approx(20e-6 / (2 * K) - sag)


def test_a_leg_without_a_foot_hangs():
    it = scene(corners(LF={"mass": "2 ug"}), TURNS)
    hurt = ts.with_values(it, {"robot.feet": {name: it.robot.feet[name] for name in ("RF", "LH", "RH")}})
    # The body stands on the line from RF to LH: twice a foot's weight at LF takes one foot's weight off RH.
    assert refusals(hurt) == ["foot 'RH' would have to be pulled down by 9.81 nN: it does not stand"]
    stuck = standing(ts.with_values(hurt, {"ground.adhesion.initial": "10 nN"}))
    walker, at = stuck.robot.structure, np.array(stuck.initial.displacement)
    assert (walker.row("LF_hip") - walker.row("LF")) @ at == pytest.approx(2e-9 * G / K, rel=1e-9)
    limp = ts.with_values(hurt, {"robot.structure.legs.LF.stiffness_v": 0.0})
    assert refusals(limp) == [
        "the foot of leg 'LF' has no support: the leg has no stiffness upward and stands on no ground"
    ]


def test_a_foot_that_pulls_does_not_stand_unless_it_sticks():
    it = scene(PAIR, push={"a": 1.0, "a_hip": -1.0}, volts=10.0)
    pull = 0.5 * (10e-6 - WEIGHT) - 1e-9 * G  # the springs share the lift and the body's weight
    assert pull == pytest.approx(85.19e-9)
    said = ["foot 'a' would have to be pulled down by 85.19 nN: it does not stand"]
    assert refusals(it, driven=True) == said
    assert standing(ts.with_values(it, {"ground.adhesion.initial": "85.2 nN"}), driven=True)
    law = ts.Electrostatic(coefficient=85.2e-9 * 1e-12 / 100.0, offset=1e-6)
    charged = ts.with_values(it, {"robot.feet.a.electrode": "push", "ground.electrostatic": law})
    assert standing(charged, driven=True)
    weaker = ts.with_values(charged, {"ground.electrostatic.coefficient": 0.99 * law.coefficient})
    assert refusals(weaker, driven=True)[0].startswith("foot 'a' would have to be pulled down by 84")


def test_what_does_not_hold_the_body_up():
    row = scene({"a": {"x": 1e-3}, "b": {"x": -1e-3}}, TURNS)
    assert refusals(row) == ["the body is not held up: its feet leave it free to roll"]
    limp = scene({"a": {"stiffness_v": 0.0}})
    assert refusals(limp) == ["the body is not held up: its feet leave it free to heave"]
    behind = {"x": 0.5e-3}
    ahead = scene(corners(LH=behind, RH=behind), TURNS)  # all feet before the centre of mass
    assert [said.split("'")[1] for said in refusals(ahead)] == ["LF", "RF"]


def test_an_unbalanced_push_along_the_way():
    it = scene(PAIR, push={"body_x": 1.0, "a": -1.0, "a_hip": 1.0}, volts=1.0)
    assert standing(it)
    said = ["the forces along the way do not balance: the robot would not stand still"]
    assert refusals(it, driven=True) == said


def test_a_scene_that_starts_standing_does_so_for_every_payload():
    it = scene(PAIR)
    starts = ts.with_values(it, {"initial.standing": {"driven": False}})
    for mass in (0.5e-6, 2e-6):
        own = ts.with_values(starts, {"robot.structure.body.mass": mass})
        run = ts.simulate(own, 1e-3)
        sag = mass * G / (2 * K)
        assert run.states(np.array([0.0, 1e-3])).x[1] == pytest.approx([-sag] * 2, rel=1e-12)
        assert run.measures["vertical_amplitude"].value == pytest.approx(0.0, abs=1e-15)
    batch = ts.simulate_batch(starts, {"robot.structure.body.mass": [0.5e-6, 2e-6]}, 1e-3)
    heaves = [batch.run(i).marks["body"][0, 1] for i in range(2)]
    assert heaves == pytest.approx([-mass * G / (2 * K) for mass in (0.5e-6, 2e-6)], rel=1e-12)
