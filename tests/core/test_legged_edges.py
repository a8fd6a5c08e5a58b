"""Walkers at the edges of what can be described."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from random_scenes import OWN
from tarsus.core import _native
from tarsus.model.structure import WalkerBody, WalkerLeg
from turning_scenes import across
from walking_scenes import sticky, trotter


def test_a_leg_without_a_foot_takes_no_share_of_what_laws_do() -> None:
    """It just swings: as if its foot were a metre above the ground."""
    law = ts.Electrostatic(coefficient=1e-19, offset=1e-6)
    magnet = OWN["magnet"](strength=1e-30, depth=1e-6)
    scene = trotter(ground=sticky(electrostatic=law, laws={"magnet": magnet}))
    feet = {name: foot for name, foot in scene.robot.feet.items() if name != "leg1"}
    bare = scene.model_copy(update={"robot": scene.robot.model_copy(update={"feet": feet})})
    far = ts.with_values(scene, {"robot.feet.leg1.gap": 1.0})
    one, other = (ts.simulate(made, 2e-3).ledger.laws for made in (bare, far))
    largest = max(abs(work) for work in other.values())
    assert largest > 0.0
    for name, work in other.items():
        assert abs(one[name] - work) < 1e-5 * largest


def test_friction_whose_bound_is_zero_is_none() -> None:
    """In a disk, where its direction was looked for in what it takes."""
    adhesion = ts.Adhesion(initial=0.0, rate=0.0)
    without = across(trotter(1, damping=0.0, turning=False, ground=ts.Ground(adhesion=adhesion)))
    adhesive = ts.with_values(without, {"ground.friction": {"kind": "adhesive", "coefficient": 0.02}})
    times = np.linspace(0.0, 0.02, 41)
    one, other = (ts.simulate(made) for made in (without, adhesive))
    assert one.ok and other.ok and other.ledger.closure < 1e-8
    x, wanted = (run.at(times).state.x for run in (other, one))
    np.testing.assert_allclose(x, wanted, atol=1e-9 * np.abs(wanted).max())


@pytest.mark.parametrize("frequency", [2013.7, 2000.0])
def test_a_leg_that_rings_for_thousands_of_periods_keeps_its_account(frequency: float) -> None:
    """At 5 MHz and undamped, under a slow sine: its work was 1.5e-8 off, by what steps miss of its rates. After whole
    periods all terms are zero again, and the account was called open. It is 4e-10 off with fused products, and 8e-9 on
    processors that round each of them."""
    mass = 4e-13
    stiffness = mass * (2.0 * np.pi * 5e6) ** 2
    leg = WalkerLeg(x=0.0, mass=mass, stiffness_v=stiffness, damping_v=0.0, stiffness_l=stiffness, damping_l=0.0)
    drive = ts.Drive(load=ts.PointLoad(weights={"leg": 1.0, "leg_hip": -1.0}), law=ts.LinearForce(gain=1e-6))
    scene = ts.Scene(
        name="ringing",
        duration=5e-3,
        signals={"d": ts.Sine(amplitude=30.0, frequency=frequency)},
        robot=ts.Robot(
            structure=ts.Walker(body=WalkerBody(mass=1e-9), legs={"leg": leg}),
            drives={"d": drive},
            feet={"leg": ts.Foot(point="leg", gap=1e-6)},
        ),
        ground=ts.Ground(restitution=ts.Restitution(coefficient=0.5)),
    )
    run = ts.simulate(scene)
    assert run.ok and run.ledger.closure < (1e-8 if _native.built["rows"] == "SSE" else 1e-9)
