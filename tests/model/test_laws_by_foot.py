"""Feet with grounds of their own: stops, pads and pawls of one robot."""

from __future__ import annotations

import math

import numpy as np
import pytest

import tarsus as ts
from scene_files import balls, scene
from sliding_scenes import by_modes
from walking_scenes import sticky, trotter

G = 9.81


def test_each_ball_bounces_as_its_own_ground_says() -> None:
    run = ts.simulate(balls())
    fall = math.sqrt(2.0 / G)
    for foot, e in enumerate((0.8, 0.3)):
        own = run.events[(run.events["foot"] == foot) & (run.events["kind"] == 1)]
        flights = 2.0 * fall * e ** np.arange(1, len(own))
        np.testing.assert_allclose(own["time"], fall + np.concatenate([[0.0], np.cumsum(flights)]), rtol=1e-12)
    assert run.ledger.closure < 1e-8


def test_a_law_that_one_foot_is_without() -> None:
    """The rear stop holds, the front one does not: each foot moves as it would alone, with forces and account of it."""
    film = {"coefficient": 2e-3, "thickness": 0.1}
    ground = {
        "film": film,
        "adhesion": {"initial": 5.0, "rate": 1.0},
        "restitution": {"coefficient": 0.5},
        "gravity": {"acceleration": G},
    }
    both = balls(ground=ground, grounds={"soft": {"restitution": {"coefficient": 0.5}}})
    run = ts.simulate(both)
    for foot, (mass, own) in enumerate([(1.0, ground), (2.0, ground | {"film": None, "adhesion": None})]):
        alone = ts.simulate(scene("ball", {"robot.structure.mass": [mass], "ground": own, "duration": 2.5}))
        mine = run.events[run.events["foot"] == foot]
        np.testing.assert_array_equal(mine["kind"], alone.events["kind"])
        np.testing.assert_allclose(mine["time"], alone.events["time"], rtol=1e-9)
    series = run.to_dataset()
    assert run.ledger.closure < 1e-8 and run.ledger.laws["film"] < 0.0
    assert float(np.abs(series["film_force"][1]).max()) == 0.0 < float(np.abs(series["film_force"][0]).max())
    assert float(series["adhesion_strength"][1].max()) == 0.0 < float(series["adhesion_strength"][0].max())


def test_friction_of_each_foot() -> None:
    """A sledge on a runner, which bears as much as it can, and a pad: it starts when both give way."""
    structure = ts.Lumped(
        coordinates=("front", "rear", "x"),
        mass=[1.0, 1.0, 2.0],
        stiffness=[0.0] * 3,
        upward=(1.0, 1.0, 0.0),
        forward=(0.0, 0.0, 1.0),
    )
    pull = ts.Drive(load=ts.PointLoad(weights={"x": 1.0}), law=ts.LinearForce(gain=1.0))
    feet = {
        "front": ts.Foot(point="front", gap=0.0, along="x"),
        "rear": ts.Foot(point="rear", gap=0.0, along="x", ground="pad"),
    }
    sledge = ts.Scene(
        name="sledge",
        robot=ts.Robot(structure=structure, drives={"rope": pull}, feet=feet),
        ground={"gravity": {"acceleration": G}, "friction": {"coefficient": 0.1}},
        grounds={"pad": {"friction": {"coefficient": 0.5}}},
        signals={"rope": ts.waveforms.Ramp(stop=10.0, duration=1.0)},
        duration=1.0,
    )
    run = ts.simulate(sledge)
    slips = run.events[run.events["kind"] == 7]
    assert slips["time"][slips["foot"] == 1][0] == pytest.approx(0.6 * G / 10.0, rel=1e-9)
    assert run.states(np.array([0.58])).v[2, 0] == 0.0  # the runner alone gives way before
    late = run.at(np.array([0.9])).friction
    np.testing.assert_allclose(late[:, 0], [-0.1 * G, -0.5 * G], rtol=1e-9)


def test_an_electrode_elsewhere_is_a_foot_that_never_lands() -> None:
    """A plate at the middle of a bar pulls, and its stop is at the tip: statics of the bar, well before pull-in."""
    structure = ts.Lumped(
        coordinates=("middle", "tip"), mass=[1e-9, 1e-9], stiffness=[[3.0, -1.0], [-1.0, 1.0]], damping=[2e-4, 2e-4]
    )
    gate = ts.Drive(load=ts.PointLoad(weights={"middle": 1.0}), law=ts.LinearForce(gain=0.0))
    feet = {
        "stop": ts.Foot(point="tip", gap=1e-6),
        "plate": ts.Foot(point="middle", gap=1e-5, electrode="gate", ground="plate"),
    }
    law = {"coefficient": 1e-19, "offset": 1e-6}
    bar = ts.Scene(
        name="bar",
        robot=ts.Robot(structure=structure, drives={"gate": gate}, feet=feet),
        ground={"restitution": {"coefficient": 0.5}, "electrostatic": law, "adhesion": {"initial": 1e-9, "rate": 0.0}},
        grounds={"plate": {"electrostatic": law}},
        signals={"gate": ts.Constant(level=5.0)},
        duration=0.02,
    )
    run = ts.simulate(bar)
    last = run.states(np.array([0.02])).x[:, 0]
    pull = -1e-19 * 25.0 / (1e-5 + last[0] + 1e-6) ** 2
    np.testing.assert_allclose(structure.matrices().stiffness @ last, [pull, 0.0], rtol=0.0, atol=1e-6 * abs(pull))


def test_a_walker_has_them_by_legs_as_by_contact_modes() -> None:
    """One foot on a pad without film, with other friction and restitution: both systems find the same events."""
    walker = trotter(2, ground=sticky(film=ts.Film(coefficient=1e-20, thickness=1e-6)))
    pad = {"friction": {"coefficient": 0.2}, "restitution": {"coefficient": 0.2}, "adhesion": walker.ground.adhesion}
    own = {f"robot.feet.{next(iter(walker.robot.feet))}.ground": "pad", "grounds": {"pad": pad}}
    fine = ts.Accuracy(gap=1e-10, drive=1e-11)
    legs, modes, same = (
        ts.simulate(one, 0.002, accuracy=fine)
        for one in (ts.with_values(walker, own), ts.with_values(by_modes(walker), own), walker)
    )
    assert len(legs.events) > 5 and max(legs.ledger.closure, modes.ledger.closure) < 1e-8
    np.testing.assert_array_equal(legs.events["kind"], modes.events["kind"])
    np.testing.assert_allclose(legs.events["time"], modes.events["time"], rtol=1e-9)
    assert abs(legs.events["time"][0] - same.events["time"][0]) > 1e-6
